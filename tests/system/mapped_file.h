// SPDX-License-Identifier: Apache-2.0
// A value in a file that other processes map too.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>

namespace zerodrift::system_test {

// Zeros at first.
template <typename Value>
class MappedFile {
 public:
  explicit MappedFile(const std::filesystem::path& file) {
    const int descriptor = ::open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600);
    if (descriptor < 0 || ::ftruncate(descriptor, sizeof(Value)) != 0)
      throw std::runtime_error("cannot make " + file.string());
    void* memory =
        ::mmap(nullptr, sizeof(Value), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    ::close(descriptor);
    if (memory == MAP_FAILED) throw std::runtime_error("cannot map " + file.string());
    value_ = static_cast<Value*>(memory);
  }
  ~MappedFile() { ::munmap(value_, sizeof(Value)); }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  Value& operator*() const { return *value_; }
  Value* operator->() const { return value_; }

 private:
  Value* value_ = nullptr;
};

}  // namespace zerodrift::system_test
