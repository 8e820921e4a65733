// SPDX-License-Identifier: Apache-2.0
// A participant has one type support of a type; its readers and writers use it from any thread.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "common/dds/checked_type_support.h"
#include "common/dds/raw_reader.h"

namespace zerodrift::dds {
namespace {

using eprosima::fastrtps::rtps::InstanceHandle_t;

constexpr int kRounds = 50000;

// As `support` is used: by several threads, each with an instance of its own. How many handles were
// not what one thread alone gets.
template <typename Sample>
int wrong_handles(eprosima::fastdds::dds::TopicDataType& support, std::vector<Sample> samples) {
  std::vector<InstanceHandle_t> alone(samples.size());
  for (std::size_t k = 0; k < samples.size(); ++k) {
    if (!support.getKey(&samples[k], &alone[k], false)) return -1;
    for (std::size_t other = 0; other < k; ++other) {
      if (alone[other] == alone[k]) return -1;
    }
  }
  std::vector<int> wrong(samples.size(), 0);
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    threads.emplace_back([&, k] {
      for (int round = 0; round < kRounds; ++round) {
        InstanceHandle_t handle;
        const bool has_key = support.getKey(&samples[k], &handle, false);
        wrong[k] += has_key && handle == alone[k] ? 0 : 1;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  int sum = 0;
  for (const int one : wrong) sum += one;
  return sum;
}

std::vector<msg::AngularRate> rates() {
  std::vector<msg::AngularRate> out(3);
  for (std::size_t k = 0; k < out.size(); ++k) out[k].gyro_id(static_cast<std::uint32_t>(k + 1));
  return out;
}

// A key longer than a handle, of which a digest is made.
std::vector<msg::ServiceStatus> statuses() {
  std::vector<msg::ServiceStatus> out(3);
  for (std::size_t k = 0; k < out.size(); ++k)
    out[k].service("compensation/" + std::to_string(k + 1));
  return out;
}

TEST(TypeSupport, HandlesOfThreadsBesideEachOtherAreRight) {
  CheckedTypeSupport<msg::AngularRate> of_rates;
  EXPECT_EQ(wrong_handles(of_rates, rates()), 0);
  CheckedTypeSupport<msg::ServiceStatus> of_statuses;
  EXPECT_EQ(wrong_handles(of_statuses, statuses()), 0);
}

TEST(TypeSupport, SoTheyAreWhereTheBytesAreKept) {
  std::vector<RawSample<msg::ServiceStatus>> samples;
  for (const msg::ServiceStatus& status : statuses()) samples.push_back({.message = status});
  RawTypeSupport<msg::ServiceStatus> raw;
  EXPECT_EQ(wrong_handles(raw, samples), 0);
}

}  // namespace
}  // namespace zerodrift::dds
