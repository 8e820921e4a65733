// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>

#include "common/dds/participant.h"

namespace zerodrift::service {

// Until every matched reader has received everything written, or `stopping` is set. However long
// that takes: a reader that stands still would lose what is written over meanwhile. One that was
// killed stays matched for the participants' lease.
template <typename Message>
void wait_for_receipt(dds::Writer<Message>& writer, const std::atomic<bool>& stopping) {
  constexpr std::chrono::milliseconds kStopCheck{100};
  while (!stopping && !writer.wait_until_received(kStopCheck)) {
  }
}

}  // namespace zerodrift::service
