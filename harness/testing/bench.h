#pragma once

#include <benchmark/benchmark.h>

#include <vector>

namespace nullmark {

/// Adds benchmarks once main begins: before, the registries of estimators, media and majorants are incomplete.
class BenchmarkGroup {
 public:
  explicit BenchmarkGroup(void (*add)()) { all().push_back(add); }

  static void add_all() {
    for (const auto add : all()) add();
  }

 private:
  static std::vector<void (*)()>& all() {
    static std::vector<void (*)()> groups;
    return groups;
  }
};

/// What a figure is the price of one of ("point", "sample"), and how many the benchmark made.
inline void count_items(benchmark::State& state, const char* item, std::uint64_t count) {
  state.SetLabel(item);
  state.counters["items"] = static_cast<double>(count);
}

/// Lookups that those items took, where they took any: the figure is told per lookup as well.
inline void count_lookups(benchmark::State& state, std::uint64_t count) {
  state.counters["lookups"] = static_cast<double>(count);
}

}  // namespace nullmark
