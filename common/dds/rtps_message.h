// SPDX-License-Identifier: Apache-2.0
// RTPS messages as bytes: their submessages, and what each says of sequence numbers. RTPS 2.3, 8.3
// and 9.4. Nothing here takes memory, nothing reads beyond the bytes it is given.
//
// Stricter than the standard where Fast DDS 2.9.1 trusts a field: a GAP makes it count from its
// start to its end, a DATA_FRAG makes it copy what is not there, a sample size makes it take
// memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace zerodrift::dds::rtps_message {

inline constexpr std::size_t kHeaderSize = 20;
inline constexpr std::size_t kPrefixAt = 8;
inline constexpr std::size_t kVendorAt = 6;

enum Id : std::uint8_t {
  kPad = 0x01,
  kAckNack = 0x06,
  kHeartbeat = 0x07,
  kGap = 0x08,
  kInfoTimestamp = 0x09,
  kInfoSource = 0x0c,
  kInfoDestination = 0x0e,
  kNackFrag = 0x12,
  kHeartbeatFrag = 0x13,
  kData = 0x15,
  kDataFrag = 0x16,
  kSecureBody = 0x30,
  kSecurePrefix = 0x31,
  kSecurePostfix = 0x32,
  kSecureMessagePrefix = 0x33,
  kSecureMessagePostfix = 0x34,
  kStatistics = 0x80  // Fast DDS puts one behind each message: when it was sent
};

// The first 12 bytes of every GUID of a participant.
using Prefix = std::array<std::uint8_t, 12>;

// Sequence numbers end here: 17 years at 2 kHz.
inline constexpr std::uint64_t kLargestSequence = std::uint64_t{1} << 40U;
// The largest sample of any topic is below 64 kB.
inline constexpr std::uint32_t kLargestSample = 1U << 24U;

struct Submessage {
  std::uint8_t id = 0;
  std::uint8_t flags = 0;
  std::span<const std::uint8_t> body{};
};

// Splits what follows the header; none where lengths don't fit.
class Submessages {
 public:
  explicit Submessages(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  [[nodiscard]] bool done() const { return rest_.empty(); }
  std::optional<Submessage> next();

 private:
  std::span<const std::uint8_t> rest_;
};

// What a submessage says of numbers.
struct Statement {
  enum class Of : std::uint8_t {
    kNothing,
    kSamples,          // DATA, DATA_FRAG and HEARTBEAT_FRAG: a writer's
    kHeartbeat,        // a writer's, with a count
    kGap,              // a writer's
    kAcknowledgement,  // a reader's, with a count
    kMissingFragments  // a reader's, with a count of its own
  };
  Of of = Of::kNothing;
  std::uint32_t reader = 0;  // entity ids, as numbers of big-endian bytes
  std::uint32_t writer = 0;
  std::uint64_t newest = 0;  // the largest sequence number that a writer speaks of
  std::uint64_t span = 0;    // of a GAP: numbers from its start to its base
  std::uint32_t count = 0;
};

// None: malformed, or with a field that no sender of ours or of another vendor's puts there. O(1)
// but for the parameters of an inline QoS.
std::optional<Statement> statement_of(const Submessage& submessage);

// Of a whole INFO_SRC: who speaks from there on.
Prefix source_of(const Submessage& info_source);

}  // namespace zerodrift::dds::rtps_message
