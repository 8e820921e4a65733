// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/ending.h"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "common/files/unfinished_file.h"
#include "common/service/exit_code.h"
#include "common/service/stop_signals.h"

namespace zerodrift::services {
namespace {

void end_on_signal(int signal_number) {
  files::end_without_unfinished_files(128 + signal_number);
}

}  // namespace

EndsAtOnce::EndsAtOnce() {
  service::end_at_once_by(end_on_signal);
}

EndsAtOnce::~EndsAtOnce() {
  service::end_at_once_by(nullptr);
}

int end_of_output(int exit_code) {
  const bool is_said = std::fflush(stdout) == 0;
  const int error = errno;
  if (is_said && std::ferror(stdout) == 0) return exit_code;
  pollfd output{STDOUT_FILENO, 0, 0};
  if (::poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0) return exit_code;
  std::fprintf(stderr, "zerodrift: standard output: writing fails%s%s\n", is_said ? "" : ": ",
               is_said ? "" : std::strerror(error));
  return exit_code == service::kExitDone ? service::kExitNo : exit_code;
}

}  // namespace zerodrift::services
