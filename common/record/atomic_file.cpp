// SPDX-License-Identifier: Apache-2.0
#include "common/record/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <tuple>
#include <utility>

#include "common/record/record_error.h"

namespace zerodrift::record {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& what, int error) {
  throw RecordError(path.string() + ": " + what + ": " + std::strerror(error));
}

// ".<name>.<pid>.<n>.partial" beside the target, so that the rename stays within one file system.
std::pair<std::filesystem::path, int> create_partial(const std::filesystem::path& target) {
  const std::string stem =
      std::string{"."} + target.filename().string() + '.' + std::to_string(::getpid());
  for (int attempt = 0;; ++attempt) {
    std::filesystem::path partial = target;
    partial.replace_filename(stem + '.' + std::to_string(attempt) + ".partial");
    const int fd = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0) return {partial, fd};
    if (errno != EEXIST) refuse(target, "cannot create a file in its folder", errno);
  }
}

// Makes the rename itself survive a power cut. A file system that can't do this for a folder
// doesn't need it.
void sync_folder_of(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path target) : target_(std::move(target)) {
  std::tie(partial_, fd_) = create_partial(target_);
}

AtomicFile::~AtomicFile() {
  if (fd_ >= 0) ::close(fd_);
  if (!committed_) ::unlink(partial_.c_str());
}

void AtomicFile::append(std::string_view bytes) noexcept {
  while (!bytes.empty() && first_error_ == 0) {
    const ssize_t count = ::write(fd_, bytes.data(), bytes.size());
    if (count >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
    } else if (errno != EINTR) {
      first_error_ = errno;
    }
  }
}

void AtomicFile::check() const {
  if (first_error_ != 0) refuse(target_, "writing fails", first_error_);
}

void AtomicFile::commit() {
  check();
  if (::fsync(fd_) != 0) refuse(target_, "fsync fails", errno);
  // Some file systems report a failed write only here.
  if (::close(std::exchange(fd_, -1)) != 0) refuse(target_, "closing fails", errno);
  if (::rename(partial_.c_str(), target_.c_str()) != 0)
    refuse(target_, "cannot take this name", errno);
  committed_ = true;
  sync_folder_of(target_);
}

}  // namespace zerodrift::record
