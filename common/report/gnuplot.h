// SPDX-License-Identifier: Apache-2.0
// gnuplot as a child process, without a shell and without anybody's start-up files.
#pragma once

#include <chrono>
#include <string>

namespace zerodrift::report {

inline constexpr std::chrono::milliseconds kGnuplotLimit{20'000};

// What gnuplot, found through PATH, prints when it reads `script`. Killed, with its children, once
// `limit` has passed. Throws ReportError where it isn't installed, fails, prints nothing or takes
// too long.
[[nodiscard]] std::string run_gnuplot(const std::string& script,
                                      std::chrono::milliseconds limit = kGnuplotLimit);

}  // namespace zerodrift::report
