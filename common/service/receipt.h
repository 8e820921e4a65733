// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>

#include "common/dds/participant.h"

namespace zerodrift::service {

// Until every matched reader has received everything written, the time has passed, or `stopping` is
// set: a reader that was killed stays matched for the participants' lease, and a stop must not wait
// for it.
template <typename Message>
void wait_for_receipt(dds::Writer<Message>& writer, std::chrono::milliseconds at_most,
                      const std::atomic<bool>& stopping) {
  constexpr std::chrono::milliseconds kStopCheck{100};
  for (auto left = at_most; left.count() > 0 && !stopping; left -= kStopCheck) {
    if (writer.wait_until_received(std::min(left, kStopCheck))) return;
  }
}

}  // namespace zerodrift::service
