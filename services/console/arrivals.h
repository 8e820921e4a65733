// SPDX-License-Identifier: Apache-2.0
// What the middleware's threads bring, in bounded queues until the server's thread comes for it.
#pragma once

#include <atomic>
#include <cstdint>

#include "common/core/spsc_queue.h"
#include "common/service/host.h"
#include "services/console/gateway.h"
#include "services/console/inbox.h"

namespace zerodrift::services {

class Arrivals {
 public:
  explicit Arrivals(service::Host& host);

  // Gives the gateway all that came. The server's thread.
  void drain_into(Gateway& gateway);

  // Any thread.
  // What was left out, since there was no room.
  [[nodiscard]] std::uint64_t overflow() const;
  // Whether the newest sample's source keeps its consumers' pace.
  [[nodiscard]] bool paced() const { return paced_; }

 private:
  template <typename Message>
  struct Topic {
    Topic(service::Host& host, std::size_t capacity);
    Mailbox<Message> waiting;
    dds::Reader<Message> reader;
  };
  struct Sample {
    msg::CompensatedRate message{};
    std::int64_t monotonic_ns = 0;
  };
  struct StatusOrEnd {
    Gateway::WriterId writer{};
    bool is_gone = false;
    msg::ServiceStatus status{};
  };

  core::SpscQueue<Sample> samples_;
  std::atomic<std::uint64_t> sample_overflow_{0};
  std::atomic<bool> paced_{true};
  Mailbox<StatusOrEnd> statuses_;
  dds::Reader<msg::CompensatedRate> sample_reader_;
  dds::Reader<msg::ServiceStatus> status_reader_;
  Topic<msg::RateReference> references_;
  Topic<msg::Temperature> temperatures_;
  Topic<msg::AllanReport> allan_;
  Topic<msg::NavigationState> navigation_;
  Topic<msg::TwinReport> twins_;
  Topic<msg::ThermalCoverage> coverage_;
  Topic<msg::Event> events_;
};

}  // namespace zerodrift::services
