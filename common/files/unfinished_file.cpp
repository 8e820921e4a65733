// SPDX-License-Identifier: Apache-2.0
#include "common/files/unfinished_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "common/files/file_error.h"

namespace zerodrift::files {
namespace {

struct Unfinished {
  std::mutex mutex;
  std::set<std::filesystem::path> paths;
};

// Never destroyed: a process may be ended at any time.
Unfinished& unfinished() {
  static auto* const all = new Unfinished;
  return *all;
}

}  // namespace

std::filesystem::path beside(const std::filesystem::path& target, const std::string& name) {
  std::string path = target.native();
  path.resize(path.size() - target.filename().native().size());
  return path + name;
}

UnfinishedFile::UnfinishedFile(std::filesystem::path path) : path_(std::move(path)) {
  const std::lock_guard lock(unfinished().mutex);
  unfinished().paths.insert(path_);
}

UnfinishedFile::UnfinishedFile(const std::filesystem::path& target, int& fd) : path_(target) {
  const std::string stem =
      std::string{"."} + target.filename().string() + '.' + std::to_string(::getpid());
  const std::lock_guard lock(unfinished().mutex);
  for (int attempt = 0;; ++attempt) {
    path_ = beside(target, stem + '.' + std::to_string(attempt) + ".partial");
    const auto place = unfinished().paths.insert(path_);
    if (!place.second) continue;
    fd = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0) return;
    const int error = errno;
    unfinished().paths.erase(place.first);
    if (error == EEXIST) continue;
    throw FileError(target.string() +
                    ": cannot create a file in its folder: " + std::strerror(error));
  }
}

UnfinishedFile::~UnfinishedFile() {
  const std::lock_guard lock(unfinished().mutex);
  if (unfinished().paths.erase(path_) > 0) ::unlink(path_.c_str());
}

int UnfinishedFile::rename_to(const std::filesystem::path& target) {
  const std::lock_guard lock(unfinished().mutex);
  if (::rename(path_.c_str(), target.c_str()) != 0) return errno;
  unfinished().paths.erase(path_);
  return 0;
}

void UnfinishedFile::keep() {
  const std::lock_guard lock(unfinished().mutex);
  unfinished().paths.erase(path_);
}

std::filesystem::path free_name_of_cut(const std::filesystem::path& target) {
  for (int number = 1;; ++number) {
    std::filesystem::path name =
        beside(target, target.stem().string() + ".cut" + std::to_string(number) +
                           target.extension().string());
    std::error_code error;
    if (!std::filesystem::exists(std::filesystem::symlink_status(name, error))) return name;
  }
}

void end_without_unfinished_files(int exit_code) {
  unfinished().mutex.lock();  // for good: nothing new begins
  for (const auto& path : unfinished().paths) ::unlink(path.c_str());
  std::_Exit(exit_code);
}

}  // namespace zerodrift::files
