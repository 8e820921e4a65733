// SPDX-License-Identifier: Apache-2.0
// Between the system's messages and the console's channels (idl/proto/telemetry.proto): what is
// kept, what is said again to who comes late, and what nobody asked for and is never encoded. One
// thread; time is an argument.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "common/core/axis.h"
#include "common/core/bounded_table.h"
#include "common/dds/discovery.h"
#include "common/dds/topics.h"
#include "common/foxglove/hub.h"
#include "common/service/hop_latency.h"
#include "common/service/status_writers.h"
#include "common/thermal/temperature_track.h"
#include "idl/proto/telemetry.pb.h"
#include "services/console/history.h"

namespace zerodrift::services {

struct GatewayOptions {
  std::string version{};
  std::uint32_t domain = 0;
  HistoryOptions history{};
  std::size_t most_gyros = 128;
  std::size_t most_services = static_cast<std::size_t>(dds::kServiceStatus.keys);
};

class Gateway {
 public:
  using WriterId = decltype(dds::SampleOrigin::writer);
  using GyroAxis = std::tuple<std::uint32_t, std::uint32_t>;
  using GyroAxisStream = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;

  // The hub lives longer; its callback `subscribed` goes to subscribed().
  Gateway(const GatewayOptions& options, foxglove::Hub& hub);

  void take(const msg::CompensatedRate& sample, const service::ArrivalClocks& arrival);
  void take(const msg::RateReference& reference);
  void take(const msg::Temperature& reading, std::int64_t unix_ns);
  void take(const msg::AllanReport& report, std::int64_t unix_ns);
  void take(const msg::NavigationState& state, std::int64_t unix_ns);
  void take(const msg::TwinReport& report, std::int64_t unix_ns);
  void take(const msg::ThermalCoverage& coverage, std::int64_t unix_ns);
  void take(const msg::ServiceStatus& status, const WriterId& writer,
            const service::ArrivalClocks& arrival);
  void take_gone(const WriterId& writer, std::int64_t unix_ns);  // of a service_status
  void take(const msg::Event& event, std::int64_t unix_ns);

  void subscribed(foxglove::ClientId client, foxglove::ChannelId channel);
  // Sends what has gathered: samples, rows, and what is kept to who subscribed since.
  void flush(std::int64_t unix_ns);
  // Reports to each client of itself and of the middleware; once a second.
  void report_gateway(const std::vector<dds::RemoteEndpoint>& endpoints, std::int64_t unix_ns);
  // What the headline of each gyro needs, to who asked for it; once a second.
  void report_fleet(const service::ArrivalClocks& now);
  void note_dropped_by_gone(std::uint64_t frames) { dropped_by_gone_ += frames; }

  // True while somebody looks at samples: flush() is to come soon.
  [[nodiscard]] bool is_watched() const { return is_watched_; }
  [[nodiscard]] std::uint64_t dropped_of_all() const;

  // For /metrics and /health.
  struct GyroFigures {
    std::uint64_t samples = 0;
    std::uint64_t missing = 0;
    // Of the newest sample's arrival, or, where none came, since when the gyro is known; no step of
    // the clock makes it older.
    std::int64_t newest_monotonic_ns = 0;
    std::optional<telemetry::CompensatedRate> newest{};
    // Axes of which a sample was ever valid; all, where none was.
    core::PerAxis<bool> measured{};
  };
  [[nodiscard]] std::map<std::uint32_t, GyroFigures> gyro_figures() const;
  [[nodiscard]] const std::map<std::string, telemetry::ServiceStatus>& services() const {
    return statuses_.entries();
  }
  [[nodiscard]] const std::map<GyroAxisStream, telemetry::AllanReport>& allan_reports() const {
    return allan_;
  }
  // When the newest sample came; 0: none yet.
  [[nodiscard]] const service::ArrivalClocks& newest_sample() const { return newest_sample_; }
  [[nodiscard]] service::ArrivalClocks newest_sample_of(std::uint32_t gyro) const;
  // Messages of more gyros, thermometers or services than are kept.
  [[nodiscard]] std::uint64_t left_out() const { return left_out_; }

 private:
  struct Channels {
    foxglove::ChannelId rate = 0, samples = 0, history = 0, temperature = 0, allan = 0,
                        navigation = 0, twin = 0, coverage = 0;
  };
  struct Gyro {
    Gyro(std::uint32_t gyro_id, const HistoryOptions& options)
        : id(gyro_id), history(gyro_id, options) {}
    static constexpr std::size_t kMostProbes = 16;  // with a rate
    const std::uint32_t id;
    Channels channels{};
    GyroHistory history;
    telemetry::SampleBatch batch{};
    core::BoundedTable<std::string, thermal::TemperatureTrack> tracks{kMostProbes};
    std::uint64_t samples = 0;
    std::uint64_t missing = 0;
    std::uint64_t next_sequence = 0;      // 0: none came
    std::uint64_t doubted_sequence = 0;   // ahead of that, not confirmed by one in order; 0: none
    service::ArrivalClocks arrival{};     // of the newest
    std::int64_t published_since_ns = 0;  // since when its publisher is known, monotonic; 0: not
    msg::CompensatedRate newest{};
    core::PerAxis<bool> measured{};  // a sample of the axis was valid
    std::optional<telemetry::ThermalCoverage> coverage{};
  };
  Gyro* gyro(std::uint32_t id);  // null: more than are kept
  void add_channels(Gyro& gyro);
  void count(Gyro& gyro, const msg::CompensatedRate& sample) const;
  // Null: more are there than are kept.
  telemetry::ServiceStatus* place_of(const std::string& service);
  void publish_status(const std::string& service, std::int64_t unix_ns);
  [[nodiscard]] telemetry::GyroSummary summary(const Gyro& gyro, std::int64_t monotonic_ns) const;
  void flush(Gyro& gyro, std::int64_t unix_ns);
  void flush_rows(Gyro& gyro, std::int64_t unix_ns);
  [[nodiscard]] bool waits_for_backlog(foxglove::ClientId client,
                                       foxglove::ChannelId channel) const;

  GatewayOptions options_;
  foxglove::Hub& hub_;
  foxglove::ChannelId status_channel_ = 0;
  foxglove::ChannelId event_channel_ = 0;
  foxglove::ChannelId gateway_channel_ = 0;
  foxglove::ChannelId fleet_channel_ = 0;
  core::BoundedTable<std::uint32_t, Gyro> gyros_;
  std::map<GyroAxisStream, telemetry::AllanReport> allan_;
  std::map<GyroAxis, telemetry::TwinReport> twins_;
  core::BoundedTable<std::string, telemetry::ServiceStatus> statuses_;
  std::map<std::string, std::uint32_t> status_keys_;
  service::StatusWriters<WriterId> writers_;
  std::deque<telemetry::Event> events_;
  // Who waits for a channel's backlog, each once.
  std::deque<std::pair<foxglove::ClientId, foxglove::ChannelId>> late_comers_;
  bool is_watched_ = false;
  service::ArrivalClocks newest_sample_;
  std::uint64_t dropped_by_gone_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace zerodrift::services
