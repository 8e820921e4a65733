// SPDX-License-Identifier: Apache-2.0
// Another program in gnuplot's place.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace zerodrift::report {

// PATH for as long as this lives.
class OtherPath {
 public:
  explicit OtherPath(const std::string& path) : before_(std::getenv("PATH")) {
    ::setenv("PATH", path.c_str(), 1);
  }
  ~OtherPath() { ::setenv("PATH", before_.c_str(), 1); }
  OtherPath(const OtherPath&) = delete;
  OtherPath& operator=(const OtherPath&) = delete;

 private:
  std::string before_;
};

inline void make_executable(const std::filesystem::path& file) {
  std::filesystem::permissions(file, std::filesystem::perms::owner_all);
}

}  // namespace zerodrift::report
