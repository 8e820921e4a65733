// SPDX-License-Identifier: Apache-2.0
// The messages of a ROS 2 bag that a record is made of: rates of one topic of sensor_msgs/msg/Imu,
// temperatures of topics of sensor_msgs/msg/Temperature.
#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "common/files/file_error.h"
#include "common/record/csv_cells.h"
#include "common/record/probe_topic.h"
#include "common/record/recorded_messages.h"
#include "common/record/ros2_messages.h"

namespace zerodrift::record {
namespace {

constexpr std::string_view kImu = "sensor_msgs/msg/Imu";
constexpr std::string_view kTemperature = "sensor_msgs/msg/Temperature";
constexpr std::string_view kMessageEncoding = "cdr";
constexpr std::array<std::string_view, 2> kSchemaEncodings{"ros2msg", "ros2idl"};
constexpr std::string_view kProfile = "ros2";

// What the messages of a topic are.
struct Kind {
  std::string type{};
  std::string message_encoding{};
  std::string schema_encoding{};

  bool operator==(const Kind&) const = default;
  [[nodiscard]] bool is_readable(std::string_view as) const {
    return type == as && message_encoding == kMessageEncoding &&
           std::find(kSchemaEncodings.begin(), kSchemaEncodings.end(), schema_encoding) !=
               kSchemaEncodings.end();
  }
  [[nodiscard]] std::string text() const {
    return printable(type) + " in " + printable(message_encoding) + " with " +
           printable(schema_encoding);
  }
};

Kind kind_of(const mcap::Contents& contents, const mcap::Channel& channel) {
  const mcap::Schema* schema = contents.schema(channel.schema_id);
  if (schema == nullptr) return {.message_encoding = channel.message_encoding};
  return {schema->name, channel.message_encoding, schema->encoding};
}

TakesChannel channels_of(std::string topic, std::string_view type) {
  return [topic = std::move(topic), type](const mcap::Contents& contents,
                                          const mcap::Channel& channel) {
    return channel.topic == topic && kind_of(contents, channel).is_readable(type);
  };
}

// Messages of one topic that gave no sample.
struct Missed {
  std::string topic{};
  std::string_view type{};
  std::uint64_t unreadable = 0;
  std::uint64_t without_stamp = 0;

  void append_to(std::vector<std::string>& lines) const {
    const auto line = [&](std::uint64_t count, const std::string& what, const std::string& was) {
      if (count == 0) return;
      lines.push_back(printable(topic) + ": " + std::to_string(count) +
                      (count == 1 ? " message " : " messages ") + what + was +
                      (count == 1 ? " is" : " are") + " left out");
    };
    line(without_stamp, "without a stamp (header.stamp is 0, or no time)", "");
    line(unreadable, unreadable == 1 ? "that is no " : "that are no ",
         std::string(type) + " in " + std::string(kMessageEncoding));
  }
};

// `Counter` is core::RosRates or core::RosTemperatures.
template <typename Sample, typename Counter, typename Decode>
typename MessageStream<Sample>::Decode decoder(Counter counter, Decode decode,
                                               std::shared_ptr<Missed> missed) {
  return [counter = std::move(counter), decode,
          missed = std::move(missed)](std::string_view payload) mutable -> std::optional<Sample> {
    const auto message = decode(payload);
    if (!message) {
      ++missed->unreadable;
      counter.skip(1);
      return std::nullopt;
    }
    std::optional<Sample> sample = counter.take(*message);
    if (!sample) ++missed->without_stamp;
    return sample;
  };
}

class BagMessages final : public RecordedMessages {
 public:
  BagMessages(const McapFiles& files, const std::string& name, const RecordOptions& options)
      : files_(files), name_(name) {
    for (const auto& file : files_) {
      for (const auto& channel : file->contents().channels)
        topics_.emplace(channel.topic, kind_of(file->contents(), channel));
    }
    choose_rates(options.topics.rates);
    choose_temperatures(options.topics.temperatures);
  }

  MessageStreams open() override {
    missed_.clear();
    const auto nothing = [](const mcap::Contents&, const mcap::Channel&) { return false; };
    MessageStreams streams{
        {files_, channels_of(rates_, kImu),
         decoder<core::AngularRateSample>(core::RosRates(core::ClockSource::kReplay),
                                          &decode_ros2_imu, missed(rates_, kImu))},
        {{}, nothing, {}},
        {},
        {{}, nothing, {}}};
    for (const auto& [probe, topic] : temperatures_) {
      streams.probes.push_back({files_, channels_of(topic, kTemperature),
                                decoder<core::TemperatureSample>(
                                    core::RosTemperatures(probe, core::ClockSource::kReplay),
                                    &decode_ros2_temperature, missed(topic, kTemperature))});
    }
    return streams;
  }

  void describe(RecordInfo& info) const override {
    for (const auto& [probe, topic] : temperatures_) info.probes.push_back(probe);
    for (const std::string& line : chosen_unasked_) info.warnings.push_back(name_ + ": " + line);
  }
  std::string rates_name() const override { return printable(rates_); }
  bool first_interval_is_missing() const override { return true; }
  std::string problem_without_rates() const override {
    return rates_name() +
           ": none of its messages has an angular velocity: its covariance begins with -1, or the "
           "rates are not finite";
  }
  std::vector<std::string> left_out() const override {
    std::vector<std::string> lines;
    for (const auto& one : missed_) one->append_to(lines);
    return lines;
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw files::FileError(name_ + ": " + why);
  }

  std::shared_ptr<Missed> missed(const std::string& topic, std::string_view type) {
    missed_.push_back(std::make_shared<Missed>(Missed{.topic = topic, .type = type}));
    return missed_.back();
  }

  [[nodiscard]] std::vector<std::string> readable(std::string_view type) const {
    std::vector<std::string> names;
    for (const auto& [topic, kind] : topics_) {
      if (kind.is_readable(type)) names.push_back(topic);
    }
    return names;
  }

  [[nodiscard]] std::vector<std::string> all_with_types() const {
    std::vector<std::string> names;
    for (const auto& [topic, kind] : topics_) names.push_back(topic + " (" + kind.type + ")");
    return names;
  }

  // As in the bag, where a topic's name begins with a slash.
  [[nodiscard]] std::string found(const std::string& option, const std::string& asked,
                                  std::string_view type) const {
    const std::string topic = topics_.contains(asked) ? asked : "/" + asked;
    const auto known = topics_.find(topic);
    if (known == topics_.end()) {
      refuse("has no topic " + printable(asked) + ", which " + option + " names; topics of " +
             std::string(type) + ": " + listed(readable(type)));
    }
    if (known->second.is_readable(type)) return topic;
    refuse(option + ": found " + printable(topic) + " of " + known->second.text() + ", expected " +
           std::string(type) + " in cdr with ros2msg or ros2idl");
  }

  void choose_rates(const std::string& asked) {
    if (!asked.empty()) {
      rates_ = found("--topic", asked, kImu);
      return;
    }
    const auto there = readable(kImu);
    if (there.empty()) {
      refuse("has no topic of " + std::string(kImu) +
             " in cdr with ros2msg or ros2idl, of which a record is made; found " +
             listed(all_with_types()));
    }
    if (there.size() > 1) {
      refuse("holds several topics of " + std::string(kImu) + ": " + listed(there) +
             "; choose one by --topic");
    }
    rates_ = there.front();
    chosen_unasked_.push_back("takes " + printable(rates_) + ", the only topic of " +
                              std::string(kImu));
  }

  void choose_temperatures(const std::vector<std::string>& asked) {
    for (const std::string& text : asked) {
      const auto named = parse_probe_topic(text);
      if (!named) {
        refuse("--temperature-topic: found '" + printable(text) +
               "', expected TOPIC or PROBE=TOPIC, the probe of letters, digits and '_'");
      }
      add({named->probe, found("--temperature-topic", named->topic, kTemperature)});
    }
    if (!asked.empty()) return;
    const auto there = readable(kTemperature);
    if (there.size() == 1) {
      add({kUsualProbe, there.front()});
      chosen_unasked_.push_back("takes " + printable(there.front()) + " for the temperature of '" +
                                kUsualProbe + "', the only topic of " + std::string(kTemperature));
    } else if (there.size() > 1) {
      chosen_unasked_.push_back("takes no temperature: of " + listed(there) +
                                " choose by --temperature-topic");
    }
  }

  void add(ProbeTopic named) {
    for (const ProbeTopic& known : temperatures_) {
      if (known.probe != named.probe) continue;
      refuse("--temperature-topic: names probe '" + named.probe +
             "' twice; expected PROBE=TOPIC, each probe once");
    }
    temperatures_.push_back(std::move(named));
  }

  McapFiles files_;
  std::string name_;
  std::map<std::string, Kind> topics_;
  std::string rates_;  // topic
  std::vector<ProbeTopic> temperatures_;
  std::vector<std::string> chosen_unasked_;
  std::vector<std::shared_ptr<Missed>> missed_;
};

}  // namespace

bool is_of_ros2(const McapFiles& files) {
  for (const auto& file : files) {
    const mcap::Contents& contents = file->contents();
    if (contents.profile == kProfile) return true;
    for (const auto& channel : contents.channels) {
      if (kind_of(contents, channel).is_readable(kImu)) return true;
    }
  }
  return false;
}

std::unique_ptr<RecordedMessages> find_ros2_messages(const McapFiles& files,
                                                     const std::string& name,
                                                     const RecordOptions& options) {
  return std::make_unique<BagMessages>(files, name, options);
}

}  // namespace zerodrift::record
