// SPDX-License-Identifier: Apache-2.0
// Decides about each datagram before Fast DDS sees it.
//
// With and without security: lengths must fit. One datagram whose statistics submessage is not the
// last ends any process of Debian's Fast DDS 2.9.1 (read_statistics_submessage: its assertions are
// compiled in).
//
// With security: Fast DDS 2.9.1 takes submessages in the clear although the governance wants them
// encrypted (a forged GAP or HEARTBEAT makes a reader skip samples), and believes an announcement,
// and a farewell, in anybody's name. Both end here.
#pragma once

#include <fastdds/rtps/common/Locator.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace zerodrift::dds {

// What was refused since the last time somebody asked.
struct SecurityNotice {
  std::string code;  // participant_refused, packet_refused, packet_replayed or security_warning
  std::string text;  // one line on the newest
  std::uint64_t count = 0;
};

// Any thread. One entry a code: bounded, whatever arrives.
class SecurityNotices {
 public:
  void add(const std::string& code, std::string text);
  // Each notice once.
  std::vector<SecurityNotice> take();

 private:
  std::mutex mutex_;
  std::map<std::string, SecurityNotice> notices_;
};

// What a datagram is by its form alone; says nothing of who made it. RTPS 2.3, 8.3.3 and 9.4; DDS
// Security 1.1, 7.3.6. O(submessages), no allocation.
enum class DatagramKind : std::uint8_t {
  kProtected,  // one encrypted message, to be decrypted and authenticated
  kDiscovery,  // announces a participant, in the clear by the standard
  kHandshake,  // authentication, or keys encrypted for one receiver
  kForeign     // anything else: has no place among secured participants
};
DatagramKind classify(std::span<const std::uint8_t> datagram) noexcept;

// An RTPS message whose submessages fill it exactly. Asks for no more, so that every vendor's
// messages pass. O(submessages), no allocation.
bool is_well_formed(std::span<const std::uint8_t> datagram) noexcept;

// The first 12 bytes of every GUID of a participant.
using ParticipantPrefix = std::array<std::uint8_t, 12>;

// Datagrams of the last while by a keyed 64-bit hash: 8 in a set, whose oldest gives way; 65536 of
// them in 8192 sets. An encrypted message carries a random vector, so an honest sender never sends
// the same bytes twice. Two collide by chance with 8 / 2^64 for each datagram. 0.6 MB; O(size).
class RecentDatagrams {
 public:
  explicit RecentDatagrams(std::size_t sets) : sets_(sets) {}
  // True if these bytes came to this port before; noted either way.
  bool saw(std::span<const std::uint8_t> datagram, std::uint32_t port);

 private:
  static constexpr std::size_t kWays = 8;
  struct Set {
    std::array<std::uint64_t, kWays> hashes{};  // 0: empty
    std::size_t next = 0;
  };
  [[nodiscard]] std::uint64_t hash_of(std::span<const std::uint8_t> bytes,
                                      std::uint32_t port) const;

  std::uint64_t key_ = random_key();
  std::vector<Set> sets_;
  static std::uint64_t random_key();
};

// Where each participant's announcements come from. The first to use a GUID keeps it, so that
// nobody else on a host that is already known says farewell, or another address, in its name.
class Announcers {
 public:
  enum class Verdict : std::uint8_t { kGenuine, kImpostor, kTooMany };
  Verdict judge(const ParticipantPrefix& prefix, const eprosima::fastrtps::rtps::Locator_t& from);
  void forget(const ParticipantPrefix& prefix) { addresses_.erase(prefix); }

 private:
  std::map<ParticipantPrefix, std::vector<eprosima::fastrtps::rtps::Locator_t>> addresses_;
};

// Any thread.
class PacketGuard {
 public:
  enum class Rule : std::uint8_t { kWellFormed, kSecured };
  PacketGuard(Rule rule, std::shared_ptr<SecurityNotices> notices)
      : rule_(rule), notices_(std::move(notices)), recent_(rule == Rule::kSecured ? kSets : 0) {}
  // False: to be dropped; told as packet_refused or packet_replayed.
  bool lets_in(std::span<const std::uint8_t> datagram,
               const eprosima::fastrtps::rtps::Locator_t& to,
               const eprosima::fastrtps::rtps::Locator_t& from);
  // To be called when a participant is gone: its GUID is free again.
  void forget(const ParticipantPrefix& prefix);

 private:
  static constexpr std::size_t kSets = 8192;
  bool is_new(std::span<const std::uint8_t> datagram, const eprosima::fastrtps::rtps::Locator_t& to,
              const eprosima::fastrtps::rtps::Locator_t& from);
  bool is_genuine(std::span<const std::uint8_t> datagram,
                  const eprosima::fastrtps::rtps::Locator_t& from);

  Rule rule_;
  std::shared_ptr<SecurityNotices> notices_;
  std::mutex mutex_;
  RecentDatagrams recent_;
  Announcers announcers_;
};

// "127.0.0.1:7411"
std::string text_of(const eprosima::fastrtps::rtps::Locator_t& locator);

}  // namespace zerodrift::dds
