// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>

namespace zerodrift {

// The far end of a serial line.
class PseudoTerminal {
 public:
  PseudoTerminal() : line_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    if (line_ < 0 || ::grantpt(line_) != 0 || ::unlockpt(line_) != 0) std::abort();
  }
  ~PseudoTerminal() { unplug(); }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  [[nodiscard]] std::string device() const { return ::ptsname(line_); }

  void send(std::span<const std::uint8_t> bytes) const {
    ASSERT_EQ(::write(line_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  void unplug() {
    if (line_ >= 0) ::close(line_);
    line_ = -1;
  }

 private:
  int line_;
};

}  // namespace zerodrift
