// SPDX-License-Identifier: Apache-2.0
// What has to hold of /dev/shm before Fast DDS uses it. It says nothing itself: without room the
// process is killed by SIGBUS, and between processes with different folders or users no sample
// passes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace zerodrift::dds {

// Of each participant, mapped in whole when it starts. 0.5 MiB holds more than 500 of the largest
// samples.
inline constexpr std::uint32_t kSegmentBytes = 512U * 1024U;
// Free at start: the segment, and the queues of as many peers as discovery looks for.
inline constexpr std::uint64_t kNeededBytes = 4U * 1024U * 1024U;

// Where a process's shared memory is, as it is announced: peers share it where all is equal.
struct SharedMemoryPlace {
  std::string computer;    // boot id of the kernel: the same in all containers
  std::string filesystem;  // device number of the folder's file system
  std::string user;        // effective user id

  // Of this process. Throws DdsError where the folder isn't there.
  static SharedMemoryPlace here(const std::filesystem::path& folder = "/dev/shm");
  // "boot/device/user", and back; empty parts where it is none.
  [[nodiscard]] std::string text() const;
  static SharedMemoryPlace parse(const std::string& text);
};

// Why two processes that both use shared memory exchange nothing, with the remedy; empty: they do,
// or are on two computers, where UDP is used. `peer` is the name of the other.
std::string why_not_shared(const SharedMemoryPlace& own, const SharedMemoryPlace& other,
                           const std::string& peer);

// Removes segments, ports and locks of processes that are gone (each living one holds a lock); how
// many files. Never throws: another's files stay.
std::size_t remove_stale_segments(const std::filesystem::path& folder = "/dev/shm") noexcept;

// Throws DdsError, one line with the remedy: no folder, another user's ports of this domain, too
// little room. Call after remove_stale_segments().
void check_shared_memory(std::uint32_t domain, const std::filesystem::path& folder = "/dev/shm");

}  // namespace zerodrift::dds
