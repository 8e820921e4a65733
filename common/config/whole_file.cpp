// SPDX-License-Identifier: Apache-2.0
#include "common/config/whole_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "common/config/config_error.h"

namespace zerodrift::config {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* action, int error) {
  throw ConfigError(path.string() + ": " + action + ": " + std::strerror(error));
}

bool write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

std::string read_whole(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) fail(path, "cannot open", errno);
  std::string text;
  std::array<char, 65536> block{};
  ssize_t got = 0;
  while ((got = ::read(file, block.data(), block.size())) > 0) {
    text.append(block.data(), static_cast<std::size_t>(got));
  }
  const int error = errno;
  ::close(file);
  if (got < 0) fail(path, "cannot read", error);
  return text;
}

void write_whole(const std::filesystem::path& path, std::string_view text) {
  const std::string beside = path.string() + ".partial." + std::to_string(::getpid());
  const int file = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) fail(path, "cannot create", errno);
  const bool written = write_all(file, text) && ::fsync(file) == 0;
  const int write_error = errno;
  const bool closed = ::close(file) == 0;
  if (written && closed && std::rename(beside.c_str(), path.c_str()) == 0) return;
  const int error = written ? errno : write_error;
  ::unlink(beside.c_str());
  fail(path, "cannot write", error);
}

}  // namespace zerodrift::config
