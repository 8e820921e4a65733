// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>

#include "common/dds/participant.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::dds {

// A reader of rates that are numbered from 1 on.
class NumberedRates {
 public:
  explicit NumberedRates(Participant& participant)
      : reader_(participant, [this](const msg::AngularRate& message, const SampleOrigin&) {
          if (message.sequence_number() != received_ + 1) ++wrong_;
          ++received_;
        }) {}
  [[nodiscard]] int matched() const { return reader_.matched(); }
  [[nodiscard]] std::uint64_t received() const { return received_; }
  [[nodiscard]] std::uint64_t wrong() const { return wrong_; }  // not the next, or again

 private:
  std::atomic<std::uint64_t> received_{0};
  std::atomic<std::uint64_t> wrong_{0};
  Reader<msg::AngularRate> reader_;
};

// Every one of so many samples arrives once and in order, from one participant to another.
inline void expect_all_delivered(const NetworkOptions& network, std::uint64_t samples) {
  constexpr std::uint64_t kBurst = kSampleDepth / 2;  // on their way at once: half of the history
  Participant here("writer", network);
  Participant there("reader", network);
  const NumberedRates rates(there);
  Writer<msg::AngularRate> writer(here);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && rates.matched() == 1; }));
  msg::AngularRate message;
  message.gyro_id(1);
  for (std::uint64_t sequence = 1; sequence <= samples; ++sequence) {
    message.sequence_number(sequence);
    ASSERT_TRUE(writer.write(message)) << "at " << sequence;
    if (sequence % kBurst == 0) {
      ASSERT_TRUE(writer.wait_until_received(std::chrono::seconds(5))) << "at " << sequence;
    }
  }
  EXPECT_TRUE(eventually([&] { return rates.received() == samples; }))
      << rates.received() << " received";
  EXPECT_EQ(rates.wrong(), 0U);
}

}  // namespace zerodrift::dds
