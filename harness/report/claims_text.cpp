#include "harness/report/claims_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/io/text.h"

namespace nullmark {
namespace {

std::string number(const Interval& x) {
  return x.exact() ? fmt::format("{:.4g}", x.value) : fmt::format("{:.4g} +- {:.2g}", x.value, (x.high - x.low) / 2);
}

/// How far the measured number lies towards, or beyond, what the claim forbids: greater is worse.
Real strain(const ClaimPart& part, const ComparedCell& compared) {
  if (!compared.measured || !compared.expected) return 0;
  const Real a = compared.measured->value, b = compared.expected->value;
  if (part.relation == Relation::at_most) return b == 0 ? a : a / std::abs(b) - std::copysign(Real{1}, b);
  if (part.relation == Relation::at_least) return b == 0 ? -a : std::copysign(Real{1}, b) - a / std::abs(b);
  return b == 0 ? std::abs(a) : std::abs(a / b - 1);
}

std::string relation_words(const ClaimPart& part) {
  switch (part.relation) {
    case Relation::near:
      return fmt::format("claimed within {:g} % of", 100 * part.tolerance);
    case Relation::at_most:
      return "claimed at most";
    case Relation::at_least:
      return "claimed at least";
    case Relation::unbiased:
      break;
  }
  return "";
}

std::string comparison_words(const ClaimPart& part, const ComparedCell& compared) {
  if (!compared.measured || !compared.expected) return compared.reason;
  const std::string what =
      part.slope_against.empty() ? part.metric : fmt::format("slope of {} over {}", part.metric, part.slope_against);
  std::string text =
      fmt::format("{} {}, {} {}", what, number(*compared.measured), relation_words(part), number(*compared.expected));
  if (!compared.with.empty()) text += fmt::format(" of {}", compared.with);
  if (compared.expected->value == 0 || !part.slope_against.empty()) return text;
  const Real ratio = compared.measured->value / compared.expected->value;
  return text + (part.relation == Relation::near ? fmt::format(" ({:+.2g} %)", 100 * (ratio - 1))
                                                 : fmt::format(" ({:.3g} times it)", ratio));
}

const ComparedCell& most_telling(const PartFinding& part) {
  const auto less = [&](const ComparedCell& a, const ComparedCell& b) {
    const bool decides_a = a.outcome == part.outcome, decides_b = b.outcome == part.outcome;
    if (decides_a != decides_b) return decides_b;
    return strain(*part.part, a) < strain(*part.part, b);
  };
  return *std::max_element(part.compared.begin(), part.compared.end(), less);
}

std::size_t count(const PartFinding& part, ClaimOutcome outcome) {
  return static_cast<std::size_t>(
      std::count_if(part.compared.begin(), part.compared.end(), [&](const ComparedCell& one) { return one.outcome == outcome; }));
}

std::string marked_outcome(const ClaimFinding& finding) {
  return fmt::format("{}{}", to_string(finding.outcome), finding.claim->required ? " (required)" : "");
}

}  // namespace

std::string findings_count(const std::vector<ClaimFinding>& all) {
  const auto of = [&](ClaimOutcome outcome) {
    return std::count_if(all.begin(), all.end(), [&](const ClaimFinding& one) { return one.outcome == outcome; });
  };
  return fmt::format(
      "{} claim{}: {} reproduced, {} refuted, {} cannot be told (at most {:g} of all runs show even one false word)", all.size(),
      all.size() == 1 ? "" : "s", of(ClaimOutcome::reproduced), of(ClaimOutcome::refuted), of(ClaimOutcome::cannot_tell),
      kFindingsLevel);
}

std::string figures_of(const PartFinding& part) {
  if (part.compared.empty()) return "";
  const ComparedCell& telling = most_telling(part);
  if (part.compared.size() == 1) {
    const bool verdict = part.part->relation == Relation::unbiased;
    return verdict ? (telling.reason.empty() ? "PASS" : telling.reason) : comparison_words(*part.part, telling);
  }
  const std::size_t held = count(part, ClaimOutcome::reproduced), broken = count(part, ClaimOutcome::refuted);
  std::string text = fmt::format("{} of {} cells bear it out", held, part.compared.size());
  if (broken > 0) text += fmt::format(", {} do not", broken);
  const std::string words = comparison_words(*part.part, telling);
  if (!words.empty())
    text +=
        fmt::format("; {}: {}: {}", part.outcome == ClaimOutcome::reproduced ? "the closest" : "the worst", telling.cell, words);
  return text;
}

std::string deciding_figures(const ClaimFinding& finding) {
  std::string text;
  std::size_t others = 0;
  for (const PartFinding& part : finding.parts) {
    if (part.outcome != finding.outcome) continue;
    if (text.empty())
      text = fmt::format("{}{}", part.part->says.empty() ? "" : part.part->says + ": ", figures_of(part));
    else
      ++others;
  }
  return others == 0 ? text : fmt::format("{} (and {} more)", text, others);
}

std::string findings_text(const std::vector<ClaimFinding>& all) {
  std::string text;
  for (const ClaimFinding& one : all) {
    text += fmt::format("{}: {}: {}\n", one.claim->id, marked_outcome(one), one.claim->claim);
    for (const PartFinding& part : one.parts)
      text += fmt::format("    {}{}{}\n", one.parts.size() > 1 ? fmt::format("{}: ", to_string(part.outcome)) : "",
                          part.part->says.empty() ? "" : fmt::format("{}: ", part.part->says), figures_of(part));
  }
  return fmt::format("{}{}\n", text, findings_count(all));
}

std::string findings_markdown(const std::vector<ClaimFinding>& all) {
  std::vector<std::vector<std::string>> lines = {{"claim", "verdict", "what is claimed, and where", "what was measured"}};
  for (const ClaimFinding& one : all) {
    const std::string note = one.claim->note.empty() ? "" : fmt::format("<br>*{}*", one.claim->note);
    for (std::size_t i = 0; i < one.parts.size(); ++i) {
      const PartFinding& part = one.parts[i];
      const std::string says = part.part->says.empty() ? "" : fmt::format("{}: ", part.part->says);
      const std::string word = one.parts.size() > 1 ? fmt::format("{}: ", to_string(part.outcome)) : "";
      lines.push_back({i == 0 ? one.claim->id : "", i == 0 ? fmt::format("**{}**", marked_outcome(one)) : "",
                       i == 0 ? fmt::format("{} ({}){}", one.claim->claim, one.claim->source, note) : "",
                       word + says + figures_of(part)});
    }
  }
  return fmt::format("{}\n\n{}", findings_count(all), markdown_table(lines));
}

}  // namespace nullmark
