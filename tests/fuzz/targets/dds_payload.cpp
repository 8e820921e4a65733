// SPDX-License-Identifier: Apache-2.0
// Input: one byte, the message's place in dds::AllMessages, then the payload of a sample as it
// comes over the network, its encapsulation included.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "common/dds/checked_type_support.h"
#include "common/dds/conversions.h"
#include "tests/fuzz/expectations.h"

namespace zerodrift::fuzz {
namespace {

using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

template <typename Message>
std::vector<std::uint8_t> written(Message& message) {
  dds::CheckedTypeSupport<Message> type;
  SerializedPayload_t payload(type.getSerializedSizeProvider(&message)());
  demand(type.serialize(&message, &payload), "a message that was read can be written");
  demand(payload.length <= type.m_typeSize, "a message that was read is within its type's bounds");
  return {payload.data, payload.data + payload.length};
}

template <typename Message>
bool read(Bytes bytes, Message& message) {
  SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  dds::CheckedTypeSupport<Message> type;
  if (!type.deserialize(&payload, &message)) return false;
  InstanceHandle_t key;
  static_cast<void>(type.getKey(&message, &key, false));
  return true;
}

bool is_sound(const core::AngularRateSample& sample) {
  bool sound = std::isfinite(sample.interval_s) && sample.interval_s >= 0.0 &&
               sample.clock <= core::ClockSource::kSimulation;
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    sound = sound && (!sample.valid[i] || std::isfinite(sample.rate_radps[i]));
  return sound;
}

bool is_sound(const core::TemperatureSample& sample) {
  return sample.clock <= core::ClockSource::kSimulation;
}

bool is_sound(const core::EnvironmentSample& sample) {
  bool sound = sample.clock <= core::ClockSource::kSimulation;
  for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
    const double value = core::channel(sample.values, i);
    sound =
        sound && (std::isfinite(value) ? core::has_channel(sample.channels, i) : value != value);
  }
  return sound;
}

bool is_sound(const core::RateReferenceSample& sample) {
  bool sound = sample.kind <= core::ReferenceKind::kNavigationResidual;
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    sound = sound && (!sample.valid[i] ||
                      (std::isfinite(sample.rate_radps[i]) && sample.variance[i] >= 0.0));
  }
  return sound;
}

bool is_sound(const core::CompensatedSample& sample) {
  return is_sound(sample.raw);
}

msg::AngularRate as_message(const core::AngularRateSample& sample) {
  return dds::to_message(sample, 1, 0);
}

msg::Temperature as_message(const core::TemperatureSample& sample) {
  return dds::to_message(sample, 1);
}

msg::Environment as_message(const core::EnvironmentSample& sample) {
  return dds::to_message(sample, 1);
}

msg::RateReference as_message(const core::RateReferenceSample& sample) {
  return dds::to_message(sample, 1);
}

msg::CompensatedRate as_message(const core::CompensatedSample& sample) {
  msg::CompensatedRate message;
  dds::to_message(sample, 1, 0, message);
  return message;
}

// What conversion changes, it changes once.
template <typename Message>
void check_conversion(const Message& message) {
  const auto sample = dds::from_message(message);
  demand(is_sound(sample), "a converted sample keeps what its type promises");
  Message once = as_message(sample);
  Message twice = as_message(dds::from_message(once));
  demand(written(once) == written(twice), "a sample that was converted converts to itself");
}

template <typename Message>
void check(Bytes bytes) {
  Message message;
  if (!read(bytes, message)) return;
  const auto first = written(message);
  Message again;
  demand(read(first, again), "a message that was written can be read");
  demand(written(again) == first, "a message is written as it was read");
  if constexpr (requires { dds::from_message(message); }) check_conversion(message);
}

constexpr auto kChecks = []<typename... Message>(std::type_identity<std::tuple<Message...>>) {
  return std::array{check<Message>...};
}(std::type_identity<dds::AllMessages>{});

}  // namespace

void dds_payload(Bytes input) {
  if (input.empty() || input.front() >= kChecks.size()) return;
  kChecks[input.front()](input.subspan(1));
}

}  // namespace zerodrift::fuzz
