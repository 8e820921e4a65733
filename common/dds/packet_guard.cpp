// SPDX-License-Identifier: Apache-2.0
#include "common/dds/packet_guard.h"

#include <arpa/inet.h>
#include <fastrtps/utils/IPLocator.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <random>
#include <utility>

namespace zerodrift::dds {

namespace rtps = eprosima::fastrtps::rtps;

namespace {

// DDS Security 1.1, 7.3.6.
constexpr std::size_t kStatisticsSize = 56;
constexpr std::size_t kCryptoHeaderSize = 20;           // transformation, session and vector
constexpr std::uint32_t kDiscoveryWriter = 0x000100c2;  // SPDP
constexpr std::uint32_t kStatelessWriter = 0x000201c3;  // authentication
// A discovery server that is started again has its old name.
constexpr std::chrono::seconds kNameIsFreeAfter{10};

ParticipantPrefix prefix_of(std::span<const std::uint8_t> datagram) {
  ParticipantPrefix prefix{};
  std::copy_n(datagram.begin() + rtps_message::kPrefixAt, prefix.size(), prefix.begin());
  return prefix;
}

bool has_header(std::span<const std::uint8_t> datagram) {
  return datagram.size() > rtps_message::kHeaderSize &&
         std::memcmp(datagram.data(), "RTPS", 4) == 0;
}

bool is_encrypted_message(rtps_message::Submessages parts) {
  const auto prefix = parts.next();
  if (!prefix || prefix->id != rtps_message::kSecureMessagePrefix ||
      prefix->body.size() != kCryptoHeaderSize) {
    return false;
  }
  const auto body = parts.next();
  if (!body || body->id != rtps_message::kSecureBody) return false;
  const auto postfix = parts.next();
  if (!postfix || postfix->id != rtps_message::kSecureMessagePostfix) return false;
  if (parts.done()) return true;
  const auto last = parts.next();
  return last && last->id == rtps_message::kStatistics && last->body.size() == kStatisticsSize &&
         parts.done();
}

}  // namespace

bool is_well_formed(std::span<const std::uint8_t> datagram) noexcept {
  if (!has_header(datagram)) return false;
  constexpr std::array<std::uint8_t, 2> kFastDds{1, 15};
  const bool of_fast_dds =
      std::memcmp(datagram.data() + rtps_message::kVendorAt, kFastDds.data(), 2) == 0;
  rtps_message::Submessages parts(datagram.subspan(rtps_message::kHeaderSize));
  while (!parts.done()) {
    const auto part = parts.next();
    if (!part || !rtps_message::statement_of(*part)) return false;
    if (part->id != rtps_message::kStatistics || !of_fast_dds) continue;
    if (part->body.size() != kStatisticsSize || !parts.done()) return false;
  }
  return true;
}

DatagramKind classify(std::span<const std::uint8_t> datagram) noexcept {
  if (!has_header(datagram)) return DatagramKind::kForeign;
  rtps_message::Submessages parts(datagram.subspan(rtps_message::kHeaderSize));
  if (is_encrypted_message(parts)) return DatagramKind::kProtected;
  std::optional<DatagramKind> kind;
  std::uint8_t before = 0;
  while (!parts.done()) {
    const auto part = parts.next();
    if (!part || before == rtps_message::kStatistics) return DatagramKind::kForeign;
    const auto statement = rtps_message::statement_of(*part);
    if (!statement) return DatagramKind::kForeign;
    std::optional<DatagramKind> found = kind;
    if (part->id == rtps_message::kData) {
      const std::uint32_t writer = statement->writer;
      if (writer != kDiscoveryWriter && writer != kStatelessWriter) return DatagramKind::kForeign;
      found = writer == kDiscoveryWriter ? DatagramKind::kDiscovery : DatagramKind::kHandshake;
    } else if (part->id == rtps_message::kSecurePrefix) {
      if (part->body.size() != kCryptoHeaderSize) return DatagramKind::kForeign;
      found = DatagramKind::kHandshake;
    } else if (part->id == rtps_message::kSecureBody) {
      if (before != rtps_message::kSecurePrefix) return DatagramKind::kForeign;
    } else if (part->id == rtps_message::kSecurePostfix) {
      if (before != rtps_message::kSecureBody) return DatagramKind::kForeign;
    } else if (part->id == rtps_message::kStatistics) {
      if (part->body.size() != kStatisticsSize) return DatagramKind::kForeign;
    } else if (part->id != rtps_message::kInfoTimestamp &&
               part->id != rtps_message::kInfoDestination) {
      return DatagramKind::kForeign;
    }
    // Never two kinds in one datagram: the stricter rule can't be slipped past.
    if (kind && found != kind) return DatagramKind::kForeign;
    kind = found;
    before = part->id;
  }
  if (before == rtps_message::kSecurePrefix || before == rtps_message::kSecureBody)
    return DatagramKind::kForeign;
  return kind.value_or(DatagramKind::kForeign);
}

std::string text_of(const rtps::Locator_t& locator) {
  return rtps::IPLocator::toIPv4string(locator) + ':' +
         std::to_string(rtps::IPLocator::getPhysicalPort(locator));
}

std::uint64_t RecentDatagrams::random_key() {
  std::random_device source;
  return std::uint64_t{source()} << 32U | source();
}

std::uint64_t RecentDatagrams::hash_of(std::span<const std::uint8_t> bytes,
                                       std::uint32_t port) const {
  constexpr std::uint64_t kMultiplier = 0x9e3779b97f4a7c15U;  // 2^64 / golden ratio, odd
  std::uint64_t hash = key_ ^ (port * kMultiplier);
  while (!bytes.empty()) {
    std::uint64_t word = 0;
    const std::size_t size = std::min(bytes.size(), sizeof word);
    std::memcpy(&word, bytes.data(), size);
    hash = (hash ^ word) * kMultiplier;
    hash ^= hash >> 32U;
    bytes = bytes.subspan(size);
  }
  return hash == 0 ? 1 : hash;
}

bool RecentDatagrams::saw(std::span<const std::uint8_t> datagram, std::uint32_t port) {
  const std::uint64_t hash = hash_of(datagram, port);
  Set& set = sets_[hash % sets_.size()];
  if (std::find(set.hashes.begin(), set.hashes.end(), hash) != set.hashes.end()) return true;
  set.hashes[set.next] = hash;
  set.next = (set.next + 1) % kWays;
  return false;
}

PacketGuard::PacketGuard(Rule rule, std::shared_ptr<SecurityNotices> notices)
    : rule_(rule),
      notices_(std::move(notices)),
      recent_(rule == Rule::kSecured ? kSets : 0),
      senders_(rule == Rule::kSecured ? std::nullopt : std::optional(kNameIsFreeAfter)) {}

bool PacketGuard::lets_in(std::span<const std::uint8_t> datagram, const rtps::Locator_t& to,
                          const rtps::Locator_t& from, Time now) {
  const Verdict verdict = rule_ == Rule::kPlain ? judge_plain(datagram, from, now)
                                                : judge_secured(datagram, to, from, now);
  if (verdict == Verdict::kFine) return true;
  report(verdict, from);
  return false;
}

PacketGuard::Verdict PacketGuard::judge_plain(std::span<const std::uint8_t> datagram,
                                              const rtps::Locator_t& from, Time now) {
  if (!is_well_formed(datagram)) return Verdict::kMalformed;
  ParticipantPrefix speaker = prefix_of(datagram);
  const std::lock_guard lock(mutex_);
  Verdict verdict = judge_sender(speaker, from, now);
  rtps_message::Submessages parts(datagram.subspan(rtps_message::kHeaderSize));
  while (verdict == Verdict::kFine && !parts.done()) {
    const rtps_message::Submessage part = *parts.next();
    if (part.id == rtps_message::kInfoSource) {
      speaker = rtps_message::source_of(part);
      verdict = judge_sender(speaker, from, now);
    } else if (!sequences_.takes(speaker, *rtps_message::statement_of(part), now)) {
      verdict = Verdict::kLeap;
    }
  }
  return verdict;
}

PacketGuard::Verdict PacketGuard::judge_secured(std::span<const std::uint8_t> datagram,
                                                const rtps::Locator_t& to,
                                                const rtps::Locator_t& from, Time now) {
  const DatagramKind kind = classify(datagram);
  if (kind == DatagramKind::kForeign) return Verdict::kMalformed;
  const std::lock_guard lock(mutex_);
  if (kind == DatagramKind::kProtected)
    return recent_.saw(datagram, to.port) ? Verdict::kReplayed : Verdict::kFine;
  return judge_sender(prefix_of(datagram), from, now);
}

PacketGuard::Verdict PacketGuard::judge_sender(const ParticipantPrefix& prefix,
                                               const rtps::Locator_t& from, Time now) {
  switch (senders_.judge(prefix, from, now)) {
    case SenderTable::Verdict::kImpostor: return Verdict::kImpostor;
    case SenderTable::Verdict::kTooMany: return Verdict::kTooMany;
    case SenderTable::Verdict::kGenuine: break;
  }
  return Verdict::kFine;
}

void PacketGuard::report(Verdict verdict, const rtps::Locator_t& from) {
  const auto why = [&]() -> const char* {
    switch (verdict) {
      case Verdict::kMalformed:
        return rule_ == Rule::kPlain ? " is malformed" : " is not protected";
      case Verdict::kImpostor: return " is in another participant's name";
      case Verdict::kTooMany: return " is of one unknown participant too many";
      case Verdict::kLeap: return " leaps ahead of all that its endpoint said before";
      case Verdict::kReplayed:
      case Verdict::kFine: break;
    }
    return " was here before";
  };
  notices_->add(verdict == Verdict::kReplayed ? "packet_replayed" : "packet_refused",
                "a datagram from " + text_of(from) + why());
}

void PacketGuard::know(const ParticipantPrefix& prefix) {
  const std::lock_guard lock(mutex_);
  senders_.know(prefix);
  if (rule_ == Rule::kPlain) sequences_.expect_participant(prefix);
}

void PacketGuard::forget(const ParticipantPrefix& prefix) {
  const std::lock_guard lock(mutex_);
  senders_.forget(prefix);
  sequences_.forget_participant(prefix);
}

void PacketGuard::expect_endpoint(const ParticipantPrefix& prefix, std::uint32_t entity) {
  const std::lock_guard lock(mutex_);
  if (rule_ == Rule::kPlain) sequences_.expect(prefix, entity);
}

void PacketGuard::forget_endpoint(const ParticipantPrefix& prefix, std::uint32_t entity) {
  const std::lock_guard lock(mutex_);
  sequences_.forget(prefix, entity);
}

}  // namespace zerodrift::dds
