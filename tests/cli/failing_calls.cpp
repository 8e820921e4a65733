// SPDX-License-Identifier: Apache-2.0
// See failing_calls.h. Replaces functions of the C library for the one process that it is loaded
// into; takes no memory itself.
#include "tests/cli/failing_calls.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdarg.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace {

using namespace zerodrift::cli_test;

std::uint64_t number_of(const char* variable) {
  const char* text = std::getenv(variable);
  return text == nullptr ? 0 : std::strtoull(text, nullptr, 10);
}

std::string_view text_of(const char* variable) {
  const char* text = std::getenv(variable);
  return text == nullptr ? std::string_view() : text;
}

template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

// The calls of one kind: which of them fails.
struct Calls {
  std::atomic<std::uint64_t> count{0};
  std::uint64_t failing = 0;  // 0: none
  bool for_good = false;

  bool is_next_to_fail() {
    const std::uint64_t number = ++count;
    return failing != 0 && (number == failing || (for_good && number > failing));
  }
};

Calls file_calls;
Calls allocations;
Calls threads;
std::string_view folder;
int error_number = ENOSPC;
std::atomic<bool> is_armed{false};  // allocations: from main() on
std::array<std::atomic<bool>, 1024> is_ours{};

[[gnu::constructor]] void configure() {
  folder = text_of(kFailFolder);
  file_calls.failing = number_of(kFailCall);
  allocations.failing = number_of(kFailAllocation);
  threads.failing = number_of(kFailThread);
  file_calls.for_good = allocations.for_good = !text_of(kFailForGood).empty();
  if (const std::uint64_t number = number_of(kFailErrno); number != 0)
    error_number = static_cast<int>(number);
}

// What happened, for the test: all counts.
[[gnu::destructor]] void tell() {
  is_armed = false;
  const char* file = std::getenv(kCounts);
  if (file == nullptr) return;
  char text[96];
  const int length = std::snprintf(text, sizeof text, "%llu %llu %llu",
                                   static_cast<unsigned long long>(file_calls.count),
                                   static_cast<unsigned long long>(allocations.count),
                                   static_cast<unsigned long long>(threads.count));
  const long descriptor = syscall(SYS_openat, AT_FDCWD, file, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  syscall(SYS_write, descriptor, text, length);
  syscall(SYS_close, descriptor);
}

bool fails() {
  if (!file_calls.is_next_to_fail()) return false;
  errno = error_number;
  return true;
}

bool is_watched(int descriptor) {
  return descriptor >= 0 && static_cast<std::size_t>(descriptor) < is_ours.size() &&
         is_ours[static_cast<std::size_t>(descriptor)];
}

bool is_below(const char* path) {
  return !folder.empty() && std::string_view(path).starts_with(folder);
}

int watched_open(int directory, const char* path, int flags, mode_t mode) {
  const bool is_output = (flags & O_ACCMODE) != O_RDONLY && is_below(path);
  if (is_output && fails()) return -1;
  const auto descriptor = static_cast<int>(syscall(SYS_openat, directory, path, flags, mode));
  if (descriptor >= 0 && static_cast<std::size_t>(descriptor) < is_ours.size())
    is_ours[static_cast<std::size_t>(descriptor)] = is_output;
  return descriptor;
}

bool no_memory() {
  if (!is_armed.load(std::memory_order_relaxed) || !allocations.is_next_to_fail()) return false;
  errno = ENOMEM;
  return true;
}

using Main = int (*)(int, char**, char**);
Main real_main = nullptr;

int armed_main(int argc, char** argv, char** environment) {
  is_armed = true;
  return real_main(argc, argv, environment);
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  return watched_open(AT_FDCWD, path, flags, mode);
}

int openat(int directory, const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  return watched_open(directory, path, flags, mode);
}

// A disk that fills up takes a part first.
ssize_t write(int descriptor, const void* bytes, std::size_t size) {
  if (is_watched(descriptor)) {
    const bool is_first = file_calls.count + 1 == file_calls.failing;
    if (fails()) {
      if (!is_first || !file_calls.for_good || size < 2) return -1;
      size /= 2;
    }
  }
  return syscall(SYS_write, descriptor, bytes, size);
}

int fsync(int descriptor) {
  if (is_watched(descriptor) && fails()) return -1;
  return static_cast<int>(syscall(SYS_fsync, descriptor));
}

int fdatasync(int descriptor) {
  if (is_watched(descriptor) && fails()) return -1;
  return static_cast<int>(syscall(SYS_fdatasync, descriptor));
}

// As a file system over a network, which tells here what it could not write.
int close(int descriptor) {
  const bool was_ours = is_watched(descriptor);
  if (was_ours) is_ours[static_cast<std::size_t>(descriptor)] = false;
  const auto result = static_cast<int>(syscall(SYS_close, descriptor));
  return was_ours && fails() ? -1 : result;
}

int rename(const char* from, const char* to) {
  if (is_below(to) && fails()) return -1;
  return static_cast<int>(syscall(SYS_rename, from, to));
}

void* malloc(std::size_t size) {
  return no_memory() ? nullptr : __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
  return no_memory() ? nullptr : __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) {
  return no_memory() ? nullptr : __libc_realloc(memory, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return no_memory() ? nullptr : __libc_memalign(alignment, size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  if (no_memory()) return ENOMEM;
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*routine)(void*),
                   void* argument) {
  using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static const auto create = next<Create>("pthread_create");
  if (threads.is_next_to_fail()) return EAGAIN;
  return create(thread, attributes, routine, argument);
}

int __libc_start_main(Main main_function, int argc, char** argv, void (*initialise)(),
                      void (*finish)(), void (*finish_loader)(), void* stack_end) {
  using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
  real_main = main_function;
  return next<Start>("__libc_start_main")(armed_main, argc, argv, initialise, finish, finish_loader,
                                          stack_end);
}

}  // extern "C"
