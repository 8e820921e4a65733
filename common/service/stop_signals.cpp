// SPDX-License-Identifier: Apache-2.0
#include "common/service/stop_signals.h"

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace zerodrift::service {
namespace {

struct Stop {
  std::mutex mutex;
  std::condition_variable changed;
  bool is_asked_for = false;
  bool was_taken = false;  // once: what follows is the program's to end
};

std::atomic<void (*)(int)> end_now{nullptr};

// Never destroyed: the thread that watches the signals outlives main().
Stop& stop() {
  static auto* const only = new Stop;
  return *only;
}

bool is_ignored(int signal) {
  struct sigaction now {};
  return sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

sigset_t stop_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  if (!is_ignored(SIGHUP)) sigaddset(&set, SIGHUP);
  return set;
}

void open_standard_descriptors() {
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor) {
    // The lowest free number is what open() gives.
    if (fcntl(descriptor, F_GETFD) < 0) static_cast<void>(open("/dev/null", O_RDWR));
  }
}

void end_by(int signal_number) {
  signal(signal_number, SIG_DFL);
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, signal_number);
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
  raise(signal_number);
}

[[noreturn]] void watch(sigset_t set, std::chrono::milliseconds taken_within) {
  pthread_setname_np(pthread_self(), "signals");
  for (;;) {
    int signal_number = 0;
    if (sigwait(&set, &signal_number) != 0) continue;
    if (auto* const end = end_now.load()) end(signal_number);
    request_stop();
    Stop& state = stop();
    std::unique_lock lock(state.mutex);
    if (!state.changed.wait_for(lock, taken_within, [&] { return state.was_taken; }))
      end_by(signal_number);
  }
}

}  // namespace

void take_signals(std::chrono::milliseconds taken_within) {
  open_standard_descriptors();
  signal(SIGPIPE, SIG_IGN);
  const sigset_t set = stop_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::thread([set, taken_within] { watch(set, taken_within); }).detach();
}

bool wait_for_stop(std::chrono::milliseconds at_most) {
  Stop& state = stop();
  std::unique_lock lock(state.mutex);
  if (!state.changed.wait_for(lock, at_most, [&] { return state.is_asked_for; })) return false;
  state.is_asked_for = false;
  state.was_taken = true;
  state.changed.notify_all();
  return true;
}

void end_at_once_by(void (*end)(int signal_number)) {
  end_now = end;
}

void request_stop() {
  Stop& state = stop();
  const std::lock_guard lock(state.mutex);
  state.is_asked_for = true;
  state.changed.notify_all();
}

}  // namespace zerodrift::service
