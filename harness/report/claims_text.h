#pragma once

#include <string>

#include "harness/analysis/claim_findings.h"

namespace nullmark {

/// "40 of 48 claims reproduced, 6 refuted, 2 cannot be told"
std::string findings_count(const std::vector<ClaimFinding>& all);

/// What was measured beside what is claimed: the one cell, or of several the one nearest to the claim's edge or farthest beyond.
std::string figures_of(const PartFinding& part);

/// For the terminal: every claim with its word, and the figures of each part.
std::string findings_text(const std::vector<ClaimFinding>& all);

/// The same as a table of markdown.
std::string findings_markdown(const std::vector<ClaimFinding>& all);

}  // namespace nullmark
