#include "harness/run/run_cell.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/in_flight.h"
#include "harness/run/cell_draws.h"
#include "harness/run/cell_images.h"
#include "harness/run/cell_record.h"
#include "harness/sampling/cell_theory.h"
#include "harness/sampling/failure.h"
#include "harness/verdict/reliance.h"

namespace nullmark {
namespace {

bool moments_are_finite(const CellRecord& record) {
  return std::all_of(record.channel.begin(), record.channel.end(), [&](const ChannelRecord& channel) {
    return channel.mean && (channel.variance || record.cell.samples_per_ray == 1);
  });
}

/// What earlier parts have drawn of a cell; nothing of none.
std::optional<CellDraws> stored_draws(const CellTask& task) {
  if (!task.drawn || task.drawn->drawn_parts.empty()) return std::nullopt;
  const std::string where = fmt::format("cell \"{}\"", task.drawn->cell.name);
  CellDraws all = read_draws(task.drawn->drawn_parts[0], where);
  for (std::size_t i = 1; i < task.drawn->drawn_parts.size(); ++i)
    join(all, read_draws(task.drawn->drawn_parts[i], where), where);
  if (all.cell != task.prepared.cell->id) throw InputError(where + ": found samples of another cell; run its shard again");
  return all;
}

/// One cell under way.
class CellRun {
 public:
  CellRun(const Plan& plan, const CellTask& task, const Families& families, const RunOptions& options,
          const RunObserver& observer, std::function<bool()> stop)
      : plan_(plan),
        task_(task),
        prepared_(task.prepared),
        families_(families),
        options_(options),
        observer_(observer),
        stop_(std::move(stop)),
        outcome_{std::make_shared<CellRecord>(blank_record(plan, task.prepared)), {}},
        record_(*outcome_.record) {}

  CellOutcome run(const std::function<const char*()>& why_stopped) {
    if (!prepared_.reason.empty()) {
      tell_why_not();
      return outcome_;
    }
    stored_ = stored_draws(task_);
    const bool done = !stop_() && prepare() && (task_.share.parts > 1 ? draw_part() : judge_whole());
    if (done || record_.status != Status::not_run) return outcome_;
    if (!open_) record_.reason = why_stopped();
    if (task_.drawn) record_.drawn_parts = task_.drawn->drawn_parts;
    return outcome_;
  }

 private:
  void tell_why_not() {
    record_.status = prepared_.failure.empty() ? Status::skipped : Status::error;
    record_.reason = prepared_.reason;
  }

  /// Theory, the pilot and the plan of the tests.  False if the cell cannot go on.
  bool prepare() {
    const bool known = stored_ && stored_->common;
    if (stored_ && !known && !task_.may_draw) return leave_open("the first part of the cell is missing");
    if (known) {
      if (!fits(stored_->common->theory, prepared_)) fail_stored();
      take_theory(prepared_, stored_->common->theory);
    } else if (stored_) {
      std::vector<PreparedCell> alone = {prepared_};
      alone[0].theory_later = false;
      add_theory(alone, stop_);
      prepared_ = std::move(alone[0]);
    }
    record_.cell.samples_per_ray = prepared_.samples_per_ray;
    if (!prepared_.reason.empty()) {
      tell_why_not();
      return false;
    }
    pilot_ = known ? stored_pilot() : draw_pilot(prepared_, stop_);
    if (stop_()) return false;
    tests_ = tests_of(prepared_, TestLevels{plan_.error_rates.alpha_pass, families_.means}, pilot_);
    if (stored_ && stored_->plan != hash_of(tests()))
      throw InputError(fmt::format("cell \"{}\": found samples drawn for other tests than are planned here; run its shards again",
                                   prepared_.cell->name));
    return true;
  }

  const TestPlan* tests() const { return tests_ ? &*tests_ : nullptr; }

  DrawnPilot stored_pilot() const {
    const CommonDraws& common = *stored_->common;
    DrawnPilot pilot = common.pilot;
    if (common.pilot_kept.empty()) return pilot;
    const SampleSpan span = pilot_span(prepared_);
    const std::size_t outputs = prepared_.targets.outputs;
    pilot.kept = KeptSamples(prepared_.scene->rays->world.size(), span.first, span.per_ray, outputs);
    if (common.pilot_kept.size() != pilot.kept->count() * outputs) fail_stored();
    for (std::size_t i = 0; i < pilot.kept->count(); ++i)
      pilot.kept->set(i, std::span(common.pilot_kept).subspan(i * outputs, outputs));
    return pilot;
  }

  [[noreturn]] void fail_stored() const {
    throw InputError(fmt::format("cell \"{}\": found drawn samples of another shape than the cell's; run its shards again",
                                 prepared_.cell->name));
  }

  SampleSpan first_span() const { return {.per_ray = prepared_.samples_per_ray, .keep = tests_.has_value()}; }

  std::optional<Portions> draw(const SampleSpan& span, const std::function<bool(std::size_t)>& wanted) {
    return draw_portions(prepared_.planned(), *prepared_.scene, *prepared_.kernel, prepared_.targets, span, tests(), wanted,
                         stop_, [&](double fraction) { observer_.progress(record_, fraction); });
  }

  /// All of a span: portions that are stored, and the others drawn.
  std::optional<Sampled> whole(const SampleSpan& span) {
    const std::size_t rays = prepared_.scene->rays->local.size(), outputs = prepared_.targets.outputs;
    Portions all;
    if (stored_)
      if (const auto at = stored_->spans.find(span.first); at != stored_->spans.end()) {
        if (at->second.per_ray != span.per_ray) fail_stored();
        all = std::move(at->second.portions);
        expect_fits(all, span);
      }
    const SpanCut cut(rays, span);
    if (all.size() < cut.portions()) {
      if (!task_.may_draw) {
        leave_open(
            fmt::format("{} of samples {} to {} of each ray {} not drawn",
                        all.empty() ? "all" : fmt::format("{} of {} portions", cut.portions() - all.size(), cut.portions()),
                        span.first, span.first + span.per_ray - 1, all.empty() ? "are wanted and" : "are"));
        return std::nullopt;
      }
      std::optional<Portions> rest = draw(span, [&](std::size_t number) { return !all.contains(number); });
      if (!rest) return std::nullopt;
      all.merge(*rest);
    }
    return fold(all, rays, outputs, span, tests());
  }

  void expect_fits(const Portions& portions, const SampleSpan& span) const {
    const PortionShapes shapes(prepared_.scene->rays->local.size(), prepared_.targets.outputs, span, tests());
    for (const auto& [number, portion] : portions)
      if (!shapes.fit(number, portion)) fail_stored();
  }

  bool leave_open(const std::string& why) {
    record_.reason = why + "; `run CONFIG --resume -o RESULTS` draws what is missing";
    open_ = true;
    return false;
  }

  /// Laws and lookups that are drawn whatever the samples are.
  WalkLaws walk_laws(Real lookups_of_a_sample) {
    return draw_walk_laws(prepared_, *tests_, lookups_of_a_sample, plan_.error_rates.alpha_pass, stop_);
  }

  std::optional<Real> reliance() { return measure_reliance(prepared_.planned(), *prepared_.scene, *prepared_.kernel, stop_); }

  bool judge_whole() {
    const auto sampled = whole(first_span());
    if (!sampled) return false;
    outcome_.effort += *sampled;
    std::vector<KeptSamples> kept;
    if (pilot_.kept) kept.push_back(*pilot_.kept);
    if (sampled->counters.overruns == 0) kept.push_back(sampled->kept);
    const CommonDraws* common = stored_ && stored_->common ? &*stored_->common : nullptr;
    std::optional<VerdictRecord> verdict;
    if (tests_) {
      const WalkLaws laws = common && common->laws ? *common->laws : walk_laws(sampled->lookups_of_a_sample());
      verdict = judge(
          prepared_, *tests_, *sampled, kept, laws, plan_.error_rates, families_, outcome_.effort,
          [&](const SampleSpan& span) { return whole(span); }, stop_);
      if (!verdict) return false;
    }
    std::optional<Real> relied;
    if (outcome_.effort.overruns == 0) relied = common ? common->reliance : reliance();
    // Laws, replays and reliance that are cut off would be missing without a word, as if they did not apply.
    if (stop_()) return false;
    conclude(*sampled, verdict, relied);
    return true;
  }

  void conclude(const Sampled& sampled, const std::optional<VerdictRecord>& verdict, const std::optional<Real>& relied) {
    fill_statistics(record_, prepared_, sampled);
    if (record_.status == Status::ok && !moments_are_finite(record_)) {
      record_.status = Status::error;
      record_.reason =
          "its samples are finite, but their mean or variance is beyond the largest number, 1.8e308: scale the scene";
    }
    if (record_.status == Status::ok && verdict && verdict->nonfinite > 0) {
      record_.status = Status::error;
      record_.nonfinite += verdict->nonfinite;
      record_.reason = fmt::format(
          "{} of the samples that the verdict drew beyond the planned ones are not finite; after a run of samples_per_ray {} "
          "`replay` shows the first",
          verdict->nonfinite, verdict->samples_per_ray);
    }
    if (record_.status == Status::ok && outcome_.effort.overruns > 0) {
      record_.status = Status::error;
      record_.reason = fmt::format("{} walks took more than {} lookups", outcome_.effort.overruns, Workspace().most_lookups);
    }
    if (record_.status == Status::ok) {
      add_verdict(record_, prepared_, verdict);
      record_.reliance = relied;
    } else {
      drop_sampled_statistics(record_);
    }
    write_images(record_, prepared_, sampled, options_, observer_);
  }

  /// The part's share of all samples that an unbiased cell is expected to need.
  bool draw_part() {
    CellDraws draws;
    draws.cell = prepared_.cell->id;
    draws.plan = hash_of(tests());
    const std::uint64_t wanted = tests_ ? expected_samples(prepared_, *tests_) : prepared_.samples_per_ray;
    std::size_t before = 0;  // portions of earlier spans
    for (SampleSpan span = first_span(); span.per_ray > 0;) {
      auto drawn = draw(span, [&](std::size_t number) { return task_.share.has(before + number); });
      if (!drawn) return false;
      draws.spans[span.first] = {span.per_ray, std::move(*drawn)};
      before += SpanCut(prepared_.scene->rays->local.size(), span).portions();
      const std::uint64_t end = span.first + span.per_ray;
      span = tests_ && end < wanted ? next_span(*tests_, end) : SampleSpan();
    }
    if (task_.share.part == 0) draws.common = common_draws();
    if (stop_()) return false;
    record_.part = task_.share.text();
    record_.drawn_parts = {draws_text(std::move(draws))};
    record_.reason = fmt::format("part {} of the cell is drawn; `merge` joins the parts", record_.part);
    return true;
  }

  CommonDraws common_draws() {
    CommonDraws common;
    common.theory = prepared_.theory;
    common.pilot = pilot_;
    for (std::size_t i = 0; pilot_.kept && i < pilot_.kept->count(); ++i) {
      const std::span<const Real> values = pilot_.kept->at(i).values;
      common.pilot_kept.insert(common.pilot_kept.end(), values.begin(), values.end());
    }
    if (tests_ && prepared_.theory.lookups) common.laws = walk_laws(*prepared_.theory.lookups);
    common.reliance = reliance();
    return common;
  }

  const Plan& plan_;
  const CellTask& task_;
  PreparedCell& prepared_;
  const Families& families_;
  const RunOptions& options_;
  const RunObserver& observer_;
  std::function<bool()> stop_;
  CellOutcome outcome_;
  CellRecord& record_;
  std::optional<CellDraws> stored_;
  DrawnPilot pilot_;
  std::optional<TestPlan> tests_;
  bool open_ = false;  ///< samples are missing that may not be drawn
};

}  // namespace

CellOutcome run_cell(const Plan& plan, const CellTask& task, const Families& families, const std::function<bool()>& late,
                     const RunOptions& options, const RunObserver& observer, const std::function<bool()>& given_up) {
  const InFlight named(task.prepared.cell->name);
  CellOutcome outcome;
  const std::string failure = failure_of<InputError, ParameterError, std::bad_alloc>([&] {
    CellRun run(plan, task, families, options, observer, [&] { return given_up() || late(); });
    outcome = run.run([&] { return given_up() ? kInterrupted : kBudgetSpent; });
  });
  if (failure.empty()) return outcome;
  outcome = {std::make_shared<CellRecord>(blank_record(plan, task.prepared)), {}};
  outcome.record->status = Status::error;
  outcome.record->reason = failure;
  return outcome;
}

}  // namespace nullmark
