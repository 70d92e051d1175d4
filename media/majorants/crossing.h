#pragma once

#include <string>

#include "media/base/parameters.h"
#include "media/majorants/majorant.h"

namespace nullmark {

/// The parameter "crossing" of structures with several cells.
struct CrossingChoice {
  std::string rule = "carry";

  void parameters(ParameterVisitor& visit) {
    visit.choice("crossing", rule, {"carry", "rewind"},
                 "at a cell's end a flight carries the rest of its exponential on, or is cut and drawn anew (Yue et al. 2010)");
  }
  Crossing chosen() const { return rule == "rewind" ? Crossing::rewind : Crossing::carry; }
};

}  // namespace nullmark
