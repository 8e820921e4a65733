// SPDX-License-Identifier: Apache-2.0
#include "common/checkpoint/checkpoint_bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <boost/crc.hpp>
#include <limits>
#include <stdexcept>
#include <utility>

#include "common/checkpoint/checkpoint_error.h"
#include "common/checkpoint/learner_message.h"
#include "common/compensation/option_keys.h"

namespace zerodrift::checkpoint {
namespace {

using compensation::Decides;
using compensation::option_values;
using compensation::OptionValue;

// Where what stands in the envelope.
constexpr std::string_view kMagic = "ZDRIFTCP";
constexpr std::size_t kVersionAt = 8;
constexpr std::size_t kCrcAt = 12;
constexpr std::size_t kLengthAt = 16;

constexpr const char* kProducer = "zerodrift " ZERODRIFT_VERSION;

template <typename Unsigned>
std::string little_endian(Unsigned value) {
  std::string bytes;
  for (std::size_t i = 0; i < sizeof(Unsigned); ++i)
    bytes.push_back(static_cast<char>((value >> (8 * i)) & 0xFFU));
  return bytes;
}

template <typename Unsigned>
Unsigned number_at(std::string_view bytes, std::size_t at) {
  Unsigned value = 0;
  for (std::size_t i = 0; i < sizeof(Unsigned); ++i)
    value |= static_cast<Unsigned>(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
  return value;
}

// Of the version, the length and the message.
std::uint32_t crc_of(std::string_view version, std::string_view rest) {
  boost::crc_32_type crc;
  crc.process_bytes(version.data(), version.size());
  crc.process_bytes(rest.data(), rest.size());
  return crc.checksum();
}

// Unlike SerializeAsString() this promises the same bytes for the same message.
std::string serialise(const proto::Checkpoint& message) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  if (!message.SerializeToCodedStream(&coded)) throw CheckpointError("cannot be serialised");
  coded.Trim();
  return bytes;
}

std::string_view open_envelope(std::string_view bytes) {
  if (bytes.substr(0, kMagic.size()) != kMagic.substr(0, bytes.size()) || bytes.empty()) {
    throw CheckpointError(
        "found something else than a checkpoint; expected a file that begins with " +
            std::string(kMagic),
        "is no checkpoint");
  }
  const auto cut = [&](std::uint64_t expected) {
    return CheckpointError("found " + std::to_string(bytes.size()) + " bytes, expected " +
                               (bytes.size() < kEnvelopeSize ? "at least " : "") +
                               std::to_string(expected) +
                               ": the checkpoint is truncated or damaged",
                           "is truncated or damaged");
  };
  if (bytes.size() < kEnvelopeSize) throw cut(kEnvelopeSize);
  const auto length = number_at<std::uint64_t>(bytes, kLengthAt);
  if (length != bytes.size() - kEnvelopeSize) throw cut(kEnvelopeSize + length);
  const auto found = crc_of(bytes.substr(kVersionAt, kCrcAt - kVersionAt), bytes.substr(kLengthAt));
  const auto expected = number_at<std::uint32_t>(bytes, kCrcAt);
  if (found != expected) {
    throw CheckpointError("found CRC-32 " + std::to_string(found) + ", expected " +
                              std::to_string(expected) + ": the checkpoint is damaged",
                          "is damaged");
  }
  const auto version = number_at<std::uint32_t>(bytes, kVersionAt);
  if (version != kFormatVersion) {
    throw CheckpointError("found format version " + std::to_string(version) + ", expected " +
                              std::to_string(kFormatVersion) +
                              (version > kFormatVersion ? ": saved by a newer zerodrift" : ""),
                          "is of another format version");
  }
  return bytes.substr(kEnvelopeSize);
}

std::string value_of(const google::protobuf::RepeatedPtrField<proto::CheckpointOption>& options,
                     const std::string& key) {
  for (const auto& option : options) {
    if (option.key() == key) return option.value();
  }
  return "nothing";
}

// By key, so that the line names what differs.
void check_options(const std::string& what,
                   const google::protobuf::RepeatedPtrField<proto::CheckpointOption>& options,
                   const std::vector<OptionValue>& expected) {
  for (const auto& [key, value] : expected) {
    const std::string found = value_of(options, key);
    if (found == value) continue;
    throw CheckpointError("found " + what + " made with " + key + " '" + found + "', expected '" +
                              value + "' as configured",
                          "was made with another " + key + " than is configured");
  }
}

// A key too many is a difference as well.
void check_owner(const proto::Checkpoint& message, const Owner& owner) {
  if (message.gyro_id() != owner.gyro_id) {
    throw CheckpointError("found a checkpoint of gyro " + std::to_string(message.gyro_id()) +
                              ", expected one of gyro " + std::to_string(owner.gyro_id),
                          "is of another gyro");
  }
  const auto expected = option_values(owner.options, Decides::kModel);
  check_options("a checkpoint", message.options(), expected);
  if (message.options_size() > static_cast<int>(expected.size())) {
    throw CheckpointError("found a checkpoint made with " +
                              message.options(static_cast<int>(expected.size())).key() +
                              ", which is not configured",
                          "was made with something that is not configured");
  }
}

void put(const std::vector<OptionValue>& from,
         google::protobuf::RepeatedPtrField<proto::CheckpointOption>& to) {
  for (const auto& [key, value] : from) {
    auto* option = to.Add();
    option->set_key(key);
    option->set_value(value);
  }
}

proto::Checkpoint message_of(const Owner& owner, const compensation::LearnerState& state) {
  proto::Checkpoint message;
  message.set_producer(kProducer);
  message.set_gyro_id(owner.gyro_id);
  put(option_values(owner.options, Decides::kModel), *message.mutable_options());
  const core::SensorTime newest = state.newest_label();
  if (newest != core::kNever) message.set_newest_label_ns(newest.count());
  to_message(state, *message.mutable_learner());
  return message;
}

std::string enveloped(const proto::Checkpoint& message) {
  const std::string contents = serialise(message);
  const std::string version = little_endian(kFormatVersion);
  const std::string rest = little_endian(std::uint64_t{contents.size()}) + contents;
  return std::string(kMagic) + version + little_endian(crc_of(version, rest)) + rest;
}

proto::Checkpoint checked(std::string_view bytes, const Owner& owner) {
  const std::string_view contents = open_envelope(bytes);
  proto::Checkpoint message;
  if (contents.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) ||
      !message.ParseFromArray(contents.data(), static_cast<int>(contents.size()))) {
    throw CheckpointError("found contents that are no checkpoint message");
  }
  check_owner(message, owner);
  return message;
}

compensation::LearnerState learner_of(const proto::Checkpoint& message) {
  compensation::LearnerState state = from_message(message.learner());
  const core::SensorTime newest =
      message.has_newest_label_ns() ? core::SensorTime{message.newest_label_ns()} : core::kNever;
  if (newest != state.newest_label()) {
    throw CheckpointError("found a newest label that is not the newest of the axes");
  }
  return state;
}

void check_path(const proto::Checkpoint& message, const Owner& owner) {
  if (message.producer() != kProducer) {
    throw CheckpointError("found a state of " + message.producer() + ", expected one of " +
                          kProducer);
  }
  check_options("a state", message.path_options(), option_values(owner.options, Decides::kAnswers));
}

}  // namespace

std::string encode(const Owner& owner, const compensation::LearnerState& state) {
  return enveloped(message_of(owner, state));
}

compensation::LearnerState decode(std::string_view bytes, const Owner& owner) {
  return learner_of(checked(bytes, owner));
}

std::string encode_running(const Owner& owner, const compensation::LearnerState& state,
                           std::string data_path) {
  proto::Checkpoint message = message_of(owner, state);
  put(option_values(owner.options, Decides::kAnswers), *message.mutable_path_options());
  message.set_data_path(std::move(data_path));
  return enveloped(message);
}

std::unique_ptr<compensation::Compensator> decode_running(std::string_view bytes,
                                                          const Owner& owner) {
  const proto::Checkpoint message = checked(bytes, owner);
  check_path(message, owner);
  try {
    auto compensator = std::make_unique<compensation::Compensator>(owner.options);
    compensator->restore_models(
        std::make_shared<compensation::RestoredLearner>(owner.options, learner_of(message)));
    compensator->finish_learning();
    core::StateArchive archive{std::string_view(message.data_path())};
    compensator->carry(archive);
    if (!archive.ok() || !archive.at_end()) {
      throw CheckpointError("found a data path's state that doesn't fit its options");
    }
    return compensator;
  } catch (const std::invalid_argument& error) {
    throw CheckpointError(std::string("found values that no learner has: ") + error.what());
  }
}

}  // namespace zerodrift::checkpoint
