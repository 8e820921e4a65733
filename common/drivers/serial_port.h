// SPDX-License-Identifier: Apache-2.0
// A serial device for reading: raw bytes, 8 data bits, no parity, one stop bit, no flow control.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace zerodrift::drivers {

enum class SerialStatus : std::uint8_t {
  kData,         // there are bytes
  kTimeout,      // nothing came
  kInterrupted,  // a signal came
  kGone,         // the device hung up or was unplugged: open it again later
};

struct SerialRead {
  SerialStatus status = SerialStatus::kTimeout;
  std::size_t bytes = 0;
};

class SerialPort {
 public:
  // Opens the device, sets the line up and drops bytes that arrived before. Nobody else can open it
  // meanwhile. Throws DriverError naming the device.
  SerialPort(std::string device, unsigned baud_rate);
  ~SerialPort();
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  // Closes the device and opens it again. Throws DriverError; it is gone then.
  void reopen();

  // Waits until there is something to read.
  [[nodiscard]] SerialStatus wait(std::chrono::milliseconds timeout) noexcept;

  // Takes what is there, without waiting.
  [[nodiscard]] SerialRead read(std::span<std::uint8_t> buffer) noexcept;

  [[nodiscard]] const std::string& device() const noexcept { return device_; }
  [[nodiscard]] int descriptor() const noexcept { return fd_; }

 private:
  void close() noexcept;

  std::string device_;
  unsigned baud_rate_ = 0;
  int fd_ = -1;
};

}  // namespace zerodrift::drivers
