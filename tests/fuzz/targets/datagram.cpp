// SPDX-License-Identifier: Apache-2.0
// Input: a datagram as it comes from a socket.
#include <algorithm>
#include <memory>
#include <vector>

#include "common/dds/packet_guard.h"
#include "tests/fuzz/expectations.h"

namespace zerodrift::fuzz {
namespace {

using dds::DatagramKind;
using dds::PacketGuard;
using eprosima::fastrtps::rtps::Locator_t;

constexpr std::size_t kPrefixAt = 8;

Locator_t loopback(std::uint32_t port) {
  Locator_t locator(port);
  locator.address[12] = 127;
  locator.address[15] = 1;
  return locator;
}

// Kept, for a table of what was heard is costly to make; each input has a port of its own, so that
// no other was heard there.
struct Participant {
  explicit Participant(PacketGuard::Rule rule)
      : notices(std::make_shared<dds::SecurityNotices>()), guard(rule, notices) {}

  // The same twice, then from another port; long after the input before, so that names that were
  // made up there are free.
  std::vector<bool> judge(Bytes datagram) {
    ++port;
    now += dds::SenderTable::kNewFor;
    if (datagram.size() >= kPrefixAt + dds::ParticipantPrefix{}.size()) {
      dds::ParticipantPrefix prefix{};
      std::copy_n(datagram.begin() + kPrefixAt, prefix.size(), prefix.begin());
      guard.forget(prefix);
    }
    std::vector<bool> verdicts;
    for (const std::uint32_t from : {1U, 1U, 2U})
      verdicts.push_back(guard.lets_in(datagram, loopback(port), loopback(from), now));
    check_reports(verdicts);
    return verdicts;
  }

 private:
  void check_reports(const std::vector<bool>& verdicts) const {
    std::uint64_t reported = 0;
    for (const auto& notice : notices->take()) {
      demand_one_line(notice.text);
      reported += notice.count;
    }
    const auto refused = std::count(verdicts.begin(), verdicts.end(), false);
    demand(reported == static_cast<std::uint64_t>(refused), "what is refused is told");
  }

  std::shared_ptr<dds::SecurityNotices> notices;
  PacketGuard guard;
  std::uint32_t port = 0;
  PacketGuard::Time now{};
};

std::vector<bool> expected(DatagramKind kind) {
  switch (kind) {
    case DatagramKind::kProtected: return {true, false, false};
    case DatagramKind::kDiscovery:
    case DatagramKind::kHandshake: return {true, true, false};
    case DatagramKind::kForeign: break;
  }
  return {false, false, false};
}

bool speaks_for_others(Bytes datagram) {
  dds::rtps_message::Submessages parts(datagram.subspan(dds::rtps_message::kHeaderSize));
  while (!parts.done()) {
    const auto part = parts.next();
    if (!part) return false;
    if (part->id == dds::rtps_message::kInfoSource) return true;
  }
  return false;
}

}  // namespace

void datagram(Bytes input) {
  static Participant plain(PacketGuard::Rule::kPlain);
  static Participant secured(PacketGuard::Rule::kSecured);
  const bool well_formed = dds::is_well_formed(input);
  const auto plainly = plain.judge(input);
  demand(plainly[0] == plainly[1] && !plainly[2],
         "a plain participant hears the same from the same sender, however often");
  demand(well_formed ? plainly[0] || speaks_for_others(input) : !plainly[0],
         "it hears what is well formed, unless it is in too many names");
  const DatagramKind kind = dds::classify(input);
  demand(secured.judge(input) == expected(kind),
         "a secured one hears what is encrypted once, announcements and keys from one sender");
  demand(kind == DatagramKind::kForeign || well_formed,
         "what a secured participant hears is well formed");
}

}  // namespace zerodrift::fuzz
