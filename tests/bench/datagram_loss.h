// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace zerodrift::bench {

// From now on the kernel drops each datagram that arrives at a UDP socket of this process with this
// probability, independently: a filter on the sockets, so that no other process is touched and no
// privilege is needed. Returns the number of sockets. Thousandths, 0 to 1000.
std::size_t lose_datagrams(unsigned permille);

}  // namespace zerodrift::bench
