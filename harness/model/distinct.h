#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "harness/model/shared.h"

namespace nullmark {

/// Adds specifications to lists that hold equal ones once.  Finds among thousands by label, which equal specifications share.
class Distinct {
 public:
  /// Place of the specification in `list`, to which it is added if it is not there.  One list for each Distinct.
  template <class Spec>
  std::size_t place_in(std::vector<Shared<Spec>>& list, const Shared<Spec>& spec) {
    std::vector<std::size_t>& places = of_label_[spec->label];
    for (const std::size_t place : places)
      if (list[place] == spec) return place;
    places.push_back(list.size());
    list.push_back(spec);
    return list.size() - 1;
  }

 private:
  std::map<std::string, std::vector<std::size_t>> of_label_;
};

}  // namespace nullmark
