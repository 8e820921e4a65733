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

// Far more than there are, few enough to bound memory.
constexpr std::size_t kMostParticipants = 1024;
constexpr std::size_t kMostInterfaces = 8;

// RTPS 2.3, 8.3.3 and 9.4; DDS Security 1.1, 7.3.6.
constexpr std::size_t kHeaderSize = 20;
constexpr std::size_t kPrefixAt = 8;
constexpr std::size_t kSubmessageHeaderSize = 4;
constexpr std::size_t kSmallestData = 20;
constexpr std::size_t kStatisticsSize = 56;
constexpr std::size_t kVendorAt = 6;
constexpr std::size_t kCryptoHeaderSize = 20;  // transformation, session and vector

enum Submessage : std::uint8_t {
  kPad = 0x01,
  kInfoTimestamp = 0x09,
  kInfoDestination = 0x0e,
  kData = 0x15,
  kSecureBody = 0x30,
  kSecurePrefix = 0x31,
  kSecurePostfix = 0x32,
  kSecureMessagePrefix = 0x33,
  kSecureMessagePostfix = 0x34,
  kStatistics = 0x80  // Fast DDS puts one behind each message: when it was sent
};
constexpr std::uint32_t kDiscoveryWriter = 0x000100c2;  // SPDP
constexpr std::uint32_t kStatelessWriter = 0x000201c3;  // authentication

struct Part {
  std::uint8_t id = 0;
  std::span<const std::uint8_t> body{};
};

// Splits into submessages; none where lengths don't fit.
class Parts {
 public:
  explicit Parts(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  [[nodiscard]] bool done() const { return rest_.empty(); }
  std::optional<Part> next() {
    if (rest_.size() < kSubmessageHeaderSize) return std::nullopt;
    Part part;
    part.id = rest_[0];
    const bool little = (rest_[1] & 1U) != 0;
    std::size_t length = little ? std::size_t{rest_[2]} | std::size_t{rest_[3]} << 8U
                                : std::size_t{rest_[2]} << 8U | std::size_t{rest_[3]};
    rest_ = rest_.subspan(kSubmessageHeaderSize);
    // 0: up to the end, except where nothing is the content.
    if (length == 0 && part.id != kInfoTimestamp && part.id != kPad) length = rest_.size();
    if (length > rest_.size()) return std::nullopt;
    // Each begins at a multiple of 4; Fast DDS rounds up where it looks for statistics.
    if (length % 4 != 0 && length != rest_.size()) return std::nullopt;
    part.body = rest_.first(length);
    rest_ = rest_.subspan(length);
    return part;
  }

 private:
  std::span<const std::uint8_t> rest_;
};

std::uint32_t writer_of(const Part& data) {
  std::uint32_t id = 0;
  std::memcpy(&id, data.body.data() + 8, sizeof id);
  return ntohl(id);
}

bool is_encrypted_message(Parts parts) {
  const auto prefix = parts.next();
  if (!prefix || prefix->id != kSecureMessagePrefix || prefix->body.size() != kCryptoHeaderSize) {
    return false;
  }
  const auto body = parts.next();
  if (!body || body->id != kSecureBody) return false;
  const auto postfix = parts.next();
  if (!postfix || postfix->id != kSecureMessagePostfix) return false;
  if (parts.done()) return true;
  const auto last = parts.next();
  return last && last->id == kStatistics && last->body.size() == kStatisticsSize && parts.done();
}

}  // namespace

bool is_well_formed(std::span<const std::uint8_t> datagram) noexcept {
  if (datagram.size() <= kHeaderSize) return false;
  if (std::memcmp(datagram.data(), "RTPS", 4) != 0) return false;
  constexpr std::array<std::uint8_t, 2> kFastDds{1, 15};
  const bool of_fast_dds = std::memcmp(datagram.data() + kVendorAt, kFastDds.data(), 2) == 0;
  Parts parts(datagram.subspan(kHeaderSize));
  while (!parts.done()) {
    const auto part = parts.next();
    if (!part) return false;
    if (part->id != kStatistics || !of_fast_dds) continue;
    if (part->body.size() != kStatisticsSize || !parts.done()) return false;
  }
  return true;
}

DatagramKind classify(std::span<const std::uint8_t> datagram) noexcept {
  if (datagram.size() <= kHeaderSize) return DatagramKind::kForeign;
  if (std::memcmp(datagram.data(), "RTPS", 4) != 0) return DatagramKind::kForeign;
  Parts parts(datagram.subspan(kHeaderSize));
  if (is_encrypted_message(parts)) return DatagramKind::kProtected;
  std::optional<DatagramKind> kind;
  std::uint8_t before = 0;
  while (!parts.done()) {
    const auto part = parts.next();
    if (!part || before == kStatistics) return DatagramKind::kForeign;
    std::optional<DatagramKind> found = kind;
    if (part->id == kData) {
      if (part->body.size() < kSmallestData) return DatagramKind::kForeign;
      const std::uint32_t writer = writer_of(*part);
      if (writer != kDiscoveryWriter && writer != kStatelessWriter) return DatagramKind::kForeign;
      found = writer == kDiscoveryWriter ? DatagramKind::kDiscovery : DatagramKind::kHandshake;
    } else if (part->id == kSecurePrefix) {
      if (part->body.size() != kCryptoHeaderSize) return DatagramKind::kForeign;
      found = DatagramKind::kHandshake;
    } else if (part->id == kSecureBody) {
      if (before != kSecurePrefix) return DatagramKind::kForeign;
    } else if (part->id == kSecurePostfix) {
      if (before != kSecureBody) return DatagramKind::kForeign;
    } else if (part->id == kStatistics) {
      if (part->body.size() != kStatisticsSize) return DatagramKind::kForeign;
    } else if (part->id != kInfoTimestamp && part->id != kInfoDestination) {
      return DatagramKind::kForeign;
    }
    // Never two kinds in one datagram: the stricter rule can't be slipped past.
    if (kind && found != kind) return DatagramKind::kForeign;
    kind = found;
    before = part->id;
  }
  if (before == kSecurePrefix || before == kSecureBody) return DatagramKind::kForeign;
  return kind.value_or(DatagramKind::kForeign);
}

std::string text_of(const rtps::Locator_t& locator) {
  return rtps::IPLocator::toIPv4string(locator) + ':' +
         std::to_string(rtps::IPLocator::getPhysicalPort(locator));
}

void SecurityNotices::add(const std::string& code, std::string text) {
  const std::lock_guard lock(mutex_);
  SecurityNotice& notice = notices_[code];
  notice.code = code;
  notice.text = std::move(text);
  ++notice.count;
}

std::vector<SecurityNotice> SecurityNotices::take() {
  const std::lock_guard lock(mutex_);
  std::vector<SecurityNotice> taken;
  for (auto& [code, notice] : notices_) taken.push_back(std::move(notice));
  notices_.clear();
  return taken;
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

Announcers::Verdict Announcers::judge(const ParticipantPrefix& prefix,
                                      const rtps::Locator_t& from) {
  const auto known = addresses_.find(prefix);
  if (known == addresses_.end()) {
    if (addresses_.size() >= kMostParticipants) return Verdict::kTooMany;
    addresses_[prefix] = {from};
    return Verdict::kGenuine;
  }
  auto& addresses = known->second;
  if (std::find(addresses.begin(), addresses.end(), from) != addresses.end()) {
    return Verdict::kGenuine;
  }
  // A participant has one sending socket for each interface: another port of an address that is
  // known is somebody else's.
  const bool same_address = std::any_of(
      addresses.begin(), addresses.end(),
      [&](const auto& address) { return rtps::IPLocator::compareAddress(address, from); });
  if (same_address || addresses.size() >= kMostInterfaces) return Verdict::kImpostor;
  addresses.push_back(from);
  return Verdict::kGenuine;
}

bool PacketGuard::lets_in(std::span<const std::uint8_t> datagram, const rtps::Locator_t& to,
                          const rtps::Locator_t& from) {
  if (rule_ == Rule::kWellFormed) {
    if (is_well_formed(datagram)) return true;
    notices_->add("packet_refused", "a datagram from " + text_of(from) + " is malformed");
    return false;
  }
  switch (classify(datagram)) {
    case DatagramKind::kProtected:
      return is_new(datagram, to, from);
    case DatagramKind::kDiscovery:
      return is_genuine(datagram, from);
    case DatagramKind::kHandshake:
      return true;
    case DatagramKind::kForeign:
      break;
  }
  notices_->add("packet_refused", "a datagram from " + text_of(from) + " is not protected");
  return false;
}

void PacketGuard::forget(const ParticipantPrefix& prefix) {
  const std::lock_guard lock(mutex_);
  announcers_.forget(prefix);
}

bool PacketGuard::is_new(std::span<const std::uint8_t> datagram, const rtps::Locator_t& to,
                         const rtps::Locator_t& from) {
  {
    const std::lock_guard lock(mutex_);
    if (!recent_.saw(datagram, to.port)) return true;
  }
  notices_->add("packet_replayed", "a datagram from " + text_of(from) + " was here before");
  return false;
}

bool PacketGuard::is_genuine(std::span<const std::uint8_t> datagram, const rtps::Locator_t& from) {
  ParticipantPrefix prefix{};
  std::copy_n(datagram.begin() + kPrefixAt, prefix.size(), prefix.begin());
  Announcers::Verdict verdict{};
  {
    const std::lock_guard lock(mutex_);
    verdict = announcers_.judge(prefix, from);
  }
  if (verdict == Announcers::Verdict::kGenuine) return true;
  notices_->add("packet_refused", "an announcement from " + text_of(from) +
                                      (verdict == Announcers::Verdict::kImpostor
                                           ? " is in another participant's name"
                                           : " is of one participant too many"));
  return false;
}
}  // namespace zerodrift::dds
