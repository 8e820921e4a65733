// SPDX-License-Identifier: Apache-2.0
#include "common/dds/shared_memory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <string_view>
#include <system_error>
#include <vector>

#include "common/dds/dds_error.h"
#include "common/files/boot_id.h"

namespace zerodrift::dds {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kOurs = "fastrtps_";
constexpr std::string_view kPort = "fastrtps_port";
constexpr std::uint64_t kMebibyte = 1024U * 1024U;

std::vector<fs::path> files_of_middleware(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().filename().string().starts_with(kOurs)) files.push_back(entry->path());
  }
  return files;
}

// "fastrtps_port<N>..." with N of the domain (RTPS 2.3, 9.6.1.1).
bool is_port_of(std::uint32_t domain, std::string_view name) {
  constexpr std::uint32_t kFirstPort = 7400;
  constexpr std::uint32_t kPortsOfDomain = 250;
  if (!name.starts_with(kPort)) return false;
  name.remove_prefix(kPort.size());
  std::uint32_t port = 0;
  if (std::from_chars(name.data(), name.data() + name.size(), port).ec != std::errc{}) return false;
  const std::uint32_t first = kFirstPort + kPortsOfDomain * domain;
  return port >= first && port < first + kPortsOfDomain;
}

bool is_locked(const fs::path& file) {
  const int handle = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (handle < 0) return true;  // another user's, or just removed: not ours to judge
  const bool locked = ::flock(handle, LOCK_EX | LOCK_NB) != 0;
  ::close(handle);
  return locked;
}

}  // namespace

SharedMemoryPlace SharedMemoryPlace::here(const fs::path& folder) {
  struct stat found {};
  if (::stat(folder.c_str(), &found) != 0) {
    throw DdsError(
        fmt::format("shared memory: {} is not there ({}); mount a tmpfs, or use "
                    "--transport udp",
                    folder.string(), std::strerror(errno)));
  }
  SharedMemoryPlace place;
  place.computer = files::boot_id();
  place.filesystem = std::to_string(found.st_dev);
  place.user = std::to_string(::geteuid());
  return place;
}

std::string SharedMemoryPlace::text() const {
  return computer + '/' + filesystem + '/' + user;
}

SharedMemoryPlace SharedMemoryPlace::parse(const std::string& text) {
  const auto first = text.find('/');
  const auto last = text.rfind('/');
  if (first == std::string::npos || first == last) return {};
  return {.computer = text.substr(0, first),
          .filesystem = text.substr(first + 1, last - first - 1),
          .user = text.substr(last + 1)};
}

std::string why_not_shared(const SharedMemoryPlace& own, const SharedMemoryPlace& other,
                           const std::string& peer) {
  if (own.computer != other.computer) return "";
  if (own.filesystem != other.filesystem) {
    return "shared memory is not shared with " + peer +
           ": its /dev/shm is another; give both one IPC namespace (ipc: host, or one volume at "
           "/dev/shm), or use --transport udp";
  }
  if (own.user != other.user) {
    return fmt::format(
        "shared memory is not shared with {}: it runs as user {}, this one as {}; run both as one "
        "user, or use --transport udp",
        peer, other.user, own.user);
  }
  return "";
}

std::size_t remove_stale_segments(const fs::path& folder) noexcept {
  std::size_t removed = 0;
  const auto remove = [&](const fs::path& file) {
    std::error_code error;
    if (fs::remove(file, error)) ++removed;
  };
  try {
    for (const auto& lock : files_of_middleware(folder)) {
      const std::string name = lock.filename().string();
      // _el: who owns it lives; _sl: of a port that several read.
      if (!name.ends_with("_el") && !name.ends_with("_sl")) continue;
      const std::string of = name.substr(0, name.size() - 3);
      if (is_locked(lock)) continue;
      const fs::path other = folder / (of + (name.ends_with("_el") ? "_sl" : "_el"));
      if (fs::exists(other) && is_locked(other)) continue;
      remove(folder / of);
      if (of.starts_with(kPort)) remove(folder / ("sem." + of + "_mutex"));
      remove(lock);
    }
  } catch (const std::exception&) {
    return removed;  // what can't be listed isn't cleaned
  }
  return removed;
}

void check_shared_memory(std::uint32_t domain, const fs::path& folder) {
  SharedMemoryPlace::here(folder);
  for (const auto& file : files_of_middleware(folder)) {
    struct stat found {};
    if (!is_port_of(domain, file.filename().string())) continue;
    if (::stat(file.c_str(), &found) != 0 || found.st_uid == ::geteuid()) continue;
    throw DdsError(
        fmt::format("shared memory: {} belongs to user {}, this process runs as {}: no "
                    "sample would pass; run all as one user, or use --transport udp",
                    file.string(), found.st_uid, ::geteuid()));
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    throw DdsError(
        fmt::format("shared memory: {} can't be written ({}); mount it writable, or use "
                    "--transport udp",
                    folder.string(), std::strerror(errno)));
  }
  struct statvfs space {};
  if (::statvfs(folder.c_str(), &space) != 0) return;  // it is there: nothing to say
  const std::uint64_t free_bytes = std::uint64_t{space.f_bavail} * space.f_frsize;
  if (free_bytes < kNeededBytes) {
    throw DdsError(fmt::format(
        "shared memory: {} has {} of {} MiB free, at least {} are needed (less ends a process "
        "without a word); make it larger (shm_size, sizeLimit), or use --transport udp",
        folder.string(), free_bytes / kMebibyte,
        std::uint64_t{space.f_blocks} * space.f_frsize / kMebibyte, kNeededBytes / kMebibyte));
  }
}

}  // namespace zerodrift::dds
