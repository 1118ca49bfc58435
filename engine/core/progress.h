// A progress line on the terminal. If standard error is not a terminal, nothing is shown.
#pragma once

#include <chrono>
#include <string>

namespace ballot {

/// A line such as "building BVH  [#####.....]  50 %  3 s left". It is redrawn at most ten times a second and erased by
/// the destructor. Only one may exist at a time. update() may be called from any thread, but from one at a time.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void update(double done);  // in [0, 1]
  void hide();               // erases the line until the next update, so that other output can be written

 private:
  std::string what_;
  bool terminal_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace ballot
