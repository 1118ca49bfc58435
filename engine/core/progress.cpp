#include "engine/core/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "engine/core/shown.h"

namespace ballot {
namespace {

constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr int kCells = 20;

std::string time_left(double seconds) {
  if (seconds < 90) return fmt::format("{:.0f} s left", seconds);
  if (seconds < 5400) return fmt::format("{:.0f} min left", seconds / 60);
  return fmt::format("{:.1f} h left", seconds / 3600);
}

bool draws_lines() {
  const char* term = std::getenv("TERM");
  return ::isatty(STDERR_FILENO) != 0 && term && std::string_view(term) != "dumb";
}

}  // namespace

ProgressBar::ProgressBar(std::string what)
    : what_(shown_in_line(what)), terminal_(draws_lines()), start_(std::chrono::steady_clock::now()), last_(start_) {}

ProgressBar::~ProgressBar() { hide(); }

void ProgressBar::hide() {
  if (drawn_) std::fputs("\r\x1b[K", stderr);
  drawn_ = false;
}

void ProgressBar::update(double done) {
  if (!terminal_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < kRedraw) return;  // work that takes less than a tenth of a second shows nothing
  last_ = now;
  drawn_ = true;
  done = done > 0 ? std::min(done, 1.0) : 0.0;  // a NaN becomes 0
  const int cells = static_cast<int>(done * kCells);
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const std::string left = done > 0.01 ? time_left(elapsed * (1 - done) / done) : std::string();
  fmt::print(stderr, "\r{}  [{:#<{}}{:.<{}}]  {:.0f} %  {}\x1b[K", what_, "", cells, "", kCells - cells, 100 * done,
             left);
  std::fflush(stderr);
}

}  // namespace ballot
