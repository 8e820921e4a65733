// SPDX-License-Identifier: Apache-2.0
#include "common/replay/record_source.h"

#include <chrono>
#include <memory>
#include <stdexcept>
#include <vector>

#include "common/record/bag_files.h"
#include "common/record/record_reader.h"
#include "common/record/record_samples.h"

namespace zerodrift::replay {
namespace {

constexpr core::SensorTime kBlankEvery = std::chrono::seconds(1);

std::shared_ptr<record::RecordReader> open(const RecordSourceOptions& options,
                                           record::Rates rates) {
  if (options.record.file.empty())
    throw std::invalid_argument("--record: missing; a record source needs a file");
  record::RecordOptions how = options.record.options();
  how.rates = rates;
  how.preferred_gyro_id = options.preferred_gyro_id;
  return std::make_shared<record::RecordReader>(options.record.file, std::move(how));
}

// The part of a record that was asked for.
struct Span {
  explicit Span(const RecordSourceOptions& options, core::SensorTime first)
      : begin(options.from_s > 0.0 ? first + core::from_seconds(options.from_s) : core::kNever),
        end(options.to_s > 0.0 ? first + core::from_seconds(options.to_s)
                               : core::SensorTime::max()) {}
  core::SensorTime begin;
  core::SensorTime end;
};

core::ClockSource paced(core::ClockSource clock) {
  return core::is_paced_by_consumers(clock) ? clock : core::ClockSource::kReplay;
}

}  // namespace

GyroSource open_gyro_record(const RecordSourceOptions& options, const Warn& warn) {
  auto reader = open(options, record::Rates::kRequired);
  auto warned = std::make_shared<std::size_t>(0);
  const Span span(options, reader->info().first_time);
  return [=]() -> std::optional<GyroReading> {
    for (;;) {
      const record::RecordRow* row = reader->next();
      for (; *warned < reader->warnings().size(); ++*warned) warn(reader->warnings()[*warned]);
      if (row == nullptr || row->time >= span.end) return std::nullopt;
      if (row->time < span.begin) continue;
      GyroReading reading{std::nullopt, record::to_rate_reference(*row, reader->info())};
      if (record::brings_rate(*row)) {
        reading.rate = record::to_angular_rate(*row);
        reading.rate->clock = paced(reading.rate->clock);
      }
      if (reading.rate || reading.reference) return reading;
    }
  };
}

ThermalSource open_thermal_record(const RecordSourceOptions& options, const Warn& warn) {
  auto reader = open(options, record::Rates::kOptional);
  const std::vector<std::string> names = reader->info().probes;
  const core::EnvironmentChannels channels = reader->info().environment;
  if (names.empty()) {
    const std::uint32_t gyro = reader->info().gyro_id;
    const std::string missing = gyro != 0 ? "temperature of gyro " + std::to_string(gyro)
                                : record::is_mcap_record(options.record.file)
                                    ? "message of temperature"
                                    : "temperature column";
    warn(options.record.file + ": has no " + missing);
  }
  const Span span(options, reader->info().first_time);
  const std::size_t probes = names.size();
  const record::RecordRow* row = nullptr;
  std::size_t part = probes + 1;  // of the row: its probes, then its environment
  std::vector<core::SensorTime> spoken(probes + 1, core::kNever);
  // A blank cell says that time went on; once a second is enough of that.
  auto is_told = [spoken](std::size_t at, core::SensorTime time, bool measured) mutable {
    core::SensorTime& last = spoken[at];
    if (!measured && last != core::kNever && time - last < kBlankEvery) return true;
    last = time;
    return false;
  };
  const auto next = [=]() mutable -> std::optional<ThermalReading> {
    for (;;) {
      if (part > probes) {
        row = probes == 0 && channels == 0 ? nullptr : reader->next();
        part = 0;
        if (row == nullptr || row->time >= span.end) return std::nullopt;
      }
      const std::size_t at = part++;
      if (row->time < span.begin) continue;
      if (at == probes) {
        auto sample = record::to_environment(*row, reader->info());
        if (!sample || is_told(at, sample->time, core::is_any_measured(sample->values))) continue;
        sample->clock = paced(sample->clock);
        return *sample;
      }
      if (!record::brings_temperature(*row, at)) continue;
      core::TemperatureSample sample;
      record::to_temperature(*row, reader->info(), at, sample);
      if (is_told(at, sample.time, sample.measured)) continue;
      sample.clock = paced(sample.clock);
      return sample;
    }
  };
  return {.probes = names, .environment = channels, .next = next};
}

}  // namespace zerodrift::replay
