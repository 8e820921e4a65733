// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/log_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "common/files/unfinished_file.h"
#include "common/mcap/mcap_error.h"

namespace zerodrift::mcap {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& path, const std::string& what, int error) {
  throw McapError(path.string() + ": " + what + ": " + std::strerror(error));
}

// Of a recording that was not finished; never overwritten.
fs::path move_aside(const fs::path& active, const fs::path& target) {
  fs::path free = files::free_name_of_cut(target);
  std::error_code error;
  fs::rename(active, free, error);
  if (error) refuse(active, "cannot be moved to " + free.string(), error.value());
  return free;
}

}  // namespace

LogFile::LogFile(fs::path target) : target_(std::move(target)), active_(target_) {
  active_ += ".active";
  std::error_code error;
  if (fs::exists(target_, error) && !fs::is_regular_file(target_, error))
    throw McapError(target_.string() + ": is there and no regular file");
  for (;;) {
    fd_ = ::open(active_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd_ >= 0) return;
    if (errno != EEXIST) refuse(target_, "cannot create a file in its folder", errno);
    moved_aside_ = move_aside(active_, target_);
  }
}

LogFile::~LogFile() {
  if (fd_ >= 0) ::close(fd_);
}

void LogFile::append(std::string_view bytes) {
  std::uint64_t end = size_;
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int error = errno;
      // Half a record would hide what may be written after it.
      if (::ftruncate(fd_, static_cast<off_t>(size_)) == 0)
        ::lseek(fd_, static_cast<off_t>(size_), SEEK_SET);
      refuse(active_, "writing fails", error);
    }
    bytes.remove_prefix(static_cast<std::size_t>(count));
    end += static_cast<std::uint64_t>(count);
  }
  size_ = end;
}

void LogFile::sync() {
  if (::fdatasync(fd_) != 0) refuse(active_, "fdatasync fails", errno);
}

void LogFile::commit() {
  if (::fsync(fd_) != 0) refuse(active_, "fsync fails", errno);
  if (::close(std::exchange(fd_, -1)) != 0) refuse(active_, "closing fails", errno);
  if (::rename(active_.c_str(), target_.c_str()) != 0)
    refuse(target_, "cannot take this name", errno);
  const fs::path folder = target_.has_parent_path() ? target_.parent_path() : ".";
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);  // the rename itself; a file system that can't do this doesn't need it
  ::close(fd);
}

}  // namespace zerodrift::mcap
