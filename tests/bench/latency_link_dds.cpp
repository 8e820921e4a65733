// SPDX-License-Identifier: Apache-2.0
// One hop of Fast DDS, and the whole chain through the compensation service.
#include <optional>

#include "tests/bench/bench_sample.h"
#include "tests/bench/latency_link.h"
#include "tests/bench/measured_hop.h"

namespace zerodrift::bench {
namespace {

class HopLink final : public LatencyLink {
 public:
  HopLink(const LinkOptions& options, OnPing on_ping)
      : hop_(options.network, dds::hop_alternative(options.kind), options.name,
             options.end == LinkEnd::kFar ? dds::HopEnd::kFar : dds::HopEnd::kNear,
             [handler = std::move(on_ping)](const msg::AngularRate& sample) {
               handler({sample.sequence_number(), sample.publish_time_ns(), sample.interval_s()});
             }) {}
  bool connected() override { return hop_.connected(); }
  void send(const Ping& ping) override {
    auto sample = synthetic_sample(1, ping.sequence, ping.sent_ns, ping.interval_s);
    hop_.send(sample);
  }

 private:
  dds::MeasuredHop hop_;
};

// Gyro and subscriber of a compensation service that runs in the same domain. The gyro's id is the
// link's name.
class ChainLink final : public LatencyLink {
 public:
  ChainLink(const LinkOptions& options, OnPing on_ping)
      : gyro_id_(static_cast<std::uint32_t>(std::stoul(options.name))),
        participant_("zerodrift_bench", options.network) {
    if (options.end != LinkEnd::kFar) writer_.emplace(participant_);
    if (options.end == LinkEnd::kNear) return;
    reader_.emplace(
        participant_, [this, handler = std::move(on_ping)](const msg::CompensatedRate& sample,
                                                           const dds::SampleOrigin&) {
          if (sample.gyro_id() != gyro_id_) return;
          handler({sample.sequence_number(), sample.publish_time_ns(), sample.interval_s()});
        });
  }
  // The service makes a gyro's writer when it hears the gyro.
  bool connected() override { return !writer_ || writer_->matched() > 0; }
  void send(const Ping& ping) override {
    auto sample = synthetic_sample(gyro_id_, ping.sequence, ping.sent_ns, ping.interval_s);
    writer_->write(sample);
  }

 private:
  std::uint32_t gyro_id_;
  dds::Participant participant_;
  std::optional<dds::Writer<msg::AngularRate>> writer_;
  std::optional<dds::Reader<msg::CompensatedRate>> reader_;
};

}  // namespace

std::unique_ptr<LatencyLink> open_hop_link(const LinkOptions& options,
                                           LatencyLink::OnPing on_ping) {
  return std::make_unique<HopLink>(options, std::move(on_ping));
}

std::unique_ptr<LatencyLink> open_chain_link(const LinkOptions& options,
                                             LatencyLink::OnPing on_ping) {
  return std::make_unique<ChainLink>(options, std::move(on_ping));
}

}  // namespace zerodrift::bench
