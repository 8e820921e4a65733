// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "common/files/descriptor.h"

namespace zerodrift::files {

// kAlone: of one process, whose file another's would replace. kTogether: of those that write the
// same.
enum class Claim : std::uint8_t { kAlone, kTogether };

// Which process writes the files of a number in a folder, where several may: by a lock on the byte
// of that number in the folder's .claims, which the kernel takes back however the process ends.
class ClaimedNumbers {
 public:
  // A folder that can't be written, or none (""), is claimed by nobody; who writes there will be
  // told.
  explicit ClaimedNumbers(const std::filesystem::path& folder);

  // False where another process has it. For as long as the object lives. Any thread.
  [[nodiscard]] bool claim(std::uint32_t number, Claim how);

 private:
  Descriptor file_;
};

}  // namespace zerodrift::files
