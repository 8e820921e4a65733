// SPDX-License-Identifier: Apache-2.0
#include "common/report/gnuplot.h"

#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string_view>

extern "C" {  // glibc 2.36 forgot it in this header
#include <sys/pidfd.h>
}

#include "common/files/descriptor.h"
#include "common/report/plain_text.h"
#include "common/report/report_error.h"

namespace zerodrift::report {
namespace {

[[noreturn]] void refuse(const std::string& what, int error) {
  throw ReportError("cannot run gnuplot: " + what + ": " + std::strerror(error));
}

files::Descriptor checked(int descriptor, const char* what) {
  if (descriptor < 0) refuse(what, errno);
  return files::Descriptor(descriptor);
}

// A file in memory for each of the child's streams: with pipes, parent and child could wait for
// each other, or the parent for a grandchild that holds the other end.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name)
      : file_(checked(::memfd_create(name, MFD_CLOEXEC), "memfd_create")) {}

  void fill(std::string_view text) {
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t count = ::pwrite(file_.number(), text.data() + done, text.size() - done,
                                     static_cast<off_t>(done));
      if (count < 0 && errno != EINTR) refuse("no room for its script", errno);
      if (count > 0) done += static_cast<std::size_t>(count);
    }
  }

  [[nodiscard]] std::string content() const {
    std::string text;
    std::array<char, 65536> part{};
    for (;;) {
      const ssize_t count =
          ::pread(file_.number(), part.data(), part.size(), static_cast<off_t>(text.size()));
      if (count <= 0) return text;
      text.append(part.data(), static_cast<std::size_t>(count));
    }
  }

  [[nodiscard]] int get() const noexcept { return file_.number(); }

 private:
  files::Descriptor file_;
};

struct Streams {
  MemoryFile in{"gnuplot-in"};
  MemoryFile out{"gnuplot-out"};
  MemoryFile errors{"gnuplot-errors"};
};

// Signals as a fresh process has them, and a process group of its own so that killing it reaches
// whatever it started.
pid_t spawn(const Streams& streams) {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  if (::posix_spawn_file_actions_init(&actions) != 0 || ::posix_spawnattr_init(&attributes) != 0)
    refuse("posix_spawn", ENOMEM);
  ::posix_spawn_file_actions_adddup2(&actions, streams.in.get(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, streams.out.get(), STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, streams.errors.get(), STDERR_FILENO);
  sigset_t none;
  sigset_t all;
  ::sigemptyset(&none);
  ::sigfillset(&all);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setsigdefault(&attributes, &all);
  ::posix_spawnattr_setpgroup(&attributes, 0);
  ::posix_spawnattr_setflags(
      &attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);

  std::string program = "gnuplot";
  std::string no_startup_files = "--default-settings";
  const std::array<char*, 3> arguments{program.data(), no_startup_files.data(), nullptr};
  const char* search = std::getenv("PATH");
  std::string path = std::string{"PATH="} + (search != nullptr ? search : "");
  std::string locale = "LC_ALL=C.UTF-8";
  const std::array<char*, 3> environment{path.data(), locale.data(), nullptr};
  pid_t child = -1;
  const int error = ::posix_spawnp(&child, program.c_str(), &actions, &attributes, arguments.data(),
                                   environment.data());
  ::posix_spawn_file_actions_destroy(&actions);
  ::posix_spawnattr_destroy(&attributes);
  if (error == ENOENT)
    throw ReportError(
        "pictures need gnuplot, which is not on the PATH; install the package gnuplot-nox");
  if (error != 0) refuse("starting it", error);
  return child;
}

// Kills and reaps the child's group on every way out.
class Child {
 public:
  explicit Child(pid_t pid) noexcept : pid_(pid) {}
  ~Child() {
    if (pid_ > 0) static_cast<void>(end());
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // True if it ended by itself within `limit`.
  [[nodiscard]] bool wait_for(std::chrono::milliseconds limit) const {
    const files::Descriptor alive = checked(::pidfd_open(pid_, 0), "pidfd_open");
    const auto deadline = std::chrono::steady_clock::now() + limit;
    for (;;) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          deadline - std::chrono::steady_clock::now());
      if (left.count() < 0) return false;
      pollfd watched{alive.number(), POLLIN, 0};
      const int ready = ::poll(&watched, 1, static_cast<int>(left.count()) + 1);
      if (ready > 0) return true;
      if (ready < 0 && errno != EINTR) refuse("poll", errno);
    }
  }

  // The wait status.
  [[nodiscard]] int end() {
    ::kill(-pid_, SIGKILL);  // the child itself, or what it left running
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

 private:
  pid_t pid_;
};

std::string first_line(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos) return "it says nothing";
  return one_line(std::string_view{text}.substr(begin, text.find('\n', begin) - begin));
}

}  // namespace

std::string run_gnuplot(const std::string& script, std::chrono::milliseconds limit) {
  Streams streams;
  streams.in.fill(script);
  Child child{spawn(streams)};
  if (!child.wait_for(limit)) {
    throw ReportError("gnuplot did not finish a picture within " + std::to_string(limit.count()) +
                      " ms and was killed");
  }
  const int status = child.end();
  std::string output = streams.out.content();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || output.empty())
    throw ReportError("gnuplot failed: " + first_line(streams.errors.content()));
  return output;
}

}  // namespace zerodrift::report
