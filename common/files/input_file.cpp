// SPDX-License-Identifier: Apache-2.0
#include "common/files/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/files/file_error.h"

namespace zerodrift::files {
namespace {

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

}  // namespace

int open_regular_file(const std::filesystem::path& path) {
  const auto refuse = [&](const std::string& why) { throw FileError(path.string() + ": " + why); };
  // O_NONBLOCK: of no effect on a regular file; a pipe without a writer would be waited for.
  const int fd = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (fd < 0) refuse(std::string("cannot open: ") + std::strerror(errno));
  struct stat status {};
  if (::fstat(fd, &status) == 0 && S_ISREG(status.st_mode)) return fd;
  ::close(fd);
  refuse(std::string("is ") + kind_of(status.st_mode) + ", expected a regular file");
  return -1;
}

std::optional<std::string> read_up_to(int fd, std::size_t most_bytes) {
  std::string bytes;
  std::array<char, 65536> block{};
  while (bytes.size() <= most_bytes) {
    const ssize_t got = ::read(fd, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    bytes.append(block.data(), static_cast<std::size_t>(got));
  }
  return bytes;
}

std::string read_whole_file(const std::filesystem::path& path, std::size_t most_bytes) {
  const int fd = open_regular_file(path);
  std::optional<std::string> bytes = read_up_to(fd, most_bytes);
  const int error = errno;
  ::close(fd);
  if (!bytes) throw FileError(path.string() + ": cannot read: " + std::strerror(error));
  if (bytes->size() > most_bytes) {
    throw FileError(path.string() + ": holds more than the " + std::to_string(most_bytes) +
                    " bytes that are expected at most");
  }
  return *std::move(bytes);
}

std::string beginning_of(const std::filesystem::path& path, std::size_t most_bytes) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return "";
  const int fd = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (fd < 0) return "";
  std::string bytes = read_up_to(fd, most_bytes).value_or("");
  ::close(fd);
  if (bytes.size() > most_bytes) bytes.resize(most_bytes);
  return bytes;
}

}  // namespace zerodrift::files
