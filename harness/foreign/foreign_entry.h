#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "harness/registry/estimator_entry.h"

namespace nullmark {

/// The entry of a source whose tracker is not known before it is opened.  Source has kName and kSummary.
template <class Source>
EstimatorEntry foreign_entry(std::vector<Quantity> quantities) {
  EstimatorEntry entry;
  entry.name = Source::kName;
  entry.summary = Source::kSummary;
  entry.quantities = std::move(quantities);
  entry.make = []() -> std::unique_ptr<EstimatorSource> { return std::make_unique<Source>(); };
  entry.foreign = true;
  return entry;
}

}  // namespace nullmark
