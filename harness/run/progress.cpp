#include "harness/run/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "harness/io/notice.h"
#include "harness/io/results_json.h"
#include "harness/model/names.h"

namespace nullmark {

namespace {

constexpr auto kRedraw = std::chrono::milliseconds(100), kSilence = std::chrono::milliseconds(30'000);
constexpr int kBar = 24;
constexpr std::size_t kNameColumns = 44;

std::string duration(double seconds) {
  const auto whole = std::llround(seconds);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

}  // namespace

Progress::Progress(std::size_t total, Lines lines)
    : total_(total), terminal_(::isatty(STDERR_FILENO) == 1), lines_(lines == Lines::each_cell) {
  const char* no_colour = std::getenv("NO_COLOR");
  colour_ = terminal_ && !(no_colour && *no_colour);
}

Progress::~Progress() { clear(); }

void Progress::cell_progress(const CellRecord& record, double fraction) {
  if (terminal_) return draw(static_cast<double>(done_) + fraction, record.cell.name);
  const Clock::time_point now = Clock::now();
  if (!lines_ || now - last_told_ < kSilence) return;
  last_told_ = now;
  notice("[{}/{}] {}: {:.0f} % sampled\n", done_, total_, record.cell.name, 100 * fraction);
}

void Progress::cell_done(const CellRecord& record, std::size_t done, std::size_t total) {
  done_ = done;
  total_ = total;
  if (terminal_) {
    draw(static_cast<double>(done), record.cell.name);
    return;
  }
  if (!lines_) return;
  last_told_ = Clock::now();
  if (!record.part.empty())
    notice("[{}/{}] {}: part {} drawn\n", done, total, record.cell.name, record.part);
  else
    notice("[{}/{}] {}: {}{}\n", done, total, record.cell.name, to_string(record.status),
           record.reason.empty() ? "" : " (" + record.reason + ")");
}

void Progress::timing(double fraction, std::size_t cells) {
  // Repetitions of all cells are interleaved: so many cells' worth of them is done.
  const auto timed = static_cast<std::size_t>(fraction * static_cast<double>(cells));
  const std::string text = fmt::format("timing {}/{}", timed, cells);
  if (terminal_) {
    draw(static_cast<double>(total_), text);
  } else if (timed > timed_) {
    notice("{}\n", text);
  }
  timed_ = timed;
}

void Progress::warning(const std::string& message) {
  clear();
  notice("nullmark: warning: {}\n", message);
}

void Progress::draw(double done, const std::string& doing) {
  const Clock::time_point now = Clock::now();
  if (drawn_ && now - last_drawn_ < kRedraw) return;
  last_drawn_ = now;
  drawn_ = true;
  const double fraction = total_ == 0 ? 1 : std::clamp(done / static_cast<double>(total_), 0., 1.);
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const auto filled = static_cast<std::size_t>(fraction * kBar);
  const std::string bar = std::string(filled, '#') + std::string(kBar - filled, '.');
  const std::string left = fraction > 0 && fraction < 1 ? duration(seconds * (1 - fraction) / fraction) + " left  " : "";
  write_notice(fmt::format("\r\x1b[K{}{}{} {}/{} cells  {}{}", colour_ ? "\x1b[32m" : "", bar, colour_ ? "\x1b[0m" : "", done_,
                           total_, left, plain_text(doing.substr(0, kNameColumns))));
}

void Progress::clear() {
  if (!drawn_) return;
  write_notice("\r\x1b[K");
  drawn_ = false;
}

}  // namespace nullmark
