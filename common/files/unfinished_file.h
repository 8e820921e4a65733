// SPDX-License-Identifier: Apache-2.0
// Files that are being written and must not be left behind half, also where the process is ended in
// mid-work.
#pragma once

#include <filesystem>
#include <string>

namespace zerodrift::files {

// The name of a file that is not finished. It is removed with the object, or when the process ends
// by end_without_unfinished_files(), unless it was kept or got its own name. Any thread.
class UnfinishedFile {
 public:
  // Of a file that is or will be there, e.g. the <target>.active of a recording.
  explicit UnfinishedFile(std::filesystem::path path);
  // Creates ".<name>.<pid>.<n>.partial" beside the target, so that a rename stays within one file
  // system. `fd` is the caller's to close. Throws FileError.
  UnfinishedFile(const std::filesystem::path& target, int& fd);
  ~UnfinishedFile();
  UnfinishedFile(const UnfinishedFile&) = delete;
  UnfinishedFile& operator=(const UnfinishedFile&) = delete;

  // Gives the file its name, over whatever has it. Returns errno, 0 where it has it.
  [[nodiscard]] int rename_to(const std::filesystem::path& target);
  // It stays as it is.
  void keep();

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

// The path of another file in the same folder. path::replace_filename() of libstdc++ 12 frees what
// it never had where memory ends within it.
[[nodiscard]] std::filesystem::path beside(const std::filesystem::path& target,
                                           const std::string& name);

// <stem>.cut<N><extension> beside the target, the first that nothing has: for what was written of
// a file that did not become whole.
[[nodiscard]] std::filesystem::path free_name_of_cut(const std::filesystem::path& target);

// Removes what is unfinished and ends the process at once.
[[noreturn]] void end_without_unfinished_files(int exit_code);

}  // namespace zerodrift::files
