// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/datagram_loss.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace zerodrift::bench {
namespace {

class Loopback {
 public:
  Loopback() : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    bind(socket_, reinterpret_cast<const sockaddr*>(&address_), sizeof address_);
    socklen_t size = sizeof address_;
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address_), &size);
  }
  ~Loopback() { close(socket_); }
  Loopback(const Loopback&) = delete;
  Loopback& operator=(const Loopback&) = delete;

  // How many of so many datagrams to itself arrive.
  int arrived(int sent) {
    int count = 0;
    char byte = 0;
    for (int i = 0; i < sent; ++i) {
      sendto(socket_, &byte, 1, 0, reinterpret_cast<const sockaddr*>(&address_), sizeof address_);
      if (recv(socket_, &byte, 1, MSG_DONTWAIT) == 1) ++count;
    }
    return count;
  }

 private:
  int socket_;
  sockaddr_in address_{};
};

TEST(DatagramLoss, TakesTheShareAskedForOfEverySocket) {
  Loopback one;
  Loopback other;
  EXPECT_EQ(one.arrived(100), 100);
  EXPECT_GE(lose_datagrams(1000), 2u);
  EXPECT_EQ(one.arrived(100), 0);
  EXPECT_EQ(other.arrived(100), 0);
  lose_datagrams(0);
  EXPECT_EQ(one.arrived(100), 100);
}

TEST(DatagramLoss, IsRandomWithTheGivenProbability) {
  Loopback loopback;
  lose_datagrams(250);
  // Binomial, n = 4000, p = 0.75: sigma = 27; the kernel's generator has no seed to fix, so 6
  // sigma.
  EXPECT_NEAR(loopback.arrived(4000), 3000, 6 * 27);
}

}  // namespace
}  // namespace zerodrift::bench
