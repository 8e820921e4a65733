// SPDX-License-Identifier: Apache-2.0
// Where each participant's datagrams come from. The first to use a GUID keeps it, so that no other
// process of a host that is known speaks, or says farewell, in its name.
//
// Names that nobody has vouched for cost nothing to make up: they have places of their own, few for
// each source, that are free again after some seconds. So whoever makes them up takes neither the
// places of known participants nor those of newcomers that send from a socket of their own.
#pragma once

#include <fastdds/rtps/common/Locator.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/dds/rtps_message.h"

namespace zerodrift::dds {

class SenderTable {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Prefix = rtps_message::Prefix;
  using Source = eprosima::fastrtps::rtps::Locator_t;
  enum class Verdict : std::uint8_t { kGenuine, kImpostor, kTooMany };

  static constexpr std::size_t kMostKnown = 1024;
  static constexpr std::size_t kMostNewcomers = 256;
  static constexpr std::size_t kMostOfASource = 8;
  // By then a newcomer has proved itself, or begins anew.
  static constexpr std::chrono::seconds kNewFor{5};

  // `gives_way_after`: of silence, a name may be used from another port of its host: a participant
  // with a fixed name was started again. None: it keeps its name until it is forgotten.
  explicit SenderTable(std::optional<std::chrono::seconds> gives_way_after = {})
      : gives_way_after_(gives_way_after) {}

  // O(log participants), and O(kMostNewcomers) for a name that is new.
  Verdict judge(const Prefix& prefix, const Source& from, Time now);
  // Somebody vouches for it: it is known until it is forgotten.
  void know(const Prefix& prefix);
  void forget(const Prefix& prefix);

 private:
  struct SeenFrom {
    Source source;
    Time at;
  };
  struct Sender {
    std::vector<SeenFrom> sources;  // one for each interface, at most kMostInterfaces
    Time since{};
  };
  Verdict judge_known(Sender& sender, const Source& from, Time now) const;
  Verdict admit(const Prefix& prefix, const Source& from, Time now);

  std::optional<std::chrono::seconds> gives_way_after_;
  std::map<Prefix, Sender> known_;
  std::map<Prefix, Sender> newcomers_;
};

}  // namespace zerodrift::dds
