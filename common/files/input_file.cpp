// SPDX-License-Identifier: Apache-2.0
#include "common/files/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
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

// Never waits, as opening a pipe would: O_NONBLOCK is of no effect on a regular file.
Descriptor opened(const std::filesystem::path& path) {
  return Descriptor(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
}

struct stat status_of(const Descriptor& file) {
  struct stat status {};
  if (::fstat(file.number(), &status) != 0) status.st_mode = 0;
  return status;
}

using Block = std::array<char, 65536>;

// As ::read, which a signal may have interrupted.
ssize_t read_block(int fd, Block& block) {
  ssize_t got = -1;
  do got = ::read(fd, block.data(), block.size());
  while (got < 0 && errno == EINTR);
  return got;
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& why) {
  throw FileError(path.string() + ": " + why);
}

}  // namespace

Descriptor open_regular_file(const std::filesystem::path& path) {
  Descriptor file = opened(path);
  if (!file.is_open()) refuse(path, std::string("cannot open: ") + std::strerror(errno));
  const mode_t mode = status_of(file).st_mode;
  if (!S_ISREG(mode))
    refuse(path, std::string("is ") + kind_of(mode) + ", expected a regular file");
  return file;
}

std::optional<std::string> read_up_to(int fd, std::size_t most_bytes) {
  std::string bytes;
  Block block{};
  while (bytes.size() <= most_bytes) {
    const ssize_t got = read_block(fd, block);
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    bytes.append(block.data(), static_cast<std::size_t>(got));
  }
  return bytes;
}

std::string read_whole_file(const std::filesystem::path& path, std::size_t most_bytes) {
  const Descriptor file = open_regular_file(path);
  const auto refuse_size = [&] {
    refuse(path, "holds more than the " + std::to_string(most_bytes) +
                     " bytes that are expected at most");
  };
  if (static_cast<std::uintmax_t>(status_of(file).st_size) > most_bytes) refuse_size();
  std::optional<std::string> bytes = read_up_to(file.number(), most_bytes);
  if (!bytes) refuse(path, std::string("cannot read: ") + std::strerror(errno));
  if (bytes->size() > most_bytes) refuse_size();  // it has grown
  return *std::move(bytes);
}

std::string beginning_of(const std::filesystem::path& path, std::size_t most_bytes) {
  const Descriptor file = opened(path);
  if (!file.is_open() || !S_ISREG(status_of(file).st_mode)) return "";
  std::string bytes = read_up_to(file.number(), most_bytes).value_or("");
  if (bytes.size() > most_bytes) bytes.resize(most_bytes);
  return bytes;
}

void read_in_blocks(const std::filesystem::path& path,
                    const std::function<void(std::string_view)>& take) {
  const Descriptor file = open_regular_file(path);
  Block block{};
  while (true) {
    const ssize_t got = read_block(file.number(), block);
    if (got < 0) refuse(path, std::string("cannot read: ") + std::strerror(errno));
    if (got == 0) return;
    take({block.data(), static_cast<std::size_t>(got)});
  }
}

}  // namespace zerodrift::files
