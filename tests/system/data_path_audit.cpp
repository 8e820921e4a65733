// SPDX-License-Identifier: Apache-2.0
// See data_path_audit.h. Replaces functions of the C library and of Fast DDS for the one process
// that it is loaded into; takes no memory itself.
#include "tests/system/data_path_audit.h"

#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <pthread.h>
#include <stdarg.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/topic/TopicDescription.hpp>
#include <string_view>

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* memory);
}

namespace {

using zerodrift::system_test::DataPathAudit;
using zerodrift::system_test::LockSet;

// Not looked up by a call that might itself take memory.
[[gnu::tls_model("initial-exec")]] thread_local bool in_our_code = false;
[[gnu::tls_model("initial-exec")]] thread_local bool is_learner = false;

DataPathAudit* audit = nullptr;

template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

[[gnu::constructor]] void map_audit() {
  void* frames[1];
  backtrace(frames, 1);  // loads what it needs now
  const char* file = std::getenv(zerodrift::system_test::kAuditFile);
  if (file == nullptr) return;
  const int descriptor = open(file, O_RDWR | O_CLOEXEC);
  if (descriptor < 0) return;
  void* mapped =
      mmap(nullptr, sizeof(DataPathAudit), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  close(descriptor);
  if (mapped != MAP_FAILED) audit = static_cast<DataPathAudit*>(mapped);
}

bool counts() {
  return audit != nullptr && audit->armed.load(std::memory_order_relaxed) != 0;
}

void note_finding() {
  void* frames[16];
  const int depth = backtrace(frames, 16);
  std::size_t used = 0;
  for (int k = 2; k < depth && used + 128 < audit->first_finding.size(); ++k) {
    Dl_info info{};
    if (dladdr(frames[k], &info) == 0 || info.dli_fname == nullptr) continue;
    const char* slash = std::strrchr(info.dli_fname, '/');
    const auto offset = static_cast<const char*>(frames[k]) - static_cast<char*>(info.dli_fbase);
    used += static_cast<std::size_t>(
        std::snprintf(&audit->first_finding[used], 128, "%.40s+0x%tx\n",
                      slash == nullptr ? info.dli_fname : slash + 1, offset));
  }
}

void note_memory(std::atomic<std::uint64_t> DataPathAudit::*counter) {
  if (!in_our_code || !counts()) return;
  in_our_code = false;
  ++(audit->*counter);
  if (audit->first_finding[0] == 0) note_finding();
  in_our_code = true;
}

void note_lock(const void* lock) {
  if (audit == nullptr || !(in_our_code || is_learner) || !counts()) return;
  LockSet& set = is_learner ? audit->of_learner : audit->of_data_path;
  ++set.taken;
  const auto address = reinterpret_cast<std::uintptr_t>(lock);
  for (auto& place : set.locks) {
    std::uintptr_t known = 0;
    if (place.compare_exchange_strong(known, address) || known == address) return;
  }
  ++set.left_out;
}

void hold_learner() {
  while (is_learner && audit != nullptr && audit->hold_learner != 0) {
    const timespec millisecond{0, 1000000};
    nanosleep(&millisecond, nullptr);
  }
}

// What the middleware does with a call isn't ours.
class InMiddleware {
 public:
  InMiddleware() : was_ours_(in_our_code) { in_our_code = false; }
  ~InMiddleware() { in_our_code = was_ours_; }
  InMiddleware(const InMiddleware&) = delete;
  InMiddleware& operator=(const InMiddleware&) = delete;

 private:
  bool was_ours_;
};

bool is_of_data_path(std::string_view topic) {
  return topic == "angular_rate" || topic == "temperature" || topic == "rate_reference";
}

template <typename... Arguments>
int lock_with(const char* name, Arguments... arguments) {
  return next<int (*)(Arguments...)>(name)(arguments...);
}

}  // namespace

// ---------------------------------------- Fast DDS

namespace eprosima::fastdds::dds {

ReturnCode_t DataReader::take_next_sample(void* data, SampleInfo* info) {
  using Take = ReturnCode_t (*)(DataReader*, void*, SampleInfo*);
  static const Take real =
      next<Take>("_ZN8eprosima7fastdds3dds10DataReader16take_next_sampleEPvPNS1_10SampleInfoE");
  in_our_code = false;
  const ReturnCode_t result = real(this, data, info);
  if (result != ReturnCode_t::RETCODE_OK || !is_of_data_path(get_topicdescription()->get_name()))
    return result;
  if (counts()) ++audit->samples;
  in_our_code = true;
  return result;
}

bool DataWriter::write(void* data) {
  using Write = bool (*)(DataWriter*, void*);
  static const Write real = next<Write>("_ZN8eprosima7fastdds3dds10DataWriter5writeEPv");
  if (in_our_code && counts()) ++audit->writes;
  const InMiddleware here;
  return real(this, data);
}

}  // namespace eprosima::fastdds::dds

// ---------------------------------------- the C library

extern "C" {

void* malloc(std::size_t size) noexcept {
  note_memory(&DataPathAudit::taken);
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  note_memory(&DataPathAudit::taken);
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  note_memory(&DataPathAudit::taken);
  return __libc_realloc(memory, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  note_memory(&DataPathAudit::taken);
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  note_memory(&DataPathAudit::taken);
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept {
  note_memory(&DataPathAudit::taken);
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
void free(void* memory) noexcept {
  if (memory != nullptr) note_memory(&DataPathAudit::given_back);
  __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  note_lock(mutex);
  static const auto real = next<int (*)(pthread_mutex_t*)>("pthread_mutex_lock");
  return real(mutex);
}
int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  note_lock(mutex);
  static const auto real = next<int (*)(pthread_mutex_t*)>("pthread_mutex_trylock");
  return real(mutex);
}
int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* until) noexcept {
  note_lock(mutex);
  return lock_with("pthread_mutex_timedlock", mutex, until);
}
int pthread_mutex_clocklock(pthread_mutex_t* mutex, clockid_t clock,
                            const timespec* until) noexcept {
  note_lock(mutex);
  return lock_with("pthread_mutex_clocklock", mutex, clock, until);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept {
  note_lock(lock);
  return lock_with("pthread_rwlock_rdlock", lock);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept {
  note_lock(lock);
  return lock_with("pthread_rwlock_wrlock", lock);
}

int pthread_setname_np(pthread_t thread, const char* name) noexcept {
  if (pthread_equal(thread, pthread_self()) != 0 && std::string_view(name) == "learner") {
    is_learner = true;
    if (audit != nullptr) ++audit->learners;
    hold_learner();
  }
  return next<int (*)(pthread_t, const char*)>("pthread_setname_np")(thread, name);
}

// std::atomic::wait comes here.
long syscall(long number, ...) noexcept {
  va_list list;
  va_start(list, number);
  long argument[6];
  for (long& one : argument) one = va_arg(list, long);
  va_end(list);
  const bool is_wait = number == SYS_futex && ((argument[1] & FUTEX_CMD_MASK) == FUTEX_WAIT ||
                                               (argument[1] & FUTEX_CMD_MASK) == FUTEX_WAIT_BITSET);
  if (is_wait && in_our_code && counts()) ++audit->waits;
  static const auto real = next<long (*)(long, ...)>("syscall");
  const long result =
      real(number, argument[0], argument[1], argument[2], argument[3], argument[4], argument[5]);
  if (is_wait) hold_learner();
  return result;
}

}  // extern "C"
