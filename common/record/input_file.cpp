// SPDX-License-Identifier: Apache-2.0
#include "common/record/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/record/record_error.h"

namespace zerodrift::record {
namespace {

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

}  // namespace

int open_regular_file(const std::filesystem::path& path) {
  const auto refuse = [&](const std::string& why) {
    throw RecordError(path.string() + ": " + why);
  };
  // O_NONBLOCK: of no effect on a regular file; a pipe without a writer would be waited for.
  const int fd = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (fd < 0) refuse(std::string("cannot open: ") + std::strerror(errno));
  struct stat status {};
  if (::fstat(fd, &status) == 0 && S_ISREG(status.st_mode)) return fd;
  ::close(fd);
  refuse(std::string("is ") + kind_of(status.st_mode) + ", expected a regular file");
  return -1;
}

std::string read_whole_file(const std::filesystem::path& path, std::size_t most_bytes) {
  const int fd = open_regular_file(path);
  std::string bytes;
  char block[65536];
  ssize_t got = 0;
  do {
    got = ::read(fd, block, sizeof block);
    if (got > 0) bytes.append(block, static_cast<std::size_t>(got));
  } while ((got > 0 && bytes.size() <= most_bytes) || (got < 0 && errno == EINTR));
  const int error = errno;
  ::close(fd);
  if (got < 0) throw RecordError(path.string() + ": cannot read: " + std::strerror(error));
  if (bytes.size() > most_bytes) {
    throw RecordError(path.string() + ": holds more than the " + std::to_string(most_bytes) +
                      " bytes that are expected at most");
  }
  return bytes;
}

}  // namespace zerodrift::record
