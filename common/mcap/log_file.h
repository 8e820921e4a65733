// SPDX-License-Identifier: Apache-2.0
// A file that grows for hours and must survive whatever ends its writer: it is written under the
// name <target>.active, locked by its writer, and takes its own when it is whole.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "common/mcap/mcap_error.h"

namespace zerodrift::mcap {

// Another process, or another LogFile of this one, is writing a file of this name.
class FileInUse : public McapError {
 public:
  using McapError::McapError;
};

class LogFile {
 public:
  // What an earlier writer left under the .active name is moved to <stem>.cut<N><extension>, which
  // moved_aside() says so; where one is still writing it, throws FileInUse and changes nothing.
  // Throws McapError where the folder can't be written or `target` is there and no regular file.
  explicit LogFile(std::filesystem::path target);
  // Without commit() the .active file stays.
  ~LogFile();
  LogFile(const LogFile&) = delete;
  LogFile& operator=(const LogFile&) = delete;

  // Straight to the operating system: what was appended survives the end of the process. Throws
  // McapError; the file is cut back to where it was before, as far as the medium allows.
  void append(std::string_view bytes);
  // To the medium: survives a power cut. Throws McapError.
  void sync();
  // sync(), then the name. Throws McapError, also where the .active name is another file's by now.
  // Nothing may be appended after it.
  void commit();

  [[nodiscard]] const std::filesystem::path& target() const noexcept { return target_; }
  // Empty where nothing was.
  [[nodiscard]] const std::filesystem::path& moved_aside() const noexcept { return moved_aside_; }

 private:
  void take_name();

  std::filesystem::path target_;
  std::filesystem::path active_;
  std::filesystem::path moved_aside_;
  std::uint64_t size_ = 0;
  int fd_ = -1;
};

}  // namespace zerodrift::mcap
