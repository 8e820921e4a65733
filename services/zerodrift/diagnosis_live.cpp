// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/diagnosis_live.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <thread>
#include <utility>

#include "common/dds/conversions.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::services {
namespace {

constexpr const char* kName = "diagnose";
constexpr const char* kRateStream = "rates";
constexpr const char* kTrueRateStream = "true rates";
constexpr std::uint64_t kProgressEvery = 32;  // samples between two progress reports
// Ticks of 0.25 s: temperatures of the last rates are waited for.
constexpr int kTicksForTheRest = 8;

// With so many rates waiting a replay is kept from sending more, so that what is behind comes.
constexpr std::size_t kMostWaiting = measurement::LiveRowsOptions{}.most_waiting / 2;

record::BoundColumn column_of(record::Channel channel, std::size_t slot = 0) {
  record::BoundColumn column;
  column.header = record::column_name(channel);
  column.role = record::ColumnRole::kValue;
  column.channel = std::move(channel);
  column.slot = slot;
  return column;
}

void note(std::vector<std::string>& warnings, const std::string& name, std::uint64_t count,
          const std::string& what) {
  if (count > 0) warnings.push_back(name + ": " + std::to_string(count) + " " + what);
}

}  // namespace

std::string live_name(std::uint32_t gyro_id) {
  return "gyro " + std::to_string(gyro_id) + " live";
}

LiveDiagnosis::LiveDiagnosis(const DiagnosisRequest& request, const LiveOptions& options)
    : request_(request),
      options_(options),
      host_(kName, options.network),
      report_writer_(host_.participant(), host_.observer()),
      reference_reader_(
          host_.participant(),
          [this](const msg::RateReference& m, const dds::SampleOrigin& o) { on_companion(m, o); },
          host_.observer(), [this](const auto& writer, dds::Departure) { note_left(writer); }),
      temperature_reader_(
          host_.participant(),
          [this](const msg::Temperature& m, const dds::SampleOrigin& o) { on_companion(m, o); },
          host_.observer(),
          [this](const auto& writer, dds::Departure) { note_companion_left(writer); }),
      environment_reader_(
          host_.participant(),
          [this](const msg::Environment& m, const dds::SampleOrigin& o) { on_companion(m, o); },
          host_.observer(),
          [this](const auto& writer, dds::Departure) { note_companion_left(writer); }),
      rate_reader_(
          host_.participant(),
          [this](const msg::AngularRate& m, const dds::SampleOrigin& o) { on_rate(m, o); },
          host_.observer(), [this](const auto& writer, dds::Departure) { note_left(writer); }) {
  request_.record.file = live_name(options.gyro_id);
  // Made-up names of thermometers take no place from these.
  const std::lock_guard lock(publisher_mutex_);
  for (const char* stream : {kRateStream, kTrueRateStream}) streams_.find_or_make(stream);
}

// ---------------------------------------- samples

// One publisher a stream, so that two are never mixed; another one once the first is gone.
bool LiveDiagnosis::follows(const std::string& stream, const dds::SampleOrigin& origin) {
  const std::lock_guard lock(publisher_mutex_);
  Stream* known = streams_.find_or_make(stream);
  if (known == nullptr) return true;  // the rows refuse what is too much
  if (!known->publisher) known->publisher = origin.writer;
  if (known->publisher == origin.writer) return true;
  ++known->rejected;
  return false;
}

void LiveDiagnosis::note_left(const eprosima::fastrtps::rtps::GUID_t& writer) {
  const std::lock_guard lock(publisher_mutex_);
  for (auto& [name, stream] : streams_.entries()) {
    if (stream.publisher == writer) stream.publisher.reset();
  }
}

void LiveDiagnosis::note_companion_left(const eprosima::fastrtps::rtps::GUID_t& writer) {
  companion_left_ = true;
  note_left(writer);
}

bool LiveDiagnosis::keep_followed(core::RateReferenceSample& sample,
                                  const dds::SampleOrigin& origin) {
  return core::is_true_rate(sample.kind) && follows(kTrueRateStream, origin);
}

bool LiveDiagnosis::keep_followed(core::TemperatureSample& sample,
                                  const dds::SampleOrigin& origin) {
  return follows("temperatures of " + sample.probe, origin);
}

bool LiveDiagnosis::keep_followed(core::EnvironmentSample& sample,
                                  const dds::SampleOrigin& origin) {
  for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
    if (core::has_channel(sample.channels, i) &&
        !follows("readings of " + record::name(record::environment_channel(i)), origin))
      sample.channels &= ~(1U << i);
  }
  return sample.channels != 0;
}

void LiveDiagnosis::on_rate(const msg::AngularRate& message, const dds::SampleOrigin& origin) {
  if (message.gyro_id() != options_.gyro_id) return;
  if (!follows(kRateStream, origin)) return;
  const auto sample = dds::from_message(message);
  const std::lock_guard lock(mutex_);
  paced_ = core::is_paced_by_consumers(sample.clock);
  newest_sequence_ = sample.sequence;
  // Also of what comes after the watch: whoever replays must not wait for it.
  if (paced_ && ++received_ % kProgressEvery == 0) report_progress();
  if (phase_ != Phase::kListening || over_) return;
  if (!first_) first_ = sample.time;
  if (core::seconds(sample.time - *first_) >= options_.duration_s) {
    over_ = true;
  } else {
    newest_ = std::max(newest_, sample.time);
    rows_.push(sample);
  }
  drain();
}

template <typename Message>
void LiveDiagnosis::on_companion(const Message& message, const dds::SampleOrigin& origin) {
  if (message.gyro_id() != options_.gyro_id) return;
  auto sample = dds::from_message(message);
  if (!keep_followed(sample, origin)) return;
  const std::lock_guard lock(mutex_);
  if (phase_ != Phase::kListening) return;
  rows_.push(sample);
  drain();
}

void LiveDiagnosis::drain() {
  add_ready_rows();
  if (over_ && rows_.waiting() == 0) complete();
}

void LiveDiagnosis::add_ready_rows() {
  try {
    while (const record::RecordRow* row = rows_.next()) {
      if (!builder_) builder_.emplace(columns());
      builder_->add(*row);
    }
  } catch (const std::exception& error) {
    failure_ = error.what();
    complete();
  }
}

void LiveDiagnosis::complete() {
  if (phase_ != Phase::kListening) return;
  phase_ = Phase::kComplete;
  service::request_stop();
}

// Temperatures are needed up to the newest rate, so that those of a replay come.
void LiveDiagnosis::report_progress() {
  if (rows_.waiting() < kMostWaiting) taken_sequence_ = newest_sequence_;
  if (progress_) progress_->report(options_.gyro_id, taken_sequence_, newest_);
}

measurement::MeasuredColumns LiveDiagnosis::columns() const {
  measurement::MeasuredColumns columns{.file = request_.record.file,
                                       .probes = rows_.probes(),
                                       .has_reference = rows_.has_reference(),
                                       .sample_period_s = rows_.sample_period_s(),
                                       .source = measurement::ColumnSource::kLive};
  const auto& wanted = request_.axes;
  for (const auto axis : core::kAxes) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), axis) == wanted.end()) continue;
    columns.columns.push_back(column_of({record::Quantity::kRate, axis, {}}));
  }
  for (const auto axis : core::kAxes) {
    if (!rows_.has_reference()) break;
    columns.columns.push_back(column_of({record::Quantity::kReference, axis, {}}));
  }
  for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
    if (core::has_channel(rows_.environment(), i))
      columns.columns.push_back(column_of(record::environment_channel(i)));
  }
  for (std::size_t p = 0; p < rows_.probes().size(); ++p) {
    columns.columns.push_back(
        column_of({record::Quantity::kTemperature, core::Axis::kX, rows_.probes()[p]}, p));
  }
  return columns;
}

measurement::MeasuredRecord LiveDiagnosis::finish() {
  const std::lock_guard lock(mutex_);
  phase_ = Phase::kDiagnosing;
  rows_.finish();
  add_ready_rows();
  if (!failure_.empty()) throw std::invalid_argument(failure_);
  if (!builder_) {
    throw std::invalid_argument(request_.record.file + ": found no angular_rate in domain " +
                                std::to_string(options_.network.domain) +
                                ", expected a publisher of gyro id " +
                                std::to_string(options_.gyro_id) + " (--gyro-id, --domain)");
  }
  measurement::MeasuredRecord measured = builder_->finish();
  builder_.reset();
  const measurement::LiveCounts& counts = rows_.counts();
  const auto warn = [&](std::uint64_t count, const std::string& what) {
    note(measured.warnings, request_.record.file, count, what);
  };
  warn(counts.rates_refused, "rates left out: a time stamp not after the one before, or wild");
  warn(counts.readings_refused,
       "temperatures or readings of the environment left out: a time stamp not after the one "
       "before, or wild");
  warn(counts.readings_lost,
       "temperatures or readings of the environment left out: they came after the rates of their "
       "time, or more at once than can wait");
  warn(counts.late_probes, "temperatures of probes first received after the start left out");
  warn(counts.late_channels, "readings of the environment first received after the start left out");
  warn(counts.late_references, "true rates left out: the first came after the start");
  warn(counts.without_reference, "rates left out: nobody published the true rate");
  const std::lock_guard publisher_lock(publisher_mutex_);
  for (const auto& [name, stream] : streams_.entries())
    warn(stream.rejected, name + " of a second publisher with this id left out");
  return measured;
}

// ---------------------------------------- run

// Whoever announces itself before it is matched with all that is there misses the first samples.
// Without the lock: the middleware makes no endpoint while a sample's callback waits for it.
void LiveDiagnosis::announce_once_discovered() {
  if (progress_) return;
  const int rates = rate_reader_.matched();
  const int others =
      temperature_reader_.matched() + environment_reader_.matched() + reference_reader_.matched();
  const bool is_complete =
      discovery_.note(host_.participant().acquaintance(), rates + others, service::monotonic_ns());
  if (!is_complete || rates == 0) return;
  auto progress = std::make_unique<service::ReplayProgressReporter>(host_.participant(), kName);
  const std::lock_guard lock(mutex_);
  progress_ = std::move(progress);
}

void LiveDiagnosis::tick() {
  announce_once_discovered();
  const std::lock_guard lock(mutex_);
  // A replay is not kept waiting for somebody who has left.
  if (companion_left_ && phase_ == Phase::kListening && rows_.waiting() >= kMostWaiting) {
    companion_left_ = false;
    rows_.stop_waiting();
    drain();
  }
  if (paced_) report_progress();
  if (phase_ == Phase::kListening) {
    over_ = over_ || (paced_ && rate_reader_.matched() == 0);
    if (over_ && ++ticks_over_ > kTicksForTheRest) complete();
  }
  if (phase_ != Phase::kDone) return;
  if (finding_) {
    host_.raise(finding_->event);
    for (msg::TwinReport& report : finding_->reports) report_writer_.write(report);
    finding_.reset();
  } else {
    service::request_stop();
  }
}

service::Status LiveDiagnosis::status() {
  const std::lock_guard lock(mutex_);
  const double listened_s = first_ ? core::seconds(newest_ - *first_) : 0.0;
  const bool listening = phase_ == Phase::kListening || phase_ == Phase::kComplete;
  return {.state = first_ ? service::State::kRunning : service::State::kWaiting,
          .summary = listening ? "listening to gyro " + std::to_string(options_.gyro_id)
                               : "diagnosing gyro " + std::to_string(options_.gyro_id),
          .metrics = {{"listened", "s", listened_s},
                      {"wanted", "s", options_.duration_s},
                      {"waiting", "1", static_cast<double>(rows_.waiting())}}};
}

void LiveDiagnosis::run(const std::function<void(const DiagnosisResult&)>& take) {
  host_.run([this] { return status(); }, [this] { tick(); });
  const measurement::MeasuredRecord record = finish();
  std::exception_ptr error;
  std::thread worker([&] {
    try {
      const DiagnosisResult result = run_diagnosis(request_, record);
      take(result);
      const std::lock_guard lock(mutex_);
      finding_ = finding(result, options_.gyro_id, newest_.count(), service::unix_time_ns());
    } catch (...) {
      error = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    phase_ = Phase::kDone;
  });
  host_.run([this] { return status(); }, [this] { tick(); });
  {
    const std::lock_guard lock(mutex_);
    if (phase_ != Phase::kDone) {
      std::fputs("diagnose: stopped before the diagnosis was done\n", stderr);
      std::_Exit(service::kExitNo);
    }
  }
  worker.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace zerodrift::services
