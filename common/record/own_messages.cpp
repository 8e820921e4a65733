// SPDX-License-Identifier: Apache-2.0
// The messages of a recording of this project's own topics, known by their types, whatever the
// topics were called.
#include <algorithm>
#include <charconv>
#include <set>
#include <utility>

#include "common/files/file_error.h"
#include "common/record/cdr_samples.h"
#include "common/record/recorded_messages.h"

namespace zerodrift::record {
namespace {

constexpr std::string_view kRateType = "zerodrift::msg::AngularRate";
constexpr std::string_view kTemperatureType = "zerodrift::msg::Temperature";
constexpr std::string_view kReferenceType = "zerodrift::msg::RateReference";
constexpr std::string_view kEnvironmentType = "zerodrift::msg::Environment";
constexpr std::string_view kEncoding = "cdr";

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

std::string list_of(const std::set<std::uint32_t>& gyros) {
  std::vector<std::string> names;
  for (const auto gyro : gyros) names.push_back(std::to_string(gyro));
  return listed(names);
}

// The channels of a type, without those that say that they are of another gyro or probe. `probe`:
// empty, or the only one that is wanted.
TakesChannel channels_of(std::string_view type, std::uint32_t gyro_id, std::string probe) {
  return [type, gyro_id, probe = std::move(probe)](const mcap::Contents& contents,
                                                   const mcap::Channel& channel) {
    const std::string_view gyro = mcap::value_of(channel.metadata, "gyro_id");
    const std::string_view of_probe = mcap::value_of(channel.metadata, "probe");
    return type_of(contents, channel) == type && (gyro.empty() || number(gyro) == gyro_id) &&
           (of_probe.empty() || probe.empty() || of_probe == probe);
  };
}

class OwnMessages final : public RecordedMessages {
 public:
  OwnMessages(const McapFiles& files, const std::string& name, const RecordOptions& options)
      : files_(files), name_(name) {
    note_keys();
    gyro_id_ = chosen_gyro(options);
  }

  MessageStreams open() override {
    MessageStreams streams{stream(kRateType, &decode_angular_rate),
                           stream(kReferenceType, &decode_rate_reference),
                           {},
                           stream(kEnvironmentType, &decode_environment)};
    for (const std::string& probe : probes()) {
      streams.probes.push_back(
          {files_, channels_of(kTemperatureType, gyro_id_, probe),
           [this, probe](std::string_view payload) { return reading_of(payload, probe); }});
    }
    return streams;
  }

  void describe(RecordInfo& info) const override {
    info.gyro_id = gyro_id_;
    info.probes = probes();
  }
  std::string rates_name() const override {
    return "angular_rate of gyro " + std::to_string(gyro_id_);
  }
  bool first_interval_is_missing() const override { return false; }
  std::string problem_without_rates() const override { return {}; }
  std::vector<std::string> left_out() const override { return {}; }

 private:
  using Thermometer = std::pair<std::uint32_t, std::string>;  // gyro and probe

  template <typename Sample>
  MessageStream<Sample> stream(std::string_view type,
                               std::optional<OfGyro<Sample>> (*decode)(std::string_view)) const {
    return {files_, channels_of(type, gyro_id_, ""),
            [gyro_id = gyro_id_, decode](std::string_view payload) -> std::optional<Sample> {
              const auto decoded = decode(payload);
              if (!decoded || decoded->gyro_id != gyro_id) return std::nullopt;
              return decoded->sample;
            }};
  }

  [[nodiscard]] std::optional<core::TemperatureSample> reading_of(std::string_view payload,
                                                                  const std::string& probe) const {
    auto decoded = decode_temperature(payload);
    if (!decoded || decoded->gyro_id != gyro_id_ || decoded->sample.probe != probe)
      return std::nullopt;
    return std::move(decoded->sample);
  }

  [[nodiscard]] std::vector<std::string> probes() const {
    std::vector<std::string> names;
    for (const auto& [gyro, probe] : thermometers_) {
      if (gyro == gyro_id_) names.push_back(probe);
    }
    return names;
  }

  void add(const Thermometer& thermometer) {
    if (seen_.insert(thermometer).second) thermometers_.push_back(thermometer);
  }

  // Recorders of this project say in a channel's metadata whose messages it holds; of others' files
  // every message is looked at.
  void note_keys() {
    bool all_say_so = true;
    for (const auto& file : files_) {
      for (const auto& channel : file->contents().channels) {
        const std::string_view type = type_of(file->contents(), channel);
        const bool is_rate = type == kRateType;
        if (!is_rate && type != kTemperatureType) continue;
        const auto gyro = number(mcap::value_of(channel.metadata, "gyro_id"));
        const std::string probe(mcap::value_of(channel.metadata, "probe"));
        all_say_so = all_say_so && gyro && (is_rate || !probe.empty());
        if (gyro && is_rate) gyros_.insert(*gyro);
        if (gyro && !is_rate) add({*gyro, probe});
      }
    }
    if (!all_say_so) scan_for_keys();
  }

  void scan_for_keys() {
    gyros_.clear();
    thermometers_.clear();
    seen_.clear();
    for (const auto& file : files_) {
      mcap::Cursor cursor(*file);
      for (mcap::Message message; cursor.next(message);) note_key_of(file->contents(), message);
    }
  }

  void note_key_of(const mcap::Contents& contents, const mcap::Message& message) {
    const std::string_view type = type_of(contents, *contents.channel(message.channel_id));
    if (type == kRateType) {
      if (const auto rate = decode_angular_rate(message.data)) gyros_.insert(rate->gyro_id);
    } else if (type == kTemperatureType) {
      if (const auto reading = decode_temperature(message.data))
        add({reading->gyro_id, reading->sample.probe});
    }
  }

  [[nodiscard]] std::uint32_t chosen_gyro(const RecordOptions& options) const {
    if (gyros_.empty()) {
      throw files::FileError(name_ +
                             ": has no message of angular_rate, of which a record is made; found " +
                             listed(topics()));
    }
    if (options.gyro_id) {
      if (gyros_.contains(*options.gyro_id)) return *options.gyro_id;
      throw files::FileError(name_ + ": has no gyro " + std::to_string(*options.gyro_id) +
                             ", expected --gyro-id to be one of " + list_of(gyros_));
    }
    if (gyros_.size() == 1) return *gyros_.begin();
    if (options.preferred_gyro_id && gyros_.contains(*options.preferred_gyro_id))
      return *options.preferred_gyro_id;
    throw files::FileError(name_ + ": holds gyros " + list_of(gyros_) +
                           "; choose one by --gyro-id");
  }

  [[nodiscard]] std::vector<std::string> topics() const {
    std::vector<std::string> names;
    for (const auto& file : files_) {
      for (const auto& channel : file->contents().channels) {
        if (std::find(names.begin(), names.end(), channel.topic) == names.end())
          names.push_back(channel.topic);
      }
    }
    return names;
  }

  McapFiles files_;
  std::string name_;
  std::set<std::uint32_t> gyros_;  // with rates
  std::set<Thermometer> seen_;
  std::vector<Thermometer> thermometers_;  // as they come in the file
  std::uint32_t gyro_id_ = 0;
};

}  // namespace

bool has_own_rates(const McapFiles& files) {
  for (const auto& file : files) {
    for (const auto& channel : file->contents().channels) {
      if (type_of(file->contents(), channel) == kRateType) return true;
    }
  }
  return false;
}

std::unique_ptr<RecordedMessages> find_own_messages(const McapFiles& files, const std::string& name,
                                                    const RecordOptions& options) {
  return std::make_unique<OwnMessages>(files, name, options);
}

}  // namespace zerodrift::record
