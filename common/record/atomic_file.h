// SPDX-License-Identifier: Apache-2.0
// A file that appears whole or not at all: written into a temporary file beside the target, then
// fsync and rename.
#pragma once

#include <filesystem>
#include <string_view>

namespace zerodrift::record {

class AtomicFile {
 public:
  // Throws RecordError where the target's folder can't be written.
  explicit AtomicFile(std::filesystem::path target);

  // Without commit() nothing is left behind.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  // Remembers the first failure and drops whatever comes after it; check() and commit() report it.
  void append(std::string_view bytes) noexcept;

  // Throws RecordError where an append() has failed.
  void check() const;

  // Makes the file durable and gives it its name. Throws RecordError. Nothing may be appended after
  // it.
  void commit();

 private:
  std::filesystem::path target_;
  std::filesystem::path partial_;
  int fd_ = -1;
  int first_error_ = 0;  // errno of the first append() that failed
  bool committed_ = false;
};

}  // namespace zerodrift::record
