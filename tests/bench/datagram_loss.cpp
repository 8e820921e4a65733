// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/datagram_loss.h"

#include <linux/filter.h>
#include <sys/socket.h>

#include <array>
#include <filesystem>
#include <string>

namespace zerodrift::bench {
namespace {

// Classic BPF (kernel Documentation/networking/filter): random word, modulo 1000, below `permille`
// keep 0 bytes, else all.
bool drop_at(int socket, unsigned permille) {
  constexpr auto kRandomWord = static_cast<__u32>(SKF_AD_OFF + SKF_AD_RANDOM);
  std::array<sock_filter, 5> code{{{BPF_LD | BPF_W | BPF_ABS, 0, 0, kRandomWord},
                                   {BPF_ALU | BPF_MOD | BPF_K, 0, 0, 1000},
                                   {BPF_JMP | BPF_JGE | BPF_K, 0, 1, permille},
                                   {BPF_RET | BPF_K, 0, 0, 0xffffffff},
                                   {BPF_RET | BPF_K, 0, 0, 0}}};
  const sock_fprog program{static_cast<unsigned short>(code.size()), code.data()};
  return setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0;
}

}  // namespace

std::size_t lose_datagrams(unsigned permille) {
  std::size_t sockets = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int descriptor = std::stoi(entry.path().filename());
    int kind = 0;
    socklen_t size = sizeof kind;
    if (getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &kind, &size) != 0 || kind != SOCK_DGRAM) {
      continue;
    }
    if (drop_at(descriptor, permille)) ++sockets;
  }
  return sockets;
}

}  // namespace zerodrift::bench
