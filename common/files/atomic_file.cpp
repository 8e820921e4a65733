// SPDX-License-Identifier: Apache-2.0
#include "common/files/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include "common/files/file_error.h"

namespace zerodrift::files {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& path, const std::string& what, int error) {
  throw FileError(path.string() + ": " + what + ": " + std::strerror(error));
}

// Is there, and is written straight.
bool is_special(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || S_ISREG(status.st_mode)) return false;
  if (S_ISCHR(status.st_mode) || S_ISFIFO(status.st_mode)) return true;
  throw FileError(path.string() + ": is a folder, a disk or a socket, expected a file to write");
}

// A terminal or /dev/null takes both.
bool is_standard_output(const fs::path& path) {
  struct stat output {};
  struct stat status {};
  return ::fstat(STDOUT_FILENO, &output) == 0 && ::stat(path.c_str(), &status) == 0 &&
         !S_ISCHR(status.st_mode) && output.st_dev == status.st_dev &&
         output.st_ino == status.st_ino;
}

fs::path with_links_followed(const fs::path& path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return path;
  fs::path real = fs::canonical(path, error);
  return error ? path : real;  // a link to nothing is replaced
}

// Makes the rename itself survive a power cut. A file system that can't do this for a folder
// doesn't need it.
void sync_folder_of(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

}  // namespace

AtomicFile::AtomicFile(fs::path target) : target_(std::move(target)) {
  const bool is_output = is_standard_output(target_);
  if (is_special(target_)) {
    fd_ = ::open(target_.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC);
    if (fd_ < 0) refuse(target_, "cannot open for writing", errno);
  } else {
    replaced_ = with_links_followed(target_);
    partial_.emplace(replaced_, fd_);
  }
  if (is_output) ::dup2(STDERR_FILENO, STDOUT_FILENO);
}

AtomicFile::~AtomicFile() {
  if (fd_ >= 0) ::close(fd_);
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
  if (partial_ && ::fsync(fd_) != 0) refuse(target_, "fsync fails", errno);
  // Some file systems report a failed write only here.
  if (::close(std::exchange(fd_, -1)) != 0) refuse(target_, "closing fails", errno);
  if (!partial_) return;
  if (const int error = partial_->rename_to(replaced_); error != 0)
    refuse(target_, "cannot take this name", error);
  sync_folder_of(replaced_);
}

fs::path AtomicFile::keep() {
  if (!partial_) return {};
  const fs::path kept = free_name_of_cut(replaced_);
  return partial_->rename_to(kept) == 0 ? kept : fs::path{};
}

void require_writable(const fs::path& target) {
  if (!is_special(target)) {
    static_cast<void>(AtomicFile(target));
  } else if (::access(target.c_str(), W_OK) != 0) {
    refuse(target, "cannot open for writing", errno);
  }
}

namespace {

bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  const fs::file_status status = fs::status(a, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) return false;  // /dev/null takes all
  return fs::equivalent(a, b, error) ||
         fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error);
}

}  // namespace

void check_outputs(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs) {
  const auto refuse_same = [](const NamedFile& output, const NamedFile& other) {
    if (output.file.empty() || other.file.empty() || !is_same_file(output.file, other.file)) return;
    throw FileError(output.option + ": found '" + output.file + "', which is also " + other.option +
                    "; expected another file");
  };
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    for (const NamedFile& input : inputs) refuse_same(outputs[i], input);
    for (std::size_t k = 0; k < i; ++k) refuse_same(outputs[i], outputs[k]);
  }
  for (const NamedFile& output : outputs) {
    if (!output.file.empty()) require_writable(output.file);
  }
}

}  // namespace zerodrift::files
