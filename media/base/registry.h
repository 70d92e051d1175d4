#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "media/base/medium.h"

namespace nullmark {

/// Entries by name.  Filled before main() by static objects, read-only afterwards.
template <class Entry>
class Registry {
 public:
  static Registry& instance() {
    static Registry registry;
    return registry;
  }

  bool add(Entry entry) {
    if (find(entry.name)) taken_ = entry.name;
    const auto at = std::lower_bound(entries_.begin(), entries_.end(), entry,
                                     [](const Entry& a, const Entry& b) { return std::string_view(a.name) < b.name; });
    entries_.insert(at, std::move(entry));
    return true;
  }

  const Entry* find(std::string_view name) const {
    for (const Entry& entry : entries_)
      if (entry.name == name) return &entry;
    return nullptr;
  }

  /// A name that two entries claim, as when a plug-in takes one of the tree's; empty where there is none.
  const std::string& taken_twice() const { return taken_; }

  /// Sorted by name.
  const std::vector<Entry>& entries() const { return entries_; }

 private:
  std::vector<Entry> entries_;
  std::string taken_;
};

/// A data file that is not there.  Cells of media that were declared optional are skipped with this reason; otherwise exit
/// code 2.
struct MissingData : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A medium's parameters before it is built.
class MediumSource {
 public:
  virtual ~MediumSource() = default;
  virtual void parameters(ParameterVisitor& visit) = 0;
  /// Throws ParameterError or MissingData.
  virtual std::shared_ptr<const Medium> build() const = 0;
};

struct MediumEntry {
  std::string name, summary, source;
  std::unique_ptr<MediumSource> (*make)() = nullptr;
};

/// Source is default-constructible, derives from Base and has the static strings kName, kSummary,
/// kSource.
template <class Entry, class Base, class Source>
Entry registry_entry() {
  return {Source::kName, Source::kSummary, Source::kSource, []() -> std::unique_ptr<Base> { return std::make_unique<Source>(); }};
}

}  // namespace nullmark

#define NULLMARK_CONCATENATE_(a, b) a##b
#define NULLMARK_CONCATENATE(a, b) NULLMARK_CONCATENATE_(a, b)

#define NULLMARK_REGISTER_MEDIUM(...)                                                      \
  [[maybe_unused]] static const bool NULLMARK_CONCATENATE(nullmark_medium_, __COUNTER__) = \
      ::nullmark::Registry<::nullmark::MediumEntry>::instance().add(                       \
          ::nullmark::registry_entry<::nullmark::MediumEntry, ::nullmark::MediumSource, __VA_ARGS__>())
