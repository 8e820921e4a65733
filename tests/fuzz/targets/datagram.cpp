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

  // The same twice, then from another port.
  std::vector<bool> hear(Bytes datagram) {
    ++port;
    if (datagram.size() >= kPrefixAt + dds::ParticipantPrefix{}.size()) {
      dds::ParticipantPrefix prefix{};
      std::copy_n(datagram.begin() + kPrefixAt, prefix.size(), prefix.begin());
      guard.forget(prefix);
    }
    std::vector<bool> verdicts;
    for (const std::uint32_t from : {1U, 1U, 2U})
      verdicts.push_back(guard.lets_in(datagram, loopback(port), loopback(from)));
    check_told(verdicts);
    return verdicts;
  }

 private:
  void check_told(const std::vector<bool>& verdicts) const {
    std::uint64_t told = 0;
    for (const auto& notice : notices->take()) {
      demand_one_line(notice.text);
      told += notice.count;
    }
    const auto refused = std::count(verdicts.begin(), verdicts.end(), false);
    demand(told == static_cast<std::uint64_t>(refused), "what is refused is told");
  }

  std::shared_ptr<dds::SecurityNotices> notices;
  PacketGuard guard;
  std::uint32_t port = 0;
};

std::vector<bool> expected(DatagramKind kind) {
  switch (kind) {
    case DatagramKind::kProtected:
      return {true, false, false};
    case DatagramKind::kDiscovery:
      return {true, true, false};
    case DatagramKind::kHandshake:
      return {true, true, true};
    case DatagramKind::kForeign:
      break;
  }
  return {false, false, false};
}

}  // namespace

void datagram(Bytes input) {
  static Participant plain(PacketGuard::Rule::kWellFormed);
  static Participant secured(PacketGuard::Rule::kSecured);
  const bool well_formed = dds::is_well_formed(input);
  demand(plain.hear(input) == std::vector<bool>(3, well_formed),
         "a plain participant hears what is well formed, however often");
  const DatagramKind kind = dds::classify(input);
  demand(secured.hear(input) == expected(kind),
         "a secured one hears what is encrypted once, an announcement from one sender, and keys");
  demand(kind == DatagramKind::kForeign || well_formed,
         "what a secured participant hears is well formed");
}

}  // namespace zerodrift::fuzz
