#pragma once

#include <string>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// How a part of a claim compares what was measured with what it should be.
enum class Relation { near, at_most, at_least, unbiased };

/// One comparison, or one of the same kind for each of several cells.
struct ClaimPart {
  std::string says;  ///< what this part of the claim is, in words; may be empty where there is one part
  Relation relation = Relation::near;
  std::string metric;               ///< of every cell; none for `unbiased`
  std::vector<std::string> cells;   ///< names of cells
  std::vector<Real> numbers;        ///< to compare with: one for all cells, or one each
  std::vector<std::string> others;  ///< to compare with: the same metric of a cell for each
  bool theory = false;              ///< to compare with: what theory says of the metric of each cell
  Real factor = 1;                  ///< on what is compared with
  Real tolerance = 0;               ///< `near`: relative
  std::string slope_against;        ///< not empty: log metric against log of this metric over all cells, its slope is compared
};

/// A statement of a publication that cells of this configuration put to the test.
struct PublishedClaim {
  std::string id;      ///< "C03"
  std::string source;  ///< paper and place
  std::string claim;   ///< what is claimed
  std::string note;    ///< how the test differs from the publication, where it does
  std::vector<ClaimPart> parts;
};

}  // namespace nullmark
