// SPDX-License-Identifier: Apache-2.0
// Loaded before a service: a wall clock that a test sets. The file named by ZERODRIFT_CLOCK_SHIFT
// holds by how many nanoseconds it is ahead of the true one.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

using Shift = std::atomic<std::int64_t>;

const Shift* shift() {
  static const Shift* const mapped = []() -> const Shift* {
    const char* file = std::getenv("ZERODRIFT_CLOCK_SHIFT");
    const int descriptor = file == nullptr ? -1 : ::open(file, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return nullptr;
    void* memory = ::mmap(nullptr, sizeof(Shift), PROT_READ, MAP_SHARED, descriptor, 0);
    ::close(descriptor);
    return memory == MAP_FAILED ? nullptr : static_cast<const Shift*>(memory);
  }();
  return mapped;
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  using Function = int (*)(clockid_t, timespec*);
  static const auto next = reinterpret_cast<Function>(::dlsym(RTLD_NEXT, "clock_gettime"));
  const int result = next(clock, time);
  if (result != 0 || clock != CLOCK_REALTIME || shift() == nullptr) return result;
  constexpr std::int64_t kNsPerS = 1'000'000'000;
  const std::int64_t ns = time->tv_sec * kNsPerS + time->tv_nsec + shift()->load();
  time->tv_sec = ns / kNsPerS;
  time->tv_nsec = ns % kNsPerS;
  return result;
}
