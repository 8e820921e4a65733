// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace zerodrift::services {
namespace {
constexpr int kWidth = 40;
constexpr std::chrono::milliseconds kRedraw{100};
}  // namespace

ProgressBar::ProgressBar(std::string what)
    : what_(std::move(what)), on_terminal_(isatty(STDERR_FILENO) != 0) {}

ProgressBar::~ProgressBar() {
  erase();
}

void ProgressBar::erase() {
  if (drawn_) std::fprintf(stderr, "\r\033[K");
  drawn_ = false;
}

void ProgressBar::say(const std::string& line) {
  erase();
  std::fprintf(stderr, "%s\n", line.c_str());
}

void ProgressBar::show(double share) {
  const auto now = std::chrono::steady_clock::now();
  if (!on_terminal_ || (drawn_ && now - drawn_at_ < kRedraw)) return;
  drawn_ = true;
  drawn_at_ = now;
  const double clamped = std::clamp(share, 0.0, 1.0);
  const auto filled = static_cast<std::size_t>(clamped * kWidth);
  const std::string bar = std::string(filled, '#') + std::string(kWidth - filled, '.');
  std::fprintf(stderr, "\r%s [%s] %3.0f %%", what_.c_str(), bar.c_str(), 100.0 * clamped);
  std::fflush(stderr);
}

}  // namespace zerodrift::services
