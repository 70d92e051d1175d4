
#include <fmt/format.h>

#include <string_view>

#include "harness/analysis/claim_findings.h"
#include "harness/io/text.h"
#include "harness/report/claims_text.h"
#include "harness/verdict/cell_word.h"
#include "harness/verdict/convergence_order.h"

namespace nullmark {

namespace {

/// How a cell ended: element name ("" for a pass) and what it says.
struct Ending {
  const char* element = "";
  std::string message;
};

Ending ending(const CellRecord& record) {
  const std::string finding = finding_of(record);
  const auto says = [&] { return finding.empty() ? marked_word(record) : fmt::format("{}: {}", marked_word(record), finding); };
  switch (kind_of(record)) {
    case Kind::pass:
    case Kind::agree:
      return {"", says()};
    case Kind::fail:
    case Kind::differ:
      return {"failure", says()};
    case Kind::error:
      return {"error", finding};
    case Kind::not_run:
      return {"skipped", finding};
    case Kind::expected_open:
    case Kind::unexpected_open:
    case Kind::violated:
    case Kind::untested:
      break;
  }
  return {"skipped", says()};
}

/// Seconds of one thread that the cell's samples take, where a sample was timed.
std::string sampling_time(const CellRecord& record) {
  if (!record.time) return "";
  return fmt::format(" time=\"{:.3f}\"", record.time->ns_per_sample * static_cast<Real>(record.samples) * 1e-9);
}

}  // namespace

std::string reproduction(const CellRecord& record, const std::string& file) {
  std::string pattern;
  for (const char c : record.cell.name) {
    if (std::string_view("\\^$.|?*+()[]{}").find(c) != std::string_view::npos) pattern += '\\';
    pattern += c;
  }
  return fmt::format("jq .config {} | nullmark run - -o - --filter {}", shell_quoted(file), shell_quoted("^" + pattern + "$"));
}

std::string junit(const RunRecord& run, const std::string& file) {
  std::string cases;
  std::size_t failures = 0, errors = 0, skipped = 0;
  for (const CellRecord& record : run.cells) {
    const Ending end = ending(record);
    const std::string_view element = end.element;
    cases += fmt::format("    <testcase classname=\"{}\" name=\"{}\"{}", xml(record.cell.experiment), xml(record.cell.name),
                         sampling_time(record));
    if (element.empty()) {
      cases += fmt::format(">\n      <system-out>{}</system-out>\n    </testcase>\n", xml(end.message));
      continue;
    }
    ++(element == "failure" ? failures : element == "error" ? errors : skipped);
    cases += fmt::format(">\n      <{0} message=\"{1}\">{2}</{0}>\n    </testcase>\n", element, xml(end.message),
                         xml(reproduction(record, file)));
  }
  std::size_t others = 0;
  for (const OrderFit& fit : fit_orders(run.cells)) {
    ++others;
    const bool failed = fit.outcome == Outcome::fail;
    const char* element = failed ? "failure" : "skipped";
    cases += fmt::format("    <testcase classname=\"convergence order\" name=\"{}\"", xml(fit.name));
    if (fit.outcome == Outcome::pass) {
      cases += "/>\n";
      continue;
    }
    ++(failed ? failures : skipped);
    const std::string message =
        failed ? fmt::format("claimed {:.0f}, measured {:.3f} +- {:.3f}", fit.claimed, fit.order, fit.half_width) : fit.reason;
    cases += fmt::format(">\n      <{0} message=\"{1}\"/>\n    </testcase>\n", element, xml(message));
  }
  for (const ClaimFinding& one : findings(run)) {
    if (!one.claim->required) continue;
    ++others;
    const bool failed = one.outcome == ClaimOutcome::refuted;
    cases += fmt::format("    <testcase classname=\"required claim\" name=\"{}\"",
                         xml(fmt::format("{}: {}", one.claim->id, one.claim->claim)));
    if (one.outcome == ClaimOutcome::reproduced) {
      cases += "/>\n";
      continue;
    }
    ++(failed ? failures : skipped);
    cases += fmt::format(">\n      <{0} message=\"{1}\"/>\n    </testcase>\n", failed ? "failure" : "skipped",
                         xml(fmt::format("{}: {}", to_string(one.outcome), deciding_figures(one))));
  }
  const std::string counts = fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\"", run.cells.size() + others,
                                         failures, errors, skipped);
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {0}>\n  <testsuite name=\"{1}\" {0}>\n{2}  "
      "</testsuite>\n</testsuites>\n",
      counts, xml(run.name), cases);
}

}  // namespace nullmark
