// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace zerodrift::services {

// A line that grows, on a terminal; nothing when standard error is piped.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what);
  ~ProgressBar();
  // 0 to 1. Redraws at most ten times a second.
  void show(double share);
  // A line of its own, terminal or not.
  void say(const std::string& line);

 private:
  void erase();

  std::string what_;
  bool on_terminal_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point drawn_at_;
};

// One after the other, each named by what is done (common/evaluation/progress.h).
class ProgressBars {
 public:
  void operator()(const std::string& what, double share) {
    if (what != what_) bar_.reset();
    what_ = what;
    if (!bar_) bar_.emplace(what);
    bar_->show(share);
  }

 private:
  std::string what_;
  std::optional<ProgressBar> bar_;
};

}  // namespace zerodrift::services
