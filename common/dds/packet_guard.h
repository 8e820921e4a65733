// SPDX-License-Identifier: Apache-2.0
// Decides about each datagram before Fast DDS sees it.
//
// With and without security: lengths and fields must fit (rtps_message.h). One datagram whose
// statistics submessage is not the last ends any process of Debian's Fast DDS 2.9.1
// (read_statistics_submessage: its assertions are compiled in); one DATA_FRAG that announces more
// than it holds makes it read beyond the datagram. And what is not encrypted must come from where
// its participant's datagrams come from (sender_table.h).
//
// Without security: no datagram may move a sequence number or a count too far (sequence_watch.h).
//
// With security: Fast DDS 2.9.1 takes submessages in the clear although the governance wants them
// encrypted (a forged GAP or HEARTBEAT makes a reader skip samples), and believes an announcement,
// and a farewell, in anybody's name. Both end here.
#pragma once

#include <fastdds/rtps/common/Locator.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "common/dds/rtps_message.h"
#include "common/dds/security_notices.h"
#include "common/dds/sender_table.h"
#include "common/dds/sequence_watch.h"

namespace zerodrift::dds {

// What a datagram is by its form alone; says nothing of who made it. RTPS 2.3, 8.3.3 and 9.4; DDS
// Security 1.1, 7.3.6. O(submessages), no allocation.
enum class DatagramKind : std::uint8_t {
  kProtected,  // one encrypted message, to be decrypted and authenticated
  kDiscovery,  // announces a participant, in the clear by the standard
  kHandshake,  // authentication, or keys encrypted for one receiver
  kForeign     // anything else: has no place among secured participants
};
DatagramKind classify(std::span<const std::uint8_t> datagram) noexcept;

// An RTPS message whose submessages fill it exactly, each with fields that can be meant. Messages
// of every vendor pass. O(submessages), no allocation.
bool is_well_formed(std::span<const std::uint8_t> datagram) noexcept;

using ParticipantPrefix = rtps_message::Prefix;

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

// Any thread.
class PacketGuard {
 public:
  using Time = std::chrono::steady_clock::time_point;
  enum class Rule : std::uint8_t { kPlain, kSecured };
  PacketGuard(Rule rule, std::shared_ptr<SecurityNotices> notices);
  // False: to be dropped; reported as packet_refused or packet_replayed.
  bool lets_in(std::span<const std::uint8_t> datagram,
               const eprosima::fastrtps::rtps::Locator_t& to,
               const eprosima::fastrtps::rtps::Locator_t& from, Time now);

  // What discovery reports. A participant is known once it was discovered, with security once it
  // proved who it is; when it is gone its name is free again.
  void know(const ParticipantPrefix& prefix);
  void forget(const ParticipantPrefix& prefix);
  void expect_endpoint(const ParticipantPrefix& prefix, std::uint32_t entity);
  void forget_endpoint(const ParticipantPrefix& prefix, std::uint32_t entity);

 private:
  static constexpr std::size_t kSets = 8192;
  enum class Verdict : std::uint8_t { kFine, kMalformed, kImpostor, kTooMany, kLeap, kReplayed };
  Verdict judge_plain(std::span<const std::uint8_t> datagram,
                      const eprosima::fastrtps::rtps::Locator_t& from, Time now);
  Verdict judge_secured(std::span<const std::uint8_t> datagram,
                        const eprosima::fastrtps::rtps::Locator_t& to,
                        const eprosima::fastrtps::rtps::Locator_t& from, Time now);
  Verdict judge_sender(const ParticipantPrefix& prefix,
                       const eprosima::fastrtps::rtps::Locator_t& from, Time now);
  void report(Verdict verdict, const eprosima::fastrtps::rtps::Locator_t& from);

  Rule rule_;
  std::shared_ptr<SecurityNotices> notices_;
  std::mutex mutex_;
  RecentDatagrams recent_;
  SenderTable senders_;
  SequenceWatch sequences_;
};

// "127.0.0.1:7411"
std::string text_of(const eprosima::fastrtps::rtps::Locator_t& locator);

}  // namespace zerodrift::dds
