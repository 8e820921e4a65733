// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/scratch_file.h"

#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace zerodrift::fuzz {
namespace {

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

std::filesystem::path new_folder() {
  std::string name = (std::filesystem::temp_directory_path() / "zerodrift_fuzz_XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) fail("mkdtemp");
  return name;
}

}  // namespace

ScratchFile::ScratchFile(const std::string& name)
    : memory_(::memfd_create("zerodrift_fuzz", MFD_CLOEXEC)) {
  if (memory_ < 0) fail("memfd_create");
  folder_ = new_folder();
  path_ = folder_ / name;
  const std::string place =
      "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(memory_);
  std::filesystem::create_symlink(place, path_);
}

ScratchFile::~ScratchFile() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  std::filesystem::remove(folder_, ignored);
  ::close(memory_);
}

void ScratchFile::fill(std::string_view content) {
  if (::ftruncate(memory_, 0) != 0) fail("ftruncate");
  for (std::size_t at = 0; at < content.size();) {
    const ssize_t written =
        ::pwrite(memory_, content.data() + at, content.size() - at, static_cast<off_t>(at));
    if (written < 0) fail("pwrite");
    at += static_cast<std::size_t>(written);
  }
}

}  // namespace zerodrift::fuzz
