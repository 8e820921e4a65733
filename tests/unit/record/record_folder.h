// SPDX-License-Identifier: Apache-2.0
// A folder of records that may be refused.
#pragma once

#include <filesystem>
#include <string>

#include "common/files/file_error.h"
#include "common/record/record_reader.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::record {

class RecordFolder : public ScratchFolder {
 protected:
  // Without the folder's name, which differs from run to run.
  [[nodiscard]] std::string shown(std::string line) const {
    const std::string folder = path("").string();
    for (std::size_t at = 0; (at = line.find(folder)) != std::string::npos;)
      line.erase(at, folder.size());
    return line;
  }
  // What a record is refused with by its end; empty where it is read whole.
  [[nodiscard]] std::string refusal(const std::filesystem::path& file,
                                    const RecordOptions& options = {}) const {
    try {
      RecordReader reader(file, options);
      while (reader.next() != nullptr) {
      }
    } catch (const files::FileError& error) {
      return shown(error.what());
    }
    return "";
  }
};

}  // namespace zerodrift::record
