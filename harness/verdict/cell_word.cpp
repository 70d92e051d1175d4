#include "harness/verdict/cell_word.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "harness/model/names.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

/// A tracker that leans on the exact depth by no more than this does not lean on it.
constexpr Real kNoReliance = 0.01;

/// Whether a proof about the mean takes a variance.
bool takes_variance(const VerdictRecord& verdict) {
  return std::any_of(verdict.tests.begin(), verdict.tests.end(),
                     [](const TestRecord& test) { return test.channel >= 0 && test.takes_variance(); });
}

std::string violations_of(const CellRecord& record) {
  if (record.majorant_violations == 0) return "the extinction at a point on a ray is above the bound";
  const std::string largest =
      record.largest_violation ? fmt::format(", the largest {:.3g} times it", *record.largest_violation) : "";
  return fmt::format("{} of {} lookups above the bound{}", record.majorant_violations, record.lookups, largest);
}

std::string joined(const std::string& first, const std::string& second, const char* between) {
  return first.empty() || second.empty() ? first + second : first + between + second;
}

/// What a broken law says of the tracker.
std::string law_text(const LawRecord& law) {
  std::string text = fmt::format("law \"{}\" is broken (log E = {:.1f})", law.name, law.log_e);
  if (law.name == "replay")
    text += ": samples differ when they are drawn again; a sample may depend on its ray and its stream alone";
  if (law.name == "independence")
    text +=
        ": flights, samples or rays depend on each other; a tracker that takes several flights a sample, or collides without a "
        "lookup, states flies_once() false";
  return text;
}

/// Lookups and laws that fail.
std::string failures_beside_the_mean(const VerdictRecord& verdict) {
  std::string text;
  if (verdict.lookups == Outcome::fail)
    for (const TestRecord& test : verdict.tests)
      if (test.channel < 0)
        text = joined(text, fmt::format("lookups differ from their expectation (log E = {:.1f})", test.log_e_fail), "; ");
  for (const LawRecord& law : verdict.laws)
    if (law.outcome == Outcome::fail) text = joined(text, law_text(law), "; ");
  return text;
}

/// Why a sampled cell has no verdict; results of older versions say it of no cell.
std::string why_untested(const CellRecord& record) {
  if (!record.reason.empty()) return record.reason;
  if (record.verdict)
    return record.samples == record.rays ? "no mean was tested: one sample a ray leaves none beside the pilot"
                                         : "no mean was tested";
  return record.claims == "biased" ? "the estimator claims nothing" : "no verdict";
}

}  // namespace

Outcome mean_of(const VerdictRecord& verdict) { return verdict.against == "own mean" ? verdict.own_mean : verdict.unbiased; }

Kind kind_of(const CellRecord& record) {
  if (record.status == Status::error) return Kind::error;
  if (record.status != Status::ok) return Kind::not_run;
  if (!record.verdict) return Kind::untested;
  const VerdictRecord& verdict = *record.verdict;
  const Outcome mean = mean_of(verdict);
  const bool pair = record.cell.minus.has_value();
  if (pair && mean == Outcome::fail) return Kind::differ;
  if (mean == Outcome::fail || verdict.lookups == Outcome::fail || verdict.lawful == Outcome::fail) return Kind::fail;
  if (mean == Outcome::violated) return Kind::violated;
  if (mean == Outcome::inconclusive) return verdict.planned_undecidable ? Kind::expected_open : Kind::unexpected_open;
  if (mean != Outcome::pass) return Kind::untested;
  return pair ? Kind::agree : Kind::pass;
}

std::vector<Mark> marks_of(const CellRecord& record) {
  if (record.status != Status::ok || !record.verdict) return {};
  const VerdictRecord& verdict = *record.verdict;
  const Outcome mean = mean_of(verdict);
  if (mean == Outcome::none || mean == Outcome::violated) return {};
  const bool decided = mean == Outcome::pass || mean == Outcome::fail;
  std::vector<Mark> marks;
  if (decided && verdict.variance_basis == "pilot" && takes_variance(verdict)) marks.push_back(Mark::pilot);
  if (verdict.against == "own mean") marks.push_back(Mark::own_mean);
  if (!decided && verdict.lawful == Outcome::pass && tests_walks(verdict)) marks.push_back(Mark::laws);
  if (verdict.bound_unproven) marks.push_back(Mark::bound);
  if (record.reliance && *record.reliance > kNoReliance)
    marks.push_back(Mark::part_of_depth);
  else if (record.given_depth && !record.reliance)
    marks.push_back(Mark::depth);
  if (mean == Outcome::pass && !verdict.untested.empty()) marks.push_back(Mark::law);
  return marks;
}

const char* mark_name(Mark mark) {
  switch (mark) {
    case Mark::pilot:
      return "by pilot";
    case Mark::own_mean:
      return "own mean";
    case Mark::laws:
      return "by laws";
    case Mark::bound:
      return "bound not proven";
    case Mark::depth:
      return "given the exact depth";
    case Mark::part_of_depth:
      return "leans on the exact depth";
    case Mark::law:
      break;
  }
  return "law not tested";
}

std::string mark_text(Mark mark, const CellRecord& record) {
  if (mark == Mark::part_of_depth) return fmt::format("leans on the exact depth ({:.2g} of its answer)", *record.reliance);
  if (mark != Mark::law) return mark_name(mark);
  // "replay: why" is the law and why it is not tested.
  std::vector<std::string> laws;
  for (const std::string& text : record.verdict->untested)
    if (std::string law = text.substr(0, text.find(':')); std::find(laws.begin(), laws.end(), law) == laws.end())
      laws.push_back(std::move(law));
  return fmt::format("{} not tested", fmt::join(laws, " and "));
}

std::vector<std::string> mark_texts(const CellRecord& record) {
  std::vector<std::string> texts;
  for (const Mark mark : marks_of(record)) texts.push_back(mark_text(mark, record));
  return texts;
}

const char* verdict_word(Kind kind) {
  switch (kind) {
    case Kind::pass:
      return "PASS";
    case Kind::fail:
      return "FAIL";
    case Kind::agree:
      return "AGREE";
    case Kind::differ:
      return "DIFFER";
    case Kind::expected_open:
      return "INCONCLUSIVE (as planned)";
    case Kind::unexpected_open:
      return "INCONCLUSIVE";
    case Kind::violated:
      return "VIOLATED";
    case Kind::error:
      return "ERROR";
    case Kind::not_run:
      return "not run";
    case Kind::untested:
      break;
  }
  return "not tested";
}

std::string with_marks(const std::string& word, const std::vector<std::string>& marks) {
  if (marks.empty()) return word;
  // One pair of parentheses: "INCONCLUSIVE (as planned, by laws)".
  if (word.back() == ')') return fmt::format("{}, {})", word.substr(0, word.size() - 1), fmt::join(marks, ", "));
  return fmt::format("{} ({})", word, fmt::join(marks, ", "));
}

std::string marked_word(const CellRecord& record) {
  const Kind kind = kind_of(record);
  if (kind != Kind::untested) return with_marks(verdict_word(kind), mark_texts(record));
  return fmt::format("{} (claims {})", verdict_word(kind),
                     record.claims.empty() || record.claims == "biased" ? "nothing" : record.claims);
}

std::string reason_of(const CellRecord& record) {
  if (record.status != Status::ok) return record.reason.empty() ? to_string(record.status) : record.reason;
  if (!record.verdict) return why_untested(record);
  const VerdictRecord& verdict = *record.verdict;
  std::string mean = verdict.reason;
  if (verdict.violated) mean = joined(mean, violations_of(record), ": ");
  const std::string beside = failures_beside_the_mean(verdict);
  const std::string text = mean_of(verdict) == Outcome::fail ? joined(mean, beside, "; ") : joined(beside, mean, "; ");
  return text.empty() && kind_of(record) == Kind::untested ? why_untested(record) : text;
}

std::string finding_of(const CellRecord& record) {
  const Kind kind = kind_of(record);
  return kind == Kind::pass || kind == Kind::agree ? record.verdict->proves : reason_of(record);
}

}  // namespace nullmark
