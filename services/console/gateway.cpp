// SPDX-License-Identifier: Apache-2.0
#include "services/console/gateway.h"

#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

#include "common/core/integer_time.h"
#include "common/core/mode.h"
#include "common/core/not_known.h"
#include "common/core/one_line.h"
#include "common/core/sequence_gap.h"
#include "common/dds/conversions.h"
#include "common/foxglove/schema.h"
#include "services/console/telemetry.h"

namespace zerodrift::services {

using foxglove::Delivery;
using Importance = web::Frame::Importance;

namespace {

constexpr std::size_t kEventsKept = 256;
constexpr std::size_t kRowsWaitBelowBytes = 1 << 20;  // a backlog is sent to who keeps up
constexpr std::int64_t kRestartNs = 10'000'000'000;   // a thermometer's clock that goes back so far
constexpr std::int64_t kLatestAnswerNs = 1'000'000'000;  // what is later makes no point of a curve
constexpr std::string_view kAllanMonitor = "allan_monitor";
constexpr std::string_view kGyroPublisher = "gyro_publisher:";
constexpr std::uint32_t kCompensated = 1;  // stream of an AllanReport
using core::kNaN;

template <typename Message>
web::Body encoded(const Message& message) {
  auto bytes = std::make_shared<std::string>();
  message.SerializeToString(bytes.get());
  return bytes;
}

template <typename Message>
foxglove::Schema schema() {
  return foxglove::schema_of(*Message::descriptor());
}

Delivery sample_delivery(std::int64_t unix_ns) {
  return {static_cast<std::uint64_t>(unix_ns), Importance::kSample, 0};
}

Delivery state_delivery(std::int64_t unix_ns, std::uint32_t latest_of = 0) {
  return {static_cast<std::uint64_t>(unix_ns), Importance::kState, latest_of};
}

thermal::TemperatureTrackOptions track_options() {
  thermal::TemperatureTrackOptions options;
  options.rate_method = thermal::RateMethod::kLocalPolynomial;
  return options;
}

std::uint32_t key(std::uint32_t axis, std::uint32_t stream) {
  return 1 + axis * 4 + stream;
}

}  // namespace

Gateway::Gateway(const GatewayOptions& options, foxglove::Hub& hub)
    : options_(options),
      hub_(hub),
      status_channel_(hub.add_channel("/service_status", schema<telemetry::ServiceStatus>())),
      event_channel_(hub.add_channel("/event", schema<telemetry::Event>())),
      gateway_channel_(hub.add_channel("/gateway", schema<telemetry::GatewayStatus>())),
      fleet_channel_(hub.add_channel("/fleet", schema<telemetry::Fleet>())),
      gyros_(options.most_gyros),
      statuses_(options.most_services) {}

Gateway::Gyro* Gateway::gyro(std::uint32_t id) {
  if (Gyro* known = gyros_.find(id)) return known;
  Gyro* made = gyros_.find_or_make(id, id, options_.history);
  if (made == nullptr) {
    ++left_out_;
    return nullptr;
  }
  add_channels(*made);
  return made;
}

void Gateway::add_channels(Gyro& gyro) {
  const std::string of = "/gyro_" + std::to_string(gyro.id) + '/';
  gyro.channels = {
      .rate = hub_.add_channel(of + std::string(dds::kCompensatedRate.name),
                               schema<telemetry::CompensatedRate>()),
      .samples = hub_.add_channel(of + "samples", schema<telemetry::SampleBatch>()),
      .history = hub_.add_channel(of + "history", schema<telemetry::History>()),
      .temperature = hub_.add_channel(of + "temperature", schema<telemetry::Temperature>()),
      .allan = hub_.add_channel(of + "allan", schema<telemetry::AllanReport>()),
      .navigation = hub_.add_channel(of + "navigation", schema<telemetry::NavigationState>()),
      .twin = hub_.add_channel(of + "twin", schema<telemetry::TwinReport>()),
      .coverage = hub_.add_channel(of + "coverage", schema<telemetry::ThermalCoverage>())};
}

// ---------------------------------------- what arrives

// A late answer fills a hole that was counted; a source that began anew makes none. An answer whose
// time is doubted comes in its place all the same. One whose number is doubted, far ahead of the
// others, makes a hole only if the next one in order goes on behind it.
void Gateway::count(Gyro& gyro, const msg::CompensatedRate& sample) const {
  const std::uint64_t sequence = sample.sequence_number();
  if (sample.order() != 0 && sequence < gyro.next_sequence) {
    if (gyro.missing > 0) --gyro.missing;
  } else if (sample.order() != 0 && gyro.next_sequence != 0 && sequence > gyro.next_sequence) {
    gyro.doubted_sequence = sequence;
  } else {
    if (gyro.next_sequence != 0 && sequence > gyro.next_sequence) {
      const std::uint64_t before = gyro.next_sequence - 1;
      const std::uint64_t doubted = gyro.doubted_sequence;
      const bool has_come = doubted > before && doubted < sequence;
      const std::uint64_t lost =
          has_come ? core::numbers_lost(before, doubted) + core::numbers_lost(doubted, sequence)
                   : core::numbers_lost(before, sequence);
      gyro.missing = core::saturating_sum(gyro.missing, lost);
    }
    gyro.doubted_sequence = 0;
    gyro.next_sequence = sequence + 1;
  }
  ++gyro.samples;
}

void Gateway::take(const msg::CompensatedRate& sample, const service::ArrivalClocks& arrival) {
  Gyro* from = gyro(sample.gyro_id());
  if (from == nullptr) return;
  count(*from, sample);
  // A page would take a time that is doubted for the newest one, or for a source that began anew.
  const std::int64_t behind_ns =
      core::saturating_difference(core::SensorTime{from->newest.sensor_time_ns()},
                                  core::SensorTime{sample.sensor_time_ns()})
          .count();
  const bool is_doubted = sample.order() != 0 && (behind_ns < 0 || behind_ns > kLatestAnswerNs);
  if (sample.order() == 0 || from->samples == 1) from->newest = sample;
  for (std::size_t i = 0; i < from->measured.size(); ++i)
    from->measured[i] = from->measured[i] || is_valid(sample, i);
  from->arrival = arrival;
  newest_sample_ = arrival;
  from->history.add(sample);
  if (hub_.has_subscriber(from->channels.rate)) {
    hub_.publish(from->channels.rate, sample_delivery(arrival.unix_ns),
                 encoded(to_telemetry(sample)));
  }
  if (!is_doubted && hub_.has_subscriber(from->channels.samples)) append(sample, from->batch);
}

void Gateway::take(const msg::RateReference& reference) {
  if (Gyro* from = gyro(reference.gyro_id())) from->history.add(reference);
}

void Gateway::take(const msg::Temperature& reading, std::int64_t unix_ns) {
  Gyro* from = gyro(reading.gyro_id());
  if (from == nullptr) return;
  const core::TemperatureSample sample = dds::from_message(reading);
  thermal::TemperatureTrack* track = from->tracks.find_or_make(sample.probe, track_options());
  if (track == nullptr) {
    ++left_out_;
    return;
  }
  const auto age = track->age(sample.time);
  if (age && age->count() < -kRestartNs) track->reset();
  const auto verdict = track->add(sample);
  if (verdict == thermal::ReadingVerdict::kOutOfOrder) return;
  const bool is_known = thermal::is_accepted(verdict);
  const auto rate = track->rate_degc_per_s();
  telemetry::Temperature out;
  set_time(*out.mutable_timestamp(), reading.sensor_time_ns());
  out.set_gyro_id(from->id);
  out.set_probe(core::one_line(sample.probe));
  out.set_temperature_degc(is_known ? sample.temperature_degc : kNaN);
  out.set_rate_degc_per_min(is_known && rate ? degc_per_min(*rate) : kNaN);
  from->history.add(out.probe(),
                    {reading.sensor_time_ns(), out.temperature_degc(), out.rate_degc_per_min()});
  if (hub_.has_subscriber(from->channels.temperature))
    hub_.publish(from->channels.temperature, sample_delivery(unix_ns), encoded(out));
}

void Gateway::take(const msg::AllanReport& report, std::int64_t unix_ns) {
  Gyro* from = gyro(report.gyro_id());
  if (from == nullptr || report.axis() > 2 || report.stream() > 1) return;
  auto& kept = allan_[{report.gyro_id(), report.axis(), report.stream()}] = to_telemetry(report);
  if (hub_.has_subscriber(from->channels.allan)) {
    hub_.publish(from->channels.allan, state_delivery(unix_ns, key(report.axis(), report.stream())),
                 encoded(kept));
  }
}

void Gateway::take(const msg::NavigationState& state, std::int64_t unix_ns) {
  Gyro* from = gyro(state.gyro_id());
  if (from != nullptr && hub_.has_subscriber(from->channels.navigation)) {
    hub_.publish(from->channels.navigation, sample_delivery(unix_ns), encoded(to_telemetry(state)));
  }
}

void Gateway::take(const msg::TwinReport& report, std::int64_t unix_ns) {
  Gyro* from = gyro(report.gyro_id());
  if (from == nullptr || report.axis() > 2) return;
  auto& kept = twins_[{report.gyro_id(), report.axis()}] = to_telemetry(report);
  if (hub_.has_subscriber(from->channels.twin)) {
    hub_.publish(from->channels.twin, state_delivery(unix_ns, key(report.axis(), 0)),
                 encoded(kept));
  }
}

void Gateway::take(const msg::ThermalCoverage& coverage, std::int64_t unix_ns) {
  Gyro* from = gyro(coverage.gyro_id());
  if (from == nullptr) return;
  from->coverage = to_telemetry(coverage);
  if (hub_.has_subscriber(from->channels.coverage))
    hub_.publish(from->channels.coverage, state_delivery(unix_ns), encoded(*from->coverage));
}

void Gateway::take(const msg::ServiceStatus& status, const WriterId& writer,
                   const service::ArrivalClocks& arrival) {
  telemetry::ServiceStatus said = to_telemetry(status, arrival.unix_ns);
  const std::string name = said.service();
  telemetry::ServiceStatus* newest = place_of(name);
  if (newest == nullptr) {
    ++left_out_;
    return;
  }
  writers_.note(writer, name);
  *newest = std::move(said);
  // One that never gave a sample is a gyro too.
  const auto id = service::gyro_told_of(name);
  Gyro* told_of = id ? gyro(*id) : nullptr;
  if (told_of != nullptr && told_of->published_since_ns == 0 && name.starts_with(kGyroPublisher))
    told_of->published_since_ns = arrival.monotonic_ns;
  publish_status(name, arrival.unix_ns);
}

// Where all places are taken, a new service has that of the one that is gone the longest, with its
// key: what waits for a slow client of the old one is replaced by what the new one says.
telemetry::ServiceStatus* Gateway::place_of(const std::string& service) {
  if (telemetry::ServiceStatus* place = statuses_.find_or_make(service)) {
    status_keys_.try_emplace(service, static_cast<std::uint32_t>(status_keys_.size() + 1));
    return place;
  }
  auto& all = statuses_.entries();
  auto gone = all.end();
  for (auto at = all.begin(); at != all.end(); ++at) {
    const auto& [name, status] = *at;
    if (status.alive()) continue;
    if (gone == all.end() || time_ns(status.timestamp()) < time_ns(gone->second.timestamp()))
      gone = at;
  }
  if (gone == all.end()) return nullptr;
  auto key = status_keys_.extract(gone->first);
  key.key() = service;
  status_keys_.insert(std::move(key));
  all.erase(gone);
  return statuses_.find_or_make(service);
}

void Gateway::take_gone(const WriterId& writer, std::int64_t unix_ns) {
  for (const std::string& name : writers_.take_gone(writer)) {
    telemetry::ServiceStatus* status = statuses_.find(name);
    if (status == nullptr) continue;  // it had said that it stops, and another one has its place
    status->set_alive(false);
    if (name == kAllanMonitor) allan_.clear();  // nobody judges any more whether it harms
    publish_status(name, unix_ns);
  }
}

void Gateway::publish_status(const std::string& service, std::int64_t unix_ns) {
  if (!hub_.has_subscriber(status_channel_)) return;
  hub_.publish(status_channel_, state_delivery(unix_ns, status_keys_[service]),
               encoded(statuses_.entries().at(service)));
}

void Gateway::take(const msg::Event& event, std::int64_t unix_ns) {
  events_.push_back(to_telemetry(event));
  if (events_.size() > kEventsKept) events_.pop_front();
  if (hub_.has_subscriber(event_channel_))
    hub_.publish(event_channel_, state_delivery(unix_ns), encoded(events_.back()));
}

// ---------------------------------------- what goes out

void Gateway::flush(Gyro& gyro, std::int64_t unix_ns) {
  if (gyro.batch.sensor_time_ns_size() > 0) {
    set_newest(gyro.newest, gyro.arrival, gyro.batch);
    gyro.batch.set_missing(gyro.missing);
    hub_.publish(gyro.channels.samples, sample_delivery(gyro.arrival.unix_ns), encoded(gyro.batch));
    gyro.batch.Clear();
  }
  flush_rows(gyro, unix_ns);
}

bool Gateway::waits_for_backlog(foxglove::ClientId client, foxglove::ChannelId channel) const {
  const std::pair waits{client, channel};
  return std::find(late_comers_.begin(), late_comers_.end(), waits) != late_comers_.end();
}

// Not to who waits for the backlog, which will hold them.
void Gateway::flush_rows(Gyro& gyro, std::int64_t unix_ns) {
  const foxglove::ChannelId channel = gyro.channels.history;
  if (!hub_.has_subscriber(channel)) return gyro.history.forget_new();
  const auto rows = gyro.history.take_new();
  if (!rows) return;
  const web::Body body = encoded(*rows);
  hub_.for_each_client([&](web::Client& client) {
    if (!waits_for_backlog(client.id(), channel))
      hub_.publish_to(client.id(), channel, state_delivery(unix_ns), body);
  });
}

void Gateway::flush(std::int64_t unix_ns) {
  is_watched_ = false;
  for (auto& [id, gyro] : gyros_.entries()) {
    flush(gyro, unix_ns);
    is_watched_ = is_watched_ || hub_.has_subscriber(gyro.channels.samples) ||
                  hub_.has_subscriber(gyro.channels.rate);
  }
  // Who is busy with what it has already is asked again.
  auto waiting = std::exchange(late_comers_, {});
  std::set<foxglove::ClientId> served;
  for (const auto& [client, channel] : waiting) {
    const web::Client* link = hub_.client(client);
    if (link == nullptr || !hub_.is_subscribed(client, channel)) continue;
    if (link->counts().bytes_waiting > kRowsWaitBelowBytes || served.contains(client)) {
      late_comers_.emplace_back(client, channel);
      continue;
    }
    for (const auto& [id, gyro] : gyros_.entries()) {
      if (gyro.channels.history != channel) continue;
      hub_.publish_to(client, channel, state_delivery(unix_ns), encoded(gyro.history.backlog()));
      served.insert(client);
    }
  }
}

// The rows of hours are sent by flush(), which looks whether the client keeps up.
void Gateway::subscribed(foxglove::ClientId client, foxglove::ChannelId channel) {
  const std::int64_t unix_ns = std::max<std::int64_t>(newest_sample_.unix_ns, 0);
  if (channel == status_channel_) {
    for (const auto& [name, status] : statuses_.entries()) {
      hub_.publish_to(client, channel,
                      state_delivery(time_ns(status.timestamp()), status_keys_[name]),
                      encoded(status));
    }
    return;
  }
  if (channel == event_channel_) {
    for (const auto& event : events_) {
      hub_.publish_to(client, channel, state_delivery(time_ns(event.timestamp())), encoded(event));
    }
    return;
  }
  for (const auto& [id, gyro] : gyros_.entries()) {
    if (channel == gyro.channels.history) {
      if (!waits_for_backlog(client, channel)) late_comers_.emplace_back(client, channel);
    } else if (channel == gyro.channels.allan) {
      for (const auto& [which, report] : allan_) {
        const auto& [of, axis, stream] = which;
        if (of == id)
          hub_.publish_to(client, channel, state_delivery(unix_ns, key(axis, stream)),
                          encoded(report));
      }
    } else if (channel == gyro.channels.twin) {
      for (const auto& [which, report] : twins_) {
        const auto& [of, axis] = which;
        if (of == id)
          hub_.publish_to(client, channel, state_delivery(report.wall_time_ns(), key(axis, 0)),
                          encoded(report));
      }
    } else if (channel == gyro.channels.coverage) {
      if (gyro.coverage)
        hub_.publish_to(client, channel, state_delivery(unix_ns), encoded(*gyro.coverage));
    } else if (channel == gyro.channels.samples || channel == gyro.channels.rate) {
      is_watched_ = true;
    }
  }
}

std::uint64_t Gateway::dropped_of_all() const {
  std::uint64_t dropped = dropped_by_gone_;
  hub_.for_each_client([&](web::Client& client) { dropped += client.counts().frames_dropped; });
  return dropped;
}

void Gateway::report_gateway(const std::vector<dds::RemoteEndpoint>& endpoints,
                             std::int64_t unix_ns) {
  if (!hub_.has_subscriber(gateway_channel_)) return;
  telemetry::GatewayStatus status;
  set_time(*status.mutable_timestamp(), unix_ns);
  status.set_version(options_.version);
  status.set_domain(options_.domain);
  status.set_clients(static_cast<std::uint32_t>(hub_.clients()));
  status.set_dropped_of_all(dropped_of_all());
  for (const auto& endpoint : endpoints) *status.add_endpoints() = to_telemetry(endpoint);
  hub_.for_each_client([&](web::Client& client) {
    if (!hub_.is_subscribed(client.id(), gateway_channel_)) return;
    const auto counts = client.counts();
    status.set_frames_sent(counts.frames_sent);
    status.set_frames_dropped(counts.frames_dropped);
    status.set_queue_fill(counts.queue_fill);
    hub_.publish_to(client.id(), gateway_channel_, state_delivery(unix_ns, 1), encoded(status));
  });
}

telemetry::GyroSummary Gateway::summary(const Gyro& gyro, std::int64_t monotonic_ns) const {
  telemetry::GyroSummary out;
  const std::int64_t age_ns = monotonic_ns - gyro.arrival.monotonic_ns;
  out.set_gyro_id(gyro.id);
  out.set_age_s(static_cast<double>(std::max<std::int64_t>(age_ns, 0)) * 1e-9);
  out.set_sensor_time_ns(gyro.newest.sensor_time_ns());
  out.set_sample_interval_s(gyro.newest.interval_s());
  out.set_validity(gyro.newest.validity());
  out.set_missing(gyro.missing);
  out.set_block_s(static_cast<double>(RateComparison::kBlockS));
  for (std::uint32_t i = 0; i < 3; ++i) {
    auto& axis = *out.add_axes();
    const bool moves = static_cast<core::Reason>(gyro.newest.reason()[i]) == core::Reason::kMotion;
    *axis.mutable_state() = axis_state(gyro.newest, i);
    *axis.mutable_comparison() = gyro.history.comparison(i, moves);
    const auto report = allan_.find({gyro.id, i, kCompensated});
    axis.set_worse_than_raw(report != allan_.end() && report->second.worse_than_raw());
  }
  return out;
}

void Gateway::report_fleet(const service::ArrivalClocks& now) {
  if (!hub_.has_subscriber(fleet_channel_)) return;
  telemetry::Fleet fleet;
  set_time(*fleet.mutable_timestamp(), now.unix_ns);
  for (const auto& [id, gyro] : gyros_.entries())
    if (gyro.samples > 0) *fleet.add_gyros() = summary(gyro, now.monotonic_ns);
  hub_.publish(fleet_channel_, state_delivery(now.unix_ns, 1), encoded(fleet));
}

service::ArrivalClocks Gateway::newest_sample_of(std::uint32_t gyro) const {
  const auto known = gyros_.entries().find(gyro);
  return known != gyros_.entries().end() ? known->second.arrival : service::ArrivalClocks{};
}

std::map<std::uint32_t, Gateway::GyroFigures> Gateway::gyro_figures() const {
  std::map<std::uint32_t, GyroFigures> all;
  for (const auto& [id, gyro] : gyros_.entries()) {
    if (gyro.samples > 0) {
      const bool has_any = gyro.measured != core::PerAxis<bool>{};
      all[id] = {.samples = gyro.samples,
                 .missing = gyro.missing,
                 .newest_monotonic_ns = gyro.arrival.monotonic_ns,
                 .newest = to_telemetry(gyro.newest),
                 .measured = has_any ? gyro.measured : core::PerAxis<bool>{true, true, true}};
    } else if (gyro.published_since_ns != 0) {
      all[id].newest_monotonic_ns = gyro.published_since_ns;
    }
  }
  return all;
}

}  // namespace zerodrift::services
