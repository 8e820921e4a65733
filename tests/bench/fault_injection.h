// SPDX-License-Identifier: Apache-2.0
// What may happen to a process, done to one that a bench started.
#pragma once

#include <sys/types.h>

#include <string>

namespace zerodrift::bench {

// Stops one thread of a child process and nothing else of it, as if it hung; goes on when deleted.
class HangingThread {
 public:
  // `name` as in /proc/PID/task/*/comm. Throws std::runtime_error where there is no such thread, or
  // the machine doesn't allow tracing.
  HangingThread(pid_t process, const std::string& name);
  ~HangingThread();
  HangingThread(const HangingThread&) = delete;
  HangingThread& operator=(const HangingThread&) = delete;

 private:
  pid_t thread_ = 0;
};

}  // namespace zerodrift::bench
