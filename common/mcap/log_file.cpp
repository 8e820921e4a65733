// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/log_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "common/files/unfinished_file.h"

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

// Its lock goes with whoever writes a file, however that ends. A file system without locks has
// none that is held.
bool is_locked_by_another(int fd) {
  return ::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

// What is open and what has the name are one file.
bool has_name(int fd, const fs::path& name) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(fd, &opened) == 0 && ::lstat(name.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

bool is_new_file(int fd) {
  struct stat opened {};
  return ::fstat(fd, &opened) == 0 && S_ISREG(opened.st_mode) && opened.st_size == 0 &&
         (::fcntl(fd, F_GETFL) & O_ACCMODE) == O_WRONLY;
}

// Without waiting for the other end of a pipe, and through no link. What may not be written may
// still be asked for its lock.
int open_active(const fs::path& active) {
  constexpr int kHow = O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;
  const int fd = ::open(active.c_str(), O_WRONLY | O_CREAT | kHow, 0666);
  if (fd >= 0) return fd;
  const int error = errno;
  const int readable = ::open(active.c_str(), O_RDONLY | kHow);
  errno = error;
  return readable;
}

}  // namespace

LogFile::LogFile(fs::path target) : target_(std::move(target)), active_(target_) {
  active_ += ".active";
  std::error_code error;
  if (fs::exists(target_, error) && !fs::is_regular_file(target_, error))
    throw McapError(target_.string() + ": is there and no regular file");
  // A file that is there for a moment only, or is renamed meanwhile, is looked at again.
  while (fd_ < 0) take_name();
}

// A new file is one that was empty and is locked: so nobody sees it as left before it is.
void LogFile::take_name() {
  std::error_code error;
  const int fd = open_active(active_);
  const int why = errno;
  if (fd < 0 && !fs::exists(fs::symlink_status(active_, error)))
    refuse(target_, "cannot create a file in its folder", why);
  if (fd >= 0 && is_locked_by_another(fd)) {
    ::close(fd);
    throw FileInUse(active_.string() +
                    ": another process is writing it, expected a name that nobody writes");
  }
  if (fd >= 0 && has_name(fd, active_) && is_new_file(fd)) {
    fd_ = fd;
    return;
  }
  try {
    if (fd < 0 || has_name(fd, active_)) moved_aside_ = move_aside(active_, target_);
  } catch (...) {
    if (fd >= 0) ::close(fd);
    throw;
  }
  if (fd >= 0) ::close(fd);
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
  if (!has_name(fd_, active_))
    throw McapError(active_.string() + ": was moved or replaced while it was being written");
  // While it is locked: until it has its name it is nobody else's.
  if (::rename(active_.c_str(), target_.c_str()) != 0)
    refuse(target_, "cannot take this name", errno);
  if (::close(std::exchange(fd_, -1)) != 0) refuse(target_, "closing fails", errno);
  const fs::path folder = target_.has_parent_path() ? target_.parent_path() : ".";
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);  // the rename itself; a file system that can't do this doesn't need it
  ::close(fd);
}

}  // namespace zerodrift::mcap
