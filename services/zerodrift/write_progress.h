// SPDX-License-Identifier: Apache-2.0
// What is said while a large file is being written.
#pragma once

#include <cstdint>
#include <filesystem>

#include "services/zerodrift/progress_bar.h"

namespace zerodrift::services {

// A bar on a terminal, and one line on standard error, early and once, where the file becomes
// large: nobody has to find a gigabyte by a full disk.
class WriteProgress {
 public:
  // `out` may be empty: nothing is written then.
  WriteProgress(const std::string& what, std::filesystem::path out);
  // As record::WriteShare.
  void operator()(double share, std::uint64_t bytes);

 private:
  void announce(double expected_bytes);

  ProgressBar bar_;
  std::filesystem::path out_;
  bool judged_ = false;
};

}  // namespace zerodrift::services
