// A progress line on the terminal, and silence when standard error is not one.
#pragma once

#include <chrono>
#include <string>

namespace ballot {

/// "building BVH  [#####.....]  50 %  3 s left", redrawn at most ten times a second, erased on destruction.
/// One at a time; update() may be called from any one thread at a time.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void update(double done);  // in [0, 1]
  void hide();               // erases the line until the next update, for other output

 private:
  std::string what_;
  bool terminal_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace ballot
