#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/sampling/sampling.h"
#include "harness/verdict/judge.h"

namespace nullmark {

/// What one part of a split cell draws for all of them: theory, the pilot, laws, reliance.
struct CommonDraws {
  CellTheory theory;
  DrawnPilot pilot;
  std::vector<Real> pilot_kept;  ///< values of the kept samples of the pilot
  /// Nothing where they depend on the lookups of all samples; then `merge` draws them.
  std::optional<WalkLaws> laws;
  std::optional<Real> reliance;
};

/// Portions of one span.
struct DrawnSpan {
  std::uint64_t per_ray = 0;
  Portions portions;
};

/// What parts of a cell have drawn, without what is made of it.
struct CellDraws {
  std::string cell;        ///< its id
  std::uint64_t plan = 0;  ///< hash of the tests that evidence was gathered for
  std::optional<CommonDraws> common;
  std::map<std::uint64_t, DrawnSpan> spans;  ///< by first sample
};

/// As text: bytes, gzip, base64.
std::string draws_text(CellDraws draws);

/// Throws InputError, which begins with `where`, for a text that is damaged.
CellDraws read_draws(std::string_view text, const std::string& where);

/// Adds what other parts of the cell have drawn.  Throws InputError where they do not fit.
void join(CellDraws& draws, CellDraws more, const std::string& where);

/// Hash of everything in the tests that evidence depends on; 0 without tests.
std::uint64_t hash_of(const TestPlan* plan);

/// The shapes that portions of a span have.
class PortionShapes {
 public:
  PortionShapes(std::size_t rays, std::size_t outputs, const SampleSpan& span, const TestPlan* plan);
  bool fit(std::size_t number, const Portion& portion) const;

 private:
  SpanCut cut_;
  std::size_t outputs_, tests_, variances_;
  std::vector<std::size_t> kept_;  ///< values by portion
};

/// Whether a theory has the shape of the cell's.
bool fits(const CellTheory& theory, const PreparedCell& prepared);

}  // namespace nullmark
