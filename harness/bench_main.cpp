#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

namespace {

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2;
}

/// Benchmarks are named group/what; the group's first entry is its hand-written baseline.  Prints the median nanoseconds of one
/// counted item (lookup, draw) and the ratio to the baseline: ratios of one process carry over to other machines, nanoseconds do
/// not.
class RatioReporter final : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& context) override {
    PrintBasicContext(&GetErrorStream(), context);
    return true;
  }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      const std::string name = run.run_name.function_name;
      if (!values_.contains(name)) order_.push_back(name);
      const auto items = run.counters.find("items");
      values_[name].push_back(run.real_accumulated_time * 1e9 / (items == run.counters.end() ? 1 : items->second.value));
    }
  }

  void Finalize() override {
    // Interleaving reports cells in random order; by name they stand in groups with the baseline ("0 ...") first.
    std::sort(order_.begin(), order_.end());
    std::string group;
    double base = 0;
    for (const std::string& name : order_) {
      const std::size_t slash = name.find('/');
      const double ns = median(values_[name]);
      if (name.substr(0, slash) != group) {
        group = name.substr(0, slash);
        base = ns;
        fmt::print("\n{}\n", group);
      }
      std::vector<double> deviation;
      for (const double value : values_[name]) deviation.push_back(std::abs(value - ns));
      fmt::print("  {:<44} {:8.2f} ns  +-{:4.1f} %  {:6.2f}x\n", name.substr(slash + 1), ns, 100 * median(deviation) / ns,
                 ns / base);
    }
  }

 private:
  std::vector<std::string> order_;
  std::map<std::string, std::vector<double>> values_;
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
  RatioReporter reporter;
  return benchmark::RunSpecifiedBenchmarks(&reporter) > 0 ? 0 : 5;
}
