// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

namespace zerodrift::services {

// A line that grows, on a terminal; nothing when standard error is piped.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what);
  ~ProgressBar();
  // 0 to 1. Redraws at most ten times a second.
  void show(double share);

 private:
  std::string what_;
  bool on_terminal_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point drawn_at_;
};

}  // namespace zerodrift::services
