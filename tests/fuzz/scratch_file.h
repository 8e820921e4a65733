// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace zerodrift::fuzz {

// A file in memory under a name with the suffix that a parser goes by. The folder holds nothing
// else and goes with the object.
class ScratchFile {
 public:
  // `name` such as "input.csv.gz".
  explicit ScratchFile(const std::string& name);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  // Becomes the whole content.
  void fill(std::string_view content);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  int memory_ = -1;
  std::filesystem::path folder_;
  std::filesystem::path path_;
};

}  // namespace zerodrift::fuzz
