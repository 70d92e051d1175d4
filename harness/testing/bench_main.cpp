#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "harness/testing/bench.h"

namespace {

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2;
}

/// Benchmarks are named group/what; the group's baseline is the entry "0 ...", as a rule a hand-written one.  Prints the median
/// nanoseconds of one counted item over the repetitions (of the thread, for other processes share the machine), their median
/// absolute deviation and the ratio to the baseline: ratios of one process carry over to other machines, nanoseconds do not.
/// Where items take lookups, how many, and the nanoseconds of one.  A filter that leaves a group's baseline out leaves its ratios
/// out.
class RatioReporter final : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& context) override {
    PrintBasicContext(&GetErrorStream(), context);
    return true;
  }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      Figures& figures = figures_[run.run_name.function_name];
      const double items = counter(run, "items", 1);
      figures.item = run.report_label;
      figures.ns.push_back(run.cpu_accumulated_time * 1e9 / items);
      figures.lookups.push_back(counter(run, "lookups", 0) / items);
    }
  }

  void Finalize() override {
    // Interleaving reports cells in random order; by name they stand in groups with the baseline ("0 ...") first.
    std::string group;
    double base = 0;  // 0: the baseline was not run
    for (const auto& [name, figures] : figures_) {
      const std::size_t slash = name.find('/');
      const double ns = median(figures.ns), lookups = median(figures.lookups);
      const std::string what = name.substr(slash + 1);
      if (name.substr(0, slash) != group) {
        group = name.substr(0, slash);
        base = what.starts_with("0 ") ? ns : 0;
        fmt::print("\n{}\n", group);
      }
      std::vector<double> deviation;
      for (const double value : figures.ns) deviation.push_back(std::abs(value - ns));
      fmt::print("  {:<48} {:9.2f} ns/{:<8} +-{:4.1f} %  {:>6}", what, ns, figures.item, 100 * median(deviation) / ns,
                 base > 0 ? fmt::format("{:.2f}x", ns / base) : "");
      if (lookups > 0) fmt::print("  {:7.2f} lookups of {:6.2f} ns", lookups, ns / lookups);
      fmt::print("\n");
    }
  }

 private:
  struct Figures {
    std::string item;
    std::vector<double> ns, lookups;
  };

  static double counter(const Run& run, const char* name, double otherwise) {
    const auto found = run.counters.find(name);
    return found == run.counters.end() ? otherwise : found->second.value;
  }

  std::map<std::string, Figures> figures_;
};

}  // namespace

int main(int argc, char** argv) {
  std::vector<char*> arguments(argv, argv + argc);
  char interleave[] = "--benchmark_enable_random_interleaving=true", repetitions[] = "--benchmark_repetitions=9",
       time[] = "--benchmark_min_time=0.02";
  arguments.insert(arguments.begin() + 1, {interleave, repetitions, time});
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 2;
  nullmark::BenchmarkGroup::add_all();
  RatioReporter reporter;
  return benchmark::RunSpecifiedBenchmarks(&reporter) > 0 ? 0 : 5;
}
