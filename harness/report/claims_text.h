#pragma once

#include <string>

#include "harness/analysis/claim_findings.h"

namespace nullmark {

/// "40 of 48 claims reproduced, 6 refuted, 2 cannot be told"
std::string findings_count(const std::vector<ClaimFinding>& all);

/// The measured and the claimed number of the one cell.  Of several cells, that of the one closest to the limit of the claim, or
/// farthest beyond it.
std::string figures_of(const PartFinding& part);

/// The figures that give a claim its outcome: those of the first part that has it, and how many more have it.
std::string deciding_figures(const ClaimFinding& finding);

/// For the terminal: every claim with its verdict, and the figures of each part.
std::string findings_text(const std::vector<ClaimFinding>& all);

/// The same as a markdown table.
std::string findings_markdown(const std::vector<ClaimFinding>& all);

}  // namespace nullmark
