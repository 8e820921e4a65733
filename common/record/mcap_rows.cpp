// SPDX-License-Identifier: Apache-2.0
#include "common/record/mcap_rows.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/files/file_error.h"
#include "common/mcap/mcap_error.h"
#include "common/record/csv_cells.h"
#include "common/record/decimal_time.h"

namespace zerodrift::record {
namespace {

// Messages are known by their type, whatever the topic was called.
constexpr std::string_view kRateType = "zerodrift::msg::AngularRate";
constexpr std::string_view kTemperatureType = "zerodrift::msg::Temperature";
constexpr std::string_view kReferenceType = "zerodrift::msg::RateReference";
constexpr std::string_view kEncoding = "cdr";
constexpr std::size_t kRatesAhead = 1001;  // to tell the period and the axes
constexpr std::size_t kStepsForPeriod = 100;

// Empty where the file doesn't say it, or the messages are in another encoding.
std::string_view type_of(const mcap::Contents& contents, const mcap::Channel& channel) {
  const mcap::Schema* schema = contents.schema(channel.schema_id);
  return schema != nullptr && channel.message_encoding == kEncoding ? schema->name
                                                                    : std::string_view{};
}

std::optional<std::uint32_t> number(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

template <typename Value>
void add_once(std::vector<Value>& values, const Value& value) {
  if (std::find(values.begin(), values.end(), value) == values.end()) values.push_back(value);
}

std::string list_of(const std::set<std::uint32_t>& gyros) {
  constexpr std::size_t kMostListed = 16;
  std::string text;
  std::size_t listed = 0;
  for (const auto gyro : gyros) {
    if (++listed > kMostListed)
      return text + " and " + std::to_string(gyros.size() - kMostListed) + " more";
    text += (text.empty() ? "" : ", ") + std::to_string(gyro);
  }
  return text;
}

// From an earlier time to a later one; any stamps, also those no clock ever showed.
double seconds_between(core::SensorTime earlier, core::SensorTime later) {
  core::SensorTime::rep step = 0;
  if (__builtin_sub_overflow(later.count(), earlier.count(), &step))
    return core::seconds(core::SensorTime::max());
  return core::seconds(core::SensorTime{step});
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Nobody's true rate: what a filter knows of the drift, or that the vehicle rests.
bool is_true_rate(core::ReferenceKind kind) {
  return kind == core::ReferenceKind::kRateTable || kind == core::ReferenceKind::kRecord;
}

std::string axis_column(std::string_view quantity, core::Axis axis) {
  return std::string(quantity) + "_" + std::string(core::name(axis)) + "_rad_s";
}

}  // namespace

template <typename Sample>
class McapRows::Stream {
 public:
  using Decode = std::optional<OfGyro<Sample>> (*)(std::string_view);

  // `probe`: empty, or the only one that is wanted.
  Stream(mcap::Reader& reader, std::string_view type, std::uint32_t gyro_id, std::string probe,
         Decode decode)
      : cursor_(reader), gyro_id_(gyro_id), probe_(std::move(probe)), decode_(decode) {
    for (const auto& channel : reader.contents().channels) {
      const std::string_view gyro = mcap::value_of(channel.metadata, "gyro_id");
      const std::string_view of_probe = mcap::value_of(channel.metadata, "probe");
      if (type_of(reader.contents(), channel) != type) continue;
      if (!gyro.empty() && number(gyro) != gyro_id) continue;
      if (!of_probe.empty() && !probe_.empty() && of_probe != probe_) continue;
      channels_.push_back(channel.id);
    }
    if (!channels_.empty()) advance();
  }

  [[nodiscard]] const std::optional<Sample>& head() const { return head_; }
  std::optional<Sample> take() {
    std::optional<Sample> taken = std::move(head_);
    advance();
    return taken;
  }

 private:
  void advance() {
    head_.reset();
    for (mcap::Message message; cursor_.next(message);) {
      if (std::find(channels_.begin(), channels_.end(), message.channel_id) == channels_.end())
        continue;
      auto decoded = decode_(message.data);
      if (!decoded || decoded->gyro_id != gyro_id_) continue;
      if constexpr (requires { decoded->sample.probe; }) {
        if (decoded->sample.probe != probe_) continue;
      }
      head_ = std::move(decoded->sample);
      return;
    }
  }

  mcap::Cursor cursor_;
  std::uint32_t gyro_id_;
  std::string probe_;
  Decode decode_;
  std::vector<std::uint16_t> channels_;
  std::optional<Sample> head_;
};

struct McapRows::Streams {
  Stream<core::AngularRateSample> rates;
  Stream<core::RateReferenceSample> references;
  std::vector<Stream<core::TemperatureSample>> probes;
};

McapRows::~McapRows() = default;

McapRows::McapRows(const std::filesystem::path& path, const RecordOptions& options)
    : time_order_(options.time_order) {
  info_.path = path;
  try {
    reader_ = std::make_shared<mcap::Reader>(path);
    choose_gyro(options);
    streams_ = make_streams();
    look_ahead();
  } catch (const mcap::McapError& error) {
    throw files::FileError(error.what());
  }
  info_.warnings = take_warnings();
  if (!options.columns.empty())
    throw files::FileError(path.string() + ": is an MCAP file, which --columns says nothing of");
  row_.temperature_degc.assign(info_.probes.size(), kNotMeasured);
  recorded_.temperatures.resize(info_.probes.size());
  row_.recorded = &recorded_;
}

// Recorders of this project say in a channel's metadata whose messages it holds; of others' files
// every message is looked at.
void McapRows::choose_gyro(const RecordOptions& options) {
  bool all_say_so = true;
  for (const auto& channel : reader_->contents().channels) {
    const std::string_view type = type_of(reader_->contents(), channel);
    const bool is_rate = type == kRateType;
    if (!is_rate && type != kTemperatureType) continue;
    const auto gyro = number(mcap::value_of(channel.metadata, "gyro_id"));
    const std::string probe(mcap::value_of(channel.metadata, "probe"));
    all_say_so = all_say_so && gyro && (is_rate || !probe.empty());
    if (gyro && is_rate) gyros_.insert(*gyro);
    if (gyro && !is_rate) add({*gyro, probe});
  }
  if (!all_say_so) scan_for_keys();
  const std::string file = info_.path.string();
  if (gyros_.empty()) {
    std::vector<std::string> topics;
    for (const auto& channel : reader_->contents().channels) add_once(topics, channel.topic);
    std::string names;
    for (const auto& topic : topics) names += (names.empty() ? "" : ", ") + printable(topic);
    throw files::FileError(file +
                           ": has no message of angular_rate, of which a record is made; found " +
                           (names.empty() ? "none at all" : names));
  }
  const auto is_there = [&](std::uint32_t gyro) { return gyros_.contains(gyro); };
  if (options.gyro_id) {
    if (!is_there(*options.gyro_id)) {
      throw files::FileError(file + ": has no gyro " + std::to_string(*options.gyro_id) +
                             ", expected --gyro-id to be one of " + list_of(gyros_));
    }
    info_.gyro_id = *options.gyro_id;
  } else if (gyros_.size() == 1) {
    info_.gyro_id = *gyros_.begin();
  } else if (options.preferred_gyro_id && is_there(*options.preferred_gyro_id)) {
    info_.gyro_id = *options.preferred_gyro_id;
  } else {
    throw files::FileError(file + ": holds gyros " + list_of(gyros_) + "; choose one by --gyro-id");
  }
  for (const auto& [gyro, probe] : thermometers_) {
    if (gyro == info_.gyro_id) info_.probes.push_back(probe);
  }
}

void McapRows::scan_for_keys() {
  gyros_.clear();
  thermometers_.clear();
  seen_.clear();
  mcap::Cursor cursor(*reader_);
  for (mcap::Message message; cursor.next(message);) {
    const mcap::Contents& contents = reader_->contents();
    const std::string_view type = type_of(contents, *contents.channel(message.channel_id));
    if (type == kRateType) {
      if (const auto rate = decode_angular_rate(message.data)) gyros_.insert(rate->gyro_id);
    } else if (type == kTemperatureType) {
      if (const auto reading = decode_temperature(message.data))
        add({reading->gyro_id, reading->sample.probe});
    }
  }
}

std::unique_ptr<McapRows::Streams> McapRows::make_streams() {
  const auto rate = [](std::string_view payload) { return decode_angular_rate(payload); };
  const auto reference = [](std::string_view payload) { return decode_rate_reference(payload); };
  const auto gyro = info_.gyro_id;
  auto streams = std::make_unique<Streams>(
      Streams{Stream<core::AngularRateSample>(*reader_, kRateType, gyro, "", rate),
              Stream<core::RateReferenceSample>(*reader_, kReferenceType, gyro, "", reference),
              {}});
  for (const auto& probe : info_.probes)
    streams->probes.emplace_back(*reader_, kTemperatureType, gyro, probe, &decode_temperature);
  return streams;
}

// Through streams of its own, so that the rows are before the first one.
void McapRows::look_ahead() {
  Stream<core::AngularRateSample> rates(
      *reader_, kRateType, info_.gyro_id, "",
      [](std::string_view payload) { return decode_angular_rate(payload); });
  if (!rates.head())
    throw files::FileError(info_.path.string() + ": no message of gyro " +
                           std::to_string(info_.gyro_id) + " can be read");
  info_.first_time = rates.head()->time;
  info_.first_interval_s = rates.head()->interval_s;
  std::vector<double> steps_s;
  std::optional<core::SensorTime> previous;
  for (std::size_t i = 0; i < kRatesAhead && rates.head(); ++i) {
    const auto sample = rates.take();
    for (std::size_t axis = 0; axis < core::kAxisCount; ++axis)
      info_.has_rate[axis] = info_.has_rate[axis] || sample->valid[axis];
    if (previous && sample->time > *previous && steps_s.size() < kStepsForPeriod)
      steps_s.push_back(seconds_between(*previous, sample->time));
    previous = sample->time;
  }
  if (info_.has_rate == core::PerAxis<bool>{}) info_.has_rate.fill(true);
  info_.sample_period_s = median(std::move(steps_s));
  const auto& reference = streams_->references.head();
  if (reference && is_true_rate(reference->kind)) info_.has_reference = reference->valid;

  info_.columns = {"time_s"};
  for (const auto axis : core::kAxes) {
    if (info_.has_rate[core::index(axis)]) info_.columns.push_back(axis_column("rate", axis));
  }
  for (const auto axis : core::kAxes) {
    if (info_.has_reference[core::index(axis)])
      info_.columns.push_back(axis_column("reference", axis));
  }
  for (const auto& probe : info_.probes) info_.columns.push_back("temperature_" + probe + "_degC");
  for (const auto& metadata : reader_->contents().metadata) {
    if (metadata.name != "recording") continue;
    info_.metadata.insert(info_.metadata.end(), metadata.values.begin(), metadata.values.end());
  }
}

const RecordRow* McapRows::next() {
  try {
    while (streams_->rates.head()) {
      core::SensorTime time = streams_->rates.head()->time;
      const auto& reference = streams_->references.head();
      if (reference) time = std::min(time, reference->time);
      for (const auto& probe : streams_->probes) {
        if (probe.head()) time = std::min(time, probe.head()->time);
      }
      fill(time);
      if (!is_in_order(time)) continue;
      row_.index = rows_++;
      row_.time = time;
      row_.interval_s = previous_time_ && time > *previous_time_
                            ? seconds_between(*previous_time_, time)
                            : (previous_time_ ? 0.0 : info_.sample_period_s);
      previous_time_ = time;
      return &row_;
    }
  } catch (const mcap::McapError& error) {
    throw files::FileError(error.what());
  }
  return nullptr;
}

// Takes what is of this time from each stream.
void McapRows::fill(core::SensorTime time) {
  recorded_.rate.reset();
  recorded_.reference.reset();
  row_.rate_radps = kNoAxisMeasured;
  row_.reference_radps = {};
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    if (info_.has_reference[i]) row_.reference_radps[i] = kNotMeasured;
  }
  if (streams_->rates.head()->time == time) {
    recorded_.rate = streams_->rates.take();
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      if (recorded_.rate->valid[i]) row_.rate_radps[i] = recorded_.rate->rate_radps[i];
    }
  }
  const auto& reference = streams_->references.head();
  if (reference && reference->time == time) {
    recorded_.reference = streams_->references.take();
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      if (info_.has_reference[i] && recorded_.reference->valid[i] &&
          is_true_rate(recorded_.reference->kind))
        row_.reference_radps[i] = recorded_.reference->rate_radps[i];
    }
  }
  for (std::size_t i = 0; i < streams_->probes.size(); ++i) {
    auto& probe = streams_->probes[i];
    auto& reading = recorded_.temperatures[i];
    reading.reset();
    row_.temperature_degc[i] = kNotMeasured;
    if (!probe.head() || probe.head()->time != time) continue;
    reading = probe.take();
    if (reading->measured) row_.temperature_degc[i] = reading->temperature_degc;
  }
}

// A row whose time went back: an error where it holds a rate and a record's promise is asked for.
bool McapRows::is_in_order(core::SensorTime time) {
  if (!previous_time_ || time > *previous_time_) return true;
  if (time_order_ == TimeOrder::kAsFound) {
    ++rows_out_of_order_;
    return true;
  }
  if (!recorded_.rate) {
    ++left_out_;
    return false;
  }
  throw files::FileError(
      info_.path.string() + ": angular_rate of gyro " + std::to_string(info_.gyro_id) +
      ", sequence number " + std::to_string(recorded_.rate->sequence) + ": time " +
      print_seconds(time) + " s is not after the one before (" + print_seconds(*previous_time_) +
      " s); a record's time strictly increases");
}

std::vector<std::string> McapRows::take_warnings() {
  const auto& findings = reader_->findings();
  std::vector<std::string> news(findings.begin() + static_cast<std::ptrdiff_t>(findings_told_),
                                findings.end());
  findings_told_ = findings.size();
  if (left_out_ > 0 && !left_out_told_) {
    left_out_told_ = true;
    news.push_back(info_.path.string() +
                   ": temperatures or references whose time went back are left out");
  }
  return news;
}

}  // namespace zerodrift::record
