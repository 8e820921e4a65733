// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

#include "common/dds/participant.h"
#include "common/service/host.h"

namespace zerodrift::service {

// Until a line says for whom or what a replay waits.
inline constexpr std::chrono::milliseconds kPatience{5000};

// Until every matched reader has received everything written, or `stopping` is set. However long
// that takes: a reader that stands still would lose what is written over meanwhile. One that was
// killed stays matched for the participants' lease. A long wait is reported, each time.
template <typename Message>
void wait_for_receipt(dds::Writer<Message>& writer, Host& host, std::uint32_t gyro_id,
                      const std::atomic<bool>& stopping) {
  constexpr std::chrono::milliseconds kTurn{100};
  const std::string topic(dds::TopicOf<Message>::kSpec.name);
  for (auto waited = kTurn; !stopping && !writer.wait_until_received(kTurn); waited += kTurn) {
    if (waited != kPatience) continue;
    host.raise({.code = "waiting_for_receipt",
                .text = "topic " + topic +
                        ": waiting until every reader has what was sent; one stands still, or was "
                        "killed, which is known " +
                        std::to_string(dds::kParticipantLease.count()) + " s afterwards",
                .gyro_id = gyro_id,
                .subject = topic});
  }
}

}  // namespace zerodrift::service
