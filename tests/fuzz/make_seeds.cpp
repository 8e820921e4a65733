// SPDX-License-Identifier: Apache-2.0
// Writes the binary seeds of corpus/ anew, for when a format has changed:
//   fuzz_seeds tests/fuzz/corpus
// Text seeds are written by hand.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>

#include "common/checkpoint/checkpoint_bytes.h"
#include "common/dds/topics.h"
#include "common/drivers/kvh_frame.h"
#include "idl/proto/checkpoint.pb.h"
#include "tests/fuzz/checkpoint_envelope.h"
#include "tests/fuzz/running_compensator.h"
#include "tests/unit/checkpoint/saved_learner.h"
#include "tests/unit/mcap/example_file.h"
#include "tests/unit/record/recording.h"
#include "tests/unit/record/ros2_bag_file.h"

namespace zerodrift::fuzz {
namespace {

std::filesystem::path root;

void write(const char* target, const char* name, const std::string& bytes) {
  const auto folder = root / target;
  std::filesystem::create_directories(folder);
  std::ofstream file(folder / name, std::ios::binary);
  if (!file.write(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    throw std::runtime_error("cannot write " + (folder / name).string());
}

template <typename T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// ---------------------------------------- checkpoint

// Labels more than a minute apart: the last stationary minute holds one.
std::string axis_bytes(int labels) {
  const auto options = checkpoint::testing::small_options();
  compensation::AxisLearner axis(options, options.features.size());
  for (int n = 0; n < labels; ++n) {
    compensation::AxisLabel label{.time = core::from_seconds(61.0 * n),
                                  .drift_radps = 1e-5 * std::sin(0.2 * n),
                                  .variance = 1e-14};
    label.features.emplace().front() = std::sin(0.1 * n);
    axis.learn(label);
  }
  std::string bytes;
  core::StateArchive archive(bytes);
  axis.carry(archive);
  return bytes;
}

void checkpoint_seeds() {
  const auto options = checkpoint::testing::small_options();
  const std::string file = checkpoint::encode({7, options}, checkpoint::testing::saved_after(0));
  proto::Checkpoint message;
  message.ParseFromString(file.substr(checkpoint::kEnvelopeSize));
  message.clear_learner();
  write("checkpoint", "file_cut", "f" + file.substr(0, 1000));
  write("checkpoint", "message_of_a_new_learner", "m" + message.SerializeAsString());
  message.set_layout(message.layout() + 1);
  write("checkpoint", "file_of_another_layout", "f" + in_envelope(message.SerializeAsString()));
  write("checkpoint", "axis_with_its_initial_set", "a" + axis_bytes(3));
  write("checkpoint", "axis_just_begun", "a" + axis_bytes(5));
  write("checkpoint", "axis_with_models_judged", "a" + axis_bytes(6));
}

// ---------------------------------------- MCAP

void mcap_seeds() {
  using zerodrift::mcap::Compression;
  const auto example = [](Compression compression) {
    return mcap::testing::make_example(
        {.compression = compression, .messages = 12, .chunk_bytes = 150});
  };
  const auto zstd = example(Compression::kZstd);
  write("mcap", "zstd", "m" + zstd.bytes);
  write("mcap", "lz4", "m" + example(Compression::kLz4).bytes);
  write("mcap", "uncompressed", "m" + example(Compression::kNone).bytes);
  write("mcap", "cut", "m" + zstd.bytes.substr(0, zstd.chunk_ends.back().first - 20));
  record::Recording record(record::Channels::kPerTopic);
  record.add(1, record::reading_at(0.5, "coil", 20.0));
  record.add(1, record::rate_at(1.0, 1));
  record.add(1, core::RateReferenceSample{.time = core::from_seconds(1.0)});
  record.add(1, record::rate_at(0.9, 2));
  const std::string recorded = record.bytes_so_far();
  if (recorded.size() > 4000) throw std::runtime_error("the seeds of mcap are too large");
  write("mcap", "record_in_any_order", "R" + recorded);
  write("mcap", "record", "r" + recorded);
}

// ---------------------------------------- bags of ROS 2

void ros2_bag_seeds() {
  const auto seed = [](const char* name, const std::string& bytes) {
    write("ros2_bag", name, bytes);
  };
  seed("imu", "i" + record::imu_bytes(record::imu_at(1)));
  seed("imu_big_endian", "i" + record::imu_bytes(record::imu_at(1), std::endian::big, ""));
  core::RosImu absent = record::imu_at(2);
  absent.covariance_radps2[0] = -1.0;
  seed("imu_without_rates", "i" + record::imu_bytes(absent));
  const std::string temperature = record::temperature_bytes(record::temperature_at(1, 20.5));
  seed("temperature", "t" + temperature);
  record::Ros2Bag bag(zerodrift::mcap::Compression::kNone);
  for (int n = 0; n < 4; ++n) bag.imu("/imu", record::imu_at(n));
  bag.imu("/imu", {});
  bag.put("/imu", record::kImuType, "no message");
  bag.temperature("/coil", record::temperature_at(1, 20.5));
  bag.imu("/imu", record::imu_at(2));
  const std::string whole = bag.finished();
  if (whole.size() > 4000) throw std::runtime_error("the seeds of ros2_bag are too large");
  seed("bag_in_any_order", "B/imu,coil=/coil\n" + whole);
  seed("bag_of_its_only_topics", "b\n" + whole);
}

// ---------------------------------------- running state

// A change as targets/running_state.cpp reads it.
std::string change(std::uint16_t at, const std::string& bytes) {
  std::string text;
  append(text, at);
  return text + static_cast<char>(bytes.size()) + bytes;
}

void running_state_seeds() {
  const auto seed = [](const char* name, const std::string& bytes) {
    write("running_state", name, bytes);
  };
  const std::string wild(8, '\xff');
  seed("no_state", "fnothing of the kind");
  seed("new", std::string("d\0", 2));
  seed("labels_gather", "d\x01");
  seed("with_a_model", "d\x02");
  seed("with_a_model_and_a_prior", "D\x02");
  seed("cut", "d\x02" + change(100, ""));
  seed("wild_in_many_places", "d\x02" + change(0, wild) + change(8500, wild) + change(9000, wild) +
                                  change(10000, wild) + change(11000, wild));
  seed("wild_at_the_end", "D\x02" + change(65535, wild));
  seed("message_changed", "m\x02" + change(1, "x") + change(3000, wild));
  seed("message_unchanged_with_a_prior", "M\x02");
}

// ---------------------------------------- datagrams

constexpr char kLittleEndian = 1;

std::string rtps_header(char vendor) {
  return std::string("RTPS\2\2\1") + vendor + "participant1";
}

std::string submessage(char id, const std::string& body) {
  std::string bytes{id, kLittleEndian};
  append(bytes, static_cast<std::uint16_t>(body.size()));
  return bytes + body;
}

std::string sequence(std::uint32_t number) {
  std::string bytes(4, '\0');
  append(bytes, number);
  return bytes;
}

std::string u32(std::uint32_t number) {
  std::string bytes;
  append(bytes, number);
  return bytes;
}

// RTPS 2.3, 8.3.3 and 9.4; DDS Security 1.1, 7.3.6.
std::string data_of_writer(const std::string& writer) {
  const std::string reader(4, '\0');
  return submessage(
      0x15, std::string("\0\0\x10\0", 4) + reader + writer + sequence(1) + std::string(8, '\1'));
}

void datagram_seeds() {
  constexpr char kFastDds = 15;
  constexpr char kOther = 1;
  const std::string header = rtps_header(kFastDds);
  const std::string timestamp = submessage(0x09, std::string(8, '\0'));
  const std::string statistics = submessage('\x80', std::string(56, '\0'));
  const std::string ends(8, '\1');  // reader and writer
  const std::string heartbeat = submessage(0x07, ends + sequence(1) + sequence(9) + u32(1));
  const std::string key(20, '\2');  // of a crypto header
  write("datagram", "sample", header + timestamp + data_of_writer({0, 0, 1, 3}) + statistics);
  write("datagram", "announcement", header + timestamp + data_of_writer({0, 1, 0, '\xc2'}));
  write("datagram", "authentication", header + data_of_writer({0, 2, 1, '\xc3'}));
  write("datagram", "keys",
        header + submessage(0x31, key) + submessage(0x30, "keys") + submessage(0x32, key));
  const std::string encrypted =
      submessage(0x33, key) + submessage(0x30, "body") + submessage(0x34, std::string(20, '\3'));
  write("datagram", "encrypted", header + encrypted + statistics);
  write("datagram", "encrypted_of_another_vendor", rtps_header(kOther) + encrypted);
  write("datagram", "statistics_first", header + statistics + heartbeat);
  write("datagram", "big_endian_to_the_end", header + std::string("\x07\0\0\0", 4) + "to the end");
  write("datagram", "longer_than_it_is", header + heartbeat.substr(0, 9));
  write("datagram", "header_alone", header);
  write("datagram", "gap", header + submessage(0x08, ends + sequence(1) + sequence(9) + u32(0)));
  write("datagram", "acknowledgement",
        header + submessage(0x06, ends + sequence(1) + u32(32) + u32(7) + u32(1)));
  write("datagram", "missing_fragments",
        header + submessage(0x12, ends + sequence(1) + u32(1) + u32(2) + u32(3) + u32(1)));
  write("datagram", "fragment",
        header + submessage(0x16, std::string("\0\0\x1c\0", 4) + ends + sequence(1) + u32(1) +
                                      std::string("\1\0\x08\0", 4) + u32(12) + ends));
  write("datagram", "heartbeat_of_another",
        header + submessage(0x0c, std::string(8, '\0') + "participant2") + heartbeat);
}

// ---------------------------------------- DDS

template <typename Message>
void dds_seed(char topic, const char* name, Message message) {
  typename dds::TopicOf<Message>::TypeSupport type;
  eprosima::fastrtps::rtps::SerializedPayload_t payload(type.getSerializedSizeProvider(&message)());
  if (!type.serialize(&message, &payload)) throw std::runtime_error("cannot be serialised");
  std::string bytes(1, topic);
  bytes.append(reinterpret_cast<const char*>(payload.data), payload.length);
  write("dds_payload", name, bytes);
  if (topic != 0) return;
  bytes[2] = 0x7F;  // an encapsulation that nobody knows
  write("dds_payload", "unknown_encapsulation", bytes);
}

msg::AllanReport allan_report() {
  msg::AllanReport report;
  report.gyro_id(1);
  msg::AllanPoint point;
  point.tau_s(1.0);
  point.deviation_radps(1e-6);
  report.since_start().assign(2, point);
  report.rolling().assign(1, point);
  return report;
}

msg::ServiceStatus service_status() {
  msg::ServiceStatus status;
  status.service("compensation");
  status.host("host");
  status.summary("1 gyro(s)");
  msg::Metric metric;
  metric.name("samples_in");
  metric.unit("1");
  status.metrics().assign(2, metric);
  return status;
}

void dds_seeds() {
  msg::AngularRate rate;
  rate.gyro_id(1);
  rate.validity(7);
  rate.interval_s(0.005);
  rate.rate_radps({1e-5, -1e-5, 7e-5});
  dds_seed(0, "angular_rate", rate);
  msg::Temperature temperature;
  temperature.probe("coil");
  temperature.temperature_degc(20.0);
  temperature.measured(1);
  dds_seed(1, "temperature", temperature);
  msg::RateReference reference;
  reference.kind(2);
  reference.validity(7);
  dds_seed(2, "rate_reference", reference);
  msg::CompensatedRate compensated;
  compensated.validity(7);
  compensated.mode({1, 2, 3});
  dds_seed(3, "compensated_rate", compensated);
  dds_seed(4, "allan_report", allan_report());
  dds_seed(5, "service_status", service_status());
  msg::Event event;
  event.service("compensation");
  event.code("missing_sample");
  event.text("sequence numbers are missing from the stream");
  dds_seed(6, "event", event);
  msg::Command command;
  command.service("compensation");
  command.name("adopt");
  command.argument("1:/tmp/model.yaml");
  dds_seed(7, "command", command);
  msg::CommandReply reply;
  reply.service("compensation");
  reply.text("learning is frozen");
  dds_seed(8, "command_reply", reply);
  msg::ReplayProgress progress;
  progress.consumer("compensation");
  progress.gyro_id(1);
  dds_seed(9, "replay_progress", progress);
  msg::CheckpointPart part;
  part.gyro_id(1);
  part.parts(1);
  part.bytes().assign(8, 1);
  dds_seed(10, "checkpoint", part);
  msg::NavigationState navigation;
  navigation.gyro_id(1);
  navigation.attitude({1.0, 0.0, 0.0, 0.0});
  dds_seed(11, "navigation", navigation);
  msg::TwinReport twin;
  twin.gyro_id(1);
  twin.verdict("effect_named");
  twin.effects().emplace_back().name("shupe");
  twin.points().resize(2);
  dds_seed(12, "twin_report", twin);
  msg::Environment environment;
  environment.channels(0x1ff);
  environment.measured(0x1ff);
  environment.supply_v(5.0);
  dds_seed(13, "environment", environment);
  msg::ThermalCoverage coverage;
  coverage.gyro_id(1);
  coverage.model_epoch(3);
  coverage.labels_x()[100] = 7;
  dds_seed(14, "thermal_coverage", coverage);
}

// ---------------------------------------- serial frames

std::string frames(int count, int step) {
  std::string bytes;
  for (int i = 0; i < count; ++i) {
    drivers::KvhFrame frame;
    frame.rotation = {1e-5F, -1e-5F, 7e-5F};
    frame.rotation_valid = {true, true, true};
    frame.sequence = static_cast<std::uint8_t>(i * step % 128);
    frame.temperature = 25;
    const auto encoded = drivers::encode(frame);
    bytes.append(encoded.begin(), encoded.end());
  }
  return bytes;
}

void serial_seeds() {
  write("serial_frames", "four_frames", frames(4, 1));
  write("serial_frames", "sequence_with_holes", frames(6, 50));
  write("serial_frames", "begins_within_a_frame", frames(3, 1).substr(20));
  std::string damaged = frames(3, 1);
  damaged[45] = static_cast<char>(damaged[45] ^ 1);
  write("serial_frames", "one_damaged", damaged);
  write("serial_frames", "headers_without_frames", std::string(80, '\xFE') + frames(1, 1));
}

// ---------------------------------------- streams

void any_rate(std::string& bytes, std::uint64_t sequence, std::int64_t time, double rate) {
  bytes += '\x05';
  append(bytes, sequence);
  append(bytes, time);
  append(bytes, 0.1);
  for (int i = 0; i < 3; ++i) append(bytes, rate);
  bytes += "\x07\x03";
}

void stream_seeds() {
  std::string good(1, '\0');
  for (int i = 0; i < 8; ++i) good += "\x02\x3F";
  write("sample_stream", "fifty_seconds", good);
  good[0] = 1;
  write("sample_stream", "fifty_seconds_with_a_prior", good);
  std::string orders = "\x01\x02\x3F";
  for (char order = 0; order < 5; ++order) (orders += '\x03') += order, orders += "\x02\x20";
  write("sample_stream", "every_order", orders);
  std::string wild = std::string(1, '\0') + "\x02\x3F";
  any_rate(wild, ~0ULL, std::numeric_limits<std::int64_t>::max(), 1e300);
  any_rate(wild, 0, std::numeric_limits<std::int64_t>::min(), -1e300);
  wild += "\x02\x3F";
  wild += '\x06';
  append(wild, std::numeric_limits<std::int64_t>::max());
  append(wild, 1e300);
  wild += '\x01';
  wild += '\x07';
  append(wild, std::numeric_limits<std::int64_t>::min());
  for (int i = 0; i < 4; ++i) append(wild, 1e300);
  wild += "\x03\x01";
  wild += "\x02\x3F";
  write("sample_stream", "wild_stamps_and_values", wild);
}

}  // namespace
}  // namespace zerodrift::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: fuzz_seeds <corpus folder>\n", stderr);
    return 2;
  }
  zerodrift::fuzz::root = argv[1];
  zerodrift::fuzz::checkpoint_seeds();
  zerodrift::fuzz::mcap_seeds();
  zerodrift::fuzz::ros2_bag_seeds();
  zerodrift::fuzz::running_state_seeds();
  zerodrift::fuzz::datagram_seeds();
  zerodrift::fuzz::dds_seeds();
  zerodrift::fuzz::serial_seeds();
  zerodrift::fuzz::stream_seeds();
  return 0;
}
