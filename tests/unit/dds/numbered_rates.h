// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "common/dds/participant.h"

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

}  // namespace zerodrift::dds
