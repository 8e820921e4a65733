// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

namespace zerodrift::mcap {

// Bytes that can be read anywhere.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  // Replaces `to` by at most `size` bytes from `offset` on; fewer at the end. Throws McapError
  // where the medium fails.
  virtual void read(std::uint64_t offset, std::size_t size, std::string& to) const = 0;
};

// A file as long as it was when it was opened: one that is still written is read as one that was
// cut there.
class FileSource final : public ByteSource {
 public:
  // Throws McapError where it can't be opened.
  explicit FileSource(const std::filesystem::path& path);
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  [[nodiscard]] std::uint64_t size() const override { return size_; }
  void read(std::uint64_t offset, std::size_t size, std::string& to) const override;

 private:
  std::filesystem::path path_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

class MemorySource final : public ByteSource {
 public:
  explicit MemorySource(std::string bytes) : bytes_(std::move(bytes)) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
  void read(std::uint64_t offset, std::size_t size, std::string& to) const override {
    to = offset < bytes_.size() ? bytes_.substr(static_cast<std::size_t>(offset), size) : "";
  }

 private:
  std::string bytes_;
};

}  // namespace zerodrift::mcap
