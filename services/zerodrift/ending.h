// SPDX-License-Identifier: Apache-2.0
// How a command ends that works on files: at once on a stop signal, wherever it waits or computes,
// and with "no" where what it had to say could not be said.
#pragma once

namespace zerodrift::services {

// As long as it lives, SIGINT, SIGTERM and SIGHUP end the process at once with 128 + the signal's
// number; files that are not finished are removed.
class EndsAtOnce {
 public:
  EndsAtOnce();
  ~EndsAtOnce();
  EndsAtOnce(const EndsAtOnce&) = delete;
  EndsAtOnce& operator=(const EndsAtOnce&) = delete;
};

// The exit code once standard output has taken everything. A reader that left is no failure.
[[nodiscard]] int end_of_output(int exit_code);

}  // namespace zerodrift::services
