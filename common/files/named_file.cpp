// SPDX-License-Identifier: Apache-2.0
#include "common/files/named_file.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/core/one_line.h"
#include "common/files/descriptor.h"
#include "common/files/input_file.h"

namespace zerodrift::files {
namespace {

constexpr std::size_t kLongestName = 64;
constexpr std::size_t kLongestFile = kLongestName + 32;  // with what a service puts around a name

bool is_of_a_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
         c == '_' || c == '.';
}

bool is_plain(std::string_view name, std::size_t longest) {
  return !name.empty() && name.size() <= longest && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), is_of_a_name);
}

[[noreturn]] void refuse_name(std::string_view name, const std::string& why) {
  throw NameRefused(quoted_name(name) + ": " + why);
}

std::string reason(int error) {
  if (error == ENOENT) return "no such file in the service's folder";
  if (error == ELOOP) return "is a link, which is not followed";
  return std::string("cannot be opened: ") + std::strerror(error);
}

}  // namespace

std::optional<std::string> problem_of_name(std::string_view name) {
  if (is_plain(name, kLongestName)) return std::nullopt;
  return "found name " + quoted_name(name) +
         ", expected 1 to 64 of letters, digits, '-', '_' and '.', the first no '.'";
}

std::string quoted_name(std::string_view name) {
  return '\'' + core::one_line(name, kLongestFile) + '\'';
}

std::string read_named(const std::filesystem::path& folder, std::string_view name,
                       std::size_t most_bytes) {
  if (!is_plain(name, kLongestFile)) refuse_name(name, "is no name of a file in a folder");
  const Descriptor in(::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (!in.is_open()) refuse_name(name, "the service's folder is not there any more");
  // Not blocked by a pipe that nobody writes to.
  const Descriptor file(::openat(in.number(), std::string(name).c_str(),
                                 O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!file.is_open()) refuse_name(name, reason(errno));
  struct stat status {};
  if (::fstat(file.number(), &status) != 0 || !S_ISREG(status.st_mode))
    refuse_name(name, "is no regular file");
  if (status.st_nlink > 1) refuse_name(name, "is a hard link: the file has another name elsewhere");
  std::optional<std::string> bytes = read_up_to(file.number(), most_bytes);
  if (!bytes) refuse_name(name, std::string("cannot be read: ") + std::strerror(errno));
  if (bytes->size() <= most_bytes) return *std::move(bytes);
  refuse_name(name, "has more than " + std::to_string(most_bytes) + " bytes, which none needs");
}

}  // namespace zerodrift::files
