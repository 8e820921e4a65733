// SPDX-License-Identifier: Apache-2.0
// One hop of Cyclone DDS; there only where the build has it.
#include "services/zerodrift/latency_link.h"

#if ZERODRIFT_WITH_CYCLONE
#include <stdexcept>

#include "common/dds/cyclone_hop.h"

namespace zerodrift::services {
namespace {

class CycloneLink final : public LatencyLink {
 public:
  CycloneLink(const LinkOptions& options, OnPing on_ping)
      : on_ping_(std::move(on_ping)),
        hop_(cyclone_hop_open(
            options.network.domain, options.name.c_str(), options.end != LinkEnd::kFar,
            [](void* self, const cyclone_sample* sample) {
              static_cast<CycloneLink*>(self)->on_ping_(
                  {sample->sequence, sample->sent_ns, sample->interval_s});
            },
            this)) {
    if (hop_ == nullptr) throw std::runtime_error("bench: Cyclone DDS refuses a participant");
  }
  ~CycloneLink() override { cyclone_hop_close(hop_); }
  bool connected() override { return cyclone_hop_connected(hop_); }
  void send(const Ping& ping) override {
    const cyclone_sample sample{ping.sequence, ping.sent_ns, ping.interval_s};
    cyclone_hop_send(hop_, &sample);
  }

 private:
  OnPing on_ping_;
  cyclone_hop* hop_;
};

}  // namespace

std::unique_ptr<LatencyLink> open_cyclone_link(const LinkOptions& options,
                                               LatencyLink::OnPing on_ping) {
  return std::make_unique<CycloneLink>(options, std::move(on_ping));
}

}  // namespace zerodrift::services
#endif
