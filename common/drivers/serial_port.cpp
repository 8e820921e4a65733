// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/serial_port.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

#include "common/drivers/driver_error.h"

namespace zerodrift::drivers {
namespace {

struct BaudRate {
  unsigned bits_per_second;
  speed_t termios_speed;
};

constexpr std::array kBaudRates{
    BaudRate{9600, B9600},       BaudRate{19200, B19200},     BaudRate{38400, B38400},
    BaudRate{57600, B57600},     BaudRate{115200, B115200},   BaudRate{230400, B230400},
    BaudRate{460800, B460800},   BaudRate{576000, B576000},   BaudRate{921600, B921600},
    BaudRate{1000000, B1000000}, BaudRate{2000000, B2000000}, BaudRate{4000000, B4000000},
};

speed_t termios_speed(const std::string& device, unsigned baud_rate) {
  std::string accepted;
  for (const BaudRate& known : kBaudRates) {
    if (known.bits_per_second == baud_rate) return known.termios_speed;
    (accepted += ' ') += std::to_string(known.bits_per_second);
  }
  throw DriverError(device + ": " + std::to_string(baud_rate) +
                    " baud is not available; accepted:" + accepted);
}

[[noreturn]] void refuse(const std::string& device, const std::string& what) {
  throw DriverError(device + ": " + what + ": " + std::strerror(errno));
}

void set_up_line(int fd, const std::string& device, speed_t speed) {
  termios line{};
  if (::tcgetattr(fd, &line) != 0) refuse(device, "is not a serial device (tty)");
  if (::ioctl(fd, TIOCEXCL) != 0) refuse(device, "cannot keep the serial device for itself");
  ::cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  line.c_cc[VMIN] = 0;
  line.c_cc[VTIME] = 0;
  if (::cfsetispeed(&line, speed) != 0 || ::cfsetospeed(&line, speed) != 0 ||
      ::tcsetattr(fd, TCSANOW, &line) != 0) {
    refuse(device, "cannot set the line up");
  }
  ::tcflush(fd, TCIFLUSH);
}

}  // namespace

SerialPort::SerialPort(std::string device, unsigned baud_rate)
    : device_(std::move(device)), baud_rate_(baud_rate) {
  reopen();
}

SerialPort::~SerialPort() {
  close();
}

void SerialPort::reopen() {
  close();
  const speed_t speed = termios_speed(device_, baud_rate_);
  fd_ = ::open(device_.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0) refuse(device_, "cannot open the serial device");
  try {
    set_up_line(fd_, device_, speed);
  } catch (...) {
    close();
    throw;
  }
}

void SerialPort::close() noexcept {
  if (fd_ < 0) return;
  ::ioctl(fd_, TIOCNXCL);  // a pseudo-terminal would remember it
  ::close(std::exchange(fd_, -1));
}

SerialStatus SerialPort::wait(std::chrono::milliseconds timeout) noexcept {
  if (fd_ < 0) return SerialStatus::kGone;
  pollfd waited{fd_, POLLIN, 0};
  const auto longest = std::chrono::milliseconds{std::numeric_limits<int>::max()};
  const int ready =
      ::poll(&waited, 1,
             static_cast<int>(std::clamp(timeout, std::chrono::milliseconds{0}, longest).count()));
  if (ready < 0) return errno == EINTR ? SerialStatus::kInterrupted : SerialStatus::kGone;
  if (ready == 0) return SerialStatus::kTimeout;
  const bool hung_up = (waited.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
  return hung_up ? SerialStatus::kGone : SerialStatus::kData;
}

SerialRead SerialPort::read(std::span<std::uint8_t> buffer) noexcept {
  const ssize_t count = ::read(fd_, buffer.data(), buffer.size());
  if (count > 0) return {SerialStatus::kData, static_cast<std::size_t>(count)};
  // With VMIN = 0 a tty answers 0 where nothing is there, and where it hung up; only poll can tell
  // these apart.
  if (count == 0 || errno == EAGAIN || errno == EWOULDBLOCK) {
    const SerialStatus status = wait(std::chrono::milliseconds{0});
    return {status == SerialStatus::kGone ? SerialStatus::kGone : SerialStatus::kTimeout, 0};
  }
  return {errno == EINTR ? SerialStatus::kInterrupted : SerialStatus::kGone, 0};
}

}  // namespace zerodrift::drivers
