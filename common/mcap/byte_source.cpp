// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/mcap/mcap_error.h"

namespace zerodrift::mcap {

FileSource::FileSource(const std::filesystem::path& path) : path_(path) {
  // O_NONBLOCK: a pipe without a writer would be waited for.
  fd_ = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (fd_ < 0) throw McapError(path.string() + ": cannot be opened: " + std::strerror(errno));
  struct stat status {};
  if (::fstat(fd_, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(fd_);
    throw McapError(path.string() + ": is no regular file, expected one");
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

FileSource::~FileSource() {
  ::close(fd_);
}

void FileSource::read(std::uint64_t offset, std::size_t size, std::string& to) const {
  const std::uint64_t left = offset < size_ ? size_ - offset : 0;
  to.resize(static_cast<std::size_t>(std::min<std::uint64_t>(size, left)));
  std::size_t filled = 0;
  while (filled < to.size()) {
    const ssize_t count =
        ::pread(fd_, to.data() + filled, to.size() - filled, static_cast<off_t>(offset + filled));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw McapError(path_.string() + ": reading fails: " + std::strerror(errno));
    if (count == 0) break;  // shorter than it was
    filled += static_cast<std::size_t>(count);
  }
  to.resize(filled);
}

}  // namespace zerodrift::mcap
