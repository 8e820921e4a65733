// SPDX-License-Identifier: Apache-2.0
#include "common/checkpoint/checkpoint_bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <algorithm>
#include <boost/crc.hpp>
#include <limits>
#include <stdexcept>
#include <utility>

#include "common/checkpoint/checkpoint_error.h"
#include "common/compensation/option_keys.h"
#include "idl/proto/checkpoint.pb.h"

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

constexpr auto kLastKernel = static_cast<std::uint32_t>(regression::KernelKind::kLinear);
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
  // As large as the message: a string that grows would keep up to twice of it for as long as the
  // state is on its way.
  std::string bytes(message.ByteSizeLong(), '\0');
  google::protobuf::io::ArrayOutputStream stream(bytes.data(), static_cast<int>(bytes.size()));
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  if (!message.SerializeToCodedStream(&coded)) throw CheckpointError("cannot be serialised");
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
                              (version > kFormatVersion ? ": saved by a newer zerodrift"
                                                        : ": saved by an older zerodrift"),
                          "is of another format version");
  }
  return bytes.substr(kEnvelopeSize);
}

using Options = google::protobuf::RepeatedPtrField<proto::CheckpointOption>;

const std::string* find_value(const Options& options, const std::string& key) {
  const auto found = std::find_if(options.begin(), options.end(),
                                  [&](const auto& option) { return option.key() == key; });
  return found == options.end() ? nullptr : &found->value();
}

// Which options of a checkpoint must be the configured ones.
enum class Agreement : std::uint8_t {
  kAll,
  kKnownToBoth,  // keys that one of two versions doesn't have say nothing
};

// By key, so that the line names what differs.
void check_options(const std::string& what, const Options& options,
                   const std::vector<OptionValue>& expected, Agreement agreement) {
  for (const auto& [key, value] : expected) {
    const std::string* found = find_value(options, key);
    if (found == nullptr ? agreement == Agreement::kKnownToBoth : *found == value) continue;
    throw CheckpointError("found " + what + " made with " + key + " '" +
                              (found == nullptr ? "nothing" : *found) + "', expected '" + value +
                              "' as configured",
                          "was made with another " + key + " than is configured");
  }
  // A key too many is a difference as well.
  const auto count = static_cast<int>(expected.size());
  if (agreement == Agreement::kKnownToBoth || options.size() <= count) return;
  throw CheckpointError(
      "found " + what + " made with " + options[count].key() + ", which is not configured",
      "was made with something that is not configured");
}

void check_gyro(const proto::Checkpoint& message, const Owner& owner) {
  if (message.gyro_id() == owner.gyro_id) return;
  throw CheckpointError("found a checkpoint of gyro " + std::to_string(message.gyro_id()) +
                            ", expected one of gyro " + std::to_string(owner.gyro_id),
                        "is of another gyro");
}

void check_learned_with(const proto::Checkpoint& message, const Owner& owner, Agreement agreement) {
  check_options("a checkpoint", message.options(), option_values(owner.options, Decides::kModel),
                agreement);
}

void check_layout(const proto::Checkpoint& message) {
  if (message.layout() == compensation::kLearnerLayout) return;
  throw CheckpointError("found what a learner of layout " + std::to_string(message.layout()) +
                            " knew, expected layout " +
                            std::to_string(compensation::kLearnerLayout) + ": saved by " +
                            message.producer(),
                        "is of another version");
}

void put(const std::vector<OptionValue>& from, Options& to) {
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
  message.set_epoch(state.epoch);
  for (const auto& [kernel, epsilon] : state.kernels) {
    auto& chosen = *message.add_kernels();
    chosen.set_kind(static_cast<std::uint32_t>(kernel.kind));
    chosen.set_gamma(kernel.gamma);
    chosen.set_degree(kernel.degree);
    chosen.set_offset(kernel.offset);
    chosen.set_epsilon(epsilon);
  }
  message.set_layout(compensation::kLearnerLayout);
  message.set_learner(state.bytes);
  message.set_boot(state.boot);
  message.set_saved_unix_s(state.saved_unix_s);
  return message;
}

std::string enveloped(const proto::Checkpoint& message) {
  const std::string contents = serialise(message);
  const std::string version = little_endian(kFormatVersion);
  const std::string rest = little_endian(std::uint64_t{contents.size()}) + contents;
  return std::string(kMagic) + version + little_endian(crc_of(version, rest)) + rest;
}

proto::Checkpoint parsed(std::string_view bytes) {
  const std::string_view contents = open_envelope(bytes);
  proto::Checkpoint message;
  if (contents.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) ||
      !message.ParseFromArray(contents.data(), static_cast<int>(contents.size()))) {
    throw CheckpointError("found contents that are no checkpoint message");
  }
  return message;
}

proto::Checkpoint checked(std::string_view bytes, const Owner& owner) {
  proto::Checkpoint message = parsed(bytes);
  check_gyro(message, owner);
  check_layout(message);
  check_learned_with(message, owner, Agreement::kAll);
  return message;
}

// But for what is of one layout.
compensation::LearnerState kernels_of(const proto::Checkpoint& message) {
  compensation::LearnerState state{.epoch = message.epoch()};
  if (message.kernels_size() != static_cast<int>(state.kernels.size()))
    throw CheckpointError("found a wrong number of kernels");
  for (std::size_t i = 0; i < state.kernels.size(); ++i) {
    const auto& chosen = message.kernels(static_cast<int>(i));
    if (chosen.kind() > kLastKernel) throw CheckpointError("found a kernel that nobody knows");
    state.kernels[i] = {.kernel = {.kind = static_cast<regression::KernelKind>(chosen.kind()),
                                   .gamma = chosen.gamma(),
                                   .degree = chosen.degree(),
                                   .offset = chosen.offset()},
                        .epsilon = chosen.epsilon()};
  }
  return state;
}

compensation::LearnerState learner_of(proto::Checkpoint& message) {
  if (message.learner().empty()) throw CheckpointError("found nothing that a learner knew");
  compensation::LearnerState state = kernels_of(message);
  state.bytes = std::move(*message.mutable_learner());
  state.boot = message.boot();
  state.saved_unix_s = message.saved_unix_s();
  return state;
}

void check_path(const proto::Checkpoint& message, const Owner& owner) {
  if (message.producer() != kProducer) {
    throw CheckpointError("found a state of " + message.producer() + ", expected one of " +
                          kProducer);
  }
  check_options("a state", message.path_options(), option_values(owner.options, Decides::kAnswers),
                Agreement::kAll);
}

}  // namespace

std::string encode(const Owner& owner, const compensation::LearnerState& state) {
  if (!state.is_whole) {
    throw CheckpointError(
        "found numbers in what was learned that no learner can begin with, expected finite ones: "
        "nothing is saved, and what was saved before stays");
  }
  return enveloped(message_of(owner, state));
}

compensation::LearnerState decode(std::string_view bytes, const Owner& owner) {
  proto::Checkpoint message = checked(bytes, owner);
  return learner_of(message);
}

compensation::LearnerState decode_kernels(std::string_view bytes, const Owner& owner) {
  const proto::Checkpoint message = parsed(bytes);
  check_gyro(message, owner);
  check_learned_with(message, owner, Agreement::kKnownToBoth);
  compensation::LearnerState state = kernels_of(message);
  state.epoch += 1;  // another model than the saved one
  return state;
}

std::string encode_running(const Owner& owner, const compensation::LearnerState& state,
                           std::string data_path, const std::string& prior) {
  proto::Checkpoint message = message_of(owner, state);
  message.set_prior(prior);
  put(option_values(owner.options, Decides::kAnswers), *message.mutable_path_options());
  message.set_data_path(std::move(data_path));
  return enveloped(message);
}

std::string prior_of_running(std::string_view bytes) {
  return parsed(bytes).prior();
}

std::unique_ptr<compensation::Compensator> decode_running(std::string_view bytes,
                                                          const Owner& owner) {
  proto::Checkpoint message = checked(bytes, owner);
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
