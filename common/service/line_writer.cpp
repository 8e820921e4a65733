// SPDX-License-Identifier: Apache-2.0
#include "common/service/line_writer.h"

#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "common/core/one_line.h"
#include "common/service/realtime.h"

namespace zerodrift::service {

struct LineWriter::Shared {
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<std::string> lines;
  bool is_writing = false;
  bool is_closed = false;
  std::uint64_t dropped = 0;
};

namespace {

// A line that nobody can take any more (EPIPE, EIO) is given up.
void write_whole(int descriptor, std::string_view line) {
  while (!line.empty()) {
    const ssize_t written = ::write(descriptor, line.data(), line.size());
    if (written >= 0) {
      line.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {  // somebody else made it so
      pollfd writable{.fd = descriptor, .events = POLLOUT, .revents = 0};
      ::poll(&writable, 1, -1);
    } else if (errno != EINTR) {
      return;
    }
  }
}

template <typename Shared>
void write_until_closed(int descriptor, const std::shared_ptr<Shared>& shared) {
  pthread_setname_np(pthread_self(), "lines");
  leave_realtime();
  std::unique_lock lock(shared->mutex);
  for (;;) {
    shared->changed.wait(lock, [&] { return shared->is_closed || !shared->lines.empty(); });
    if (shared->is_closed) return;
    const std::string line = std::exchange(shared->lines.front(), {});
    shared->lines.pop_front();
    shared->is_writing = true;
    lock.unlock();
    write_whole(descriptor, line);
    lock.lock();
    shared->is_writing = false;
    shared->changed.notify_all();
  }
}

}  // namespace

LineWriter::LineWriter(int descriptor)
    : descriptor_(descriptor), shared_(std::make_shared<Shared>()) {
  std::thread([descriptor, shared = shared_] { write_until_closed(descriptor, shared); }).detach();
}

LineWriter::~LineWriter() {
  const std::lock_guard lock(shared_->mutex);
  shared_->is_closed = true;
  shared_->changed.notify_all();
}

void LineWriter::write(std::string_view text) {
  std::string line = core::one_line(text, kLongest) + '\n';
  const std::lock_guard lock(shared_->mutex);
  auto& lines = shared_->lines;
  const bool has_room =
      shared_->dropped == 0 ? lines.size() < kMostWaiting : lines.size() < kMostWaiting / 2;
  if (!has_room) {
    ++shared_->dropped;
    return;
  }
  if (const std::uint64_t dropped = std::exchange(shared_->dropped, 0); dropped > 0)
    lines.push_back(std::to_string(dropped) + " lines were dropped here: nobody read them\n");
  lines.push_back(std::move(line));
  shared_->changed.notify_all();
}

bool LineWriter::wait_until_written(std::chrono::milliseconds at_most) {
  std::unique_lock lock(shared_->mutex);
  const auto is_written = [&] { return shared_->lines.empty() && !shared_->is_writing; };
  while (!shared_->changed.wait_for(lock, at_most, is_written)) {
    pollfd writable{.fd = descriptor_, .events = POLLOUT, .revents = 0};
    if (::poll(&writable, 1, 0) == 0) return false;
  }
  return true;
}

LineWriter& standard_error() {
  static auto* const only = new LineWriter(STDERR_FILENO);
  return *only;
}

}  // namespace zerodrift::service
