#pragma once

#include <string>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// How a part of a claim compares the measured with the claimed.
enum class Relation { near, at_most, at_least, unbiased };

/// One comparison, or the same comparison for each of several cells.
struct ClaimPart {
  std::string says;  ///< this part of the claim in words; may be empty if it is the only part
  Relation relation = Relation::near;
  std::string metric;               ///< compared for every cell; empty for `unbiased`
  std::vector<std::string> cells;   ///< names of cells
  std::vector<Real> numbers;        ///< to compare with: one for all cells, or one each
  std::vector<std::string> others;  ///< to compare with: the same metric of a cell for each
  bool theory = false;              ///< to compare with: the metric of each cell from theory
  Real factor = 1;                  ///< multiplies what is compared with
  Real tolerance = 0;               ///< `near`: relative
  std::string slope_against;        ///< not empty: compares the slope of log metric over log of this metric
};

/// A statement of a publication, or of theory, that cells of this configuration test.
struct PublishedClaim {
  std::string id;      ///< "C03"
  std::string source;  ///< paper and place, or the equation
  std::string claim;   ///< what is claimed
  std::string note;    ///< how the test differs from the publication, where it does
  std::vector<ClaimPart> parts;
  bool required = false;  ///< it must be reproduced; otherwise a refuted claim is a result, not a failure
};

}  // namespace nullmark
