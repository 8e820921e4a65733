// SPDX-License-Identifier: Apache-2.0
// When a participant that has just come knows everybody who was there before it.
#pragma once

#include <cstdint>

#include "common/dds/discovery.h"

namespace zerodrift::recording {

// The middleware finds participants within tenths of a second, and announces their endpoints again
// after a second where that was lost (the heartbeat of its built-in writers): a pause alone
// does not say that nothing more comes while somebody's writers are not known. One thread.
class DiscoveryComplete {
 public:
  // What is known at a time (monotonic, ns), and how many of one's readers' writers are matched:
  // with security that comes later. True once nothing changed for half a second and each
  // participant's writers are known, or after three seconds: one may have none.
  bool note(const dds::Acquaintance& known, int matched, std::int64_t now_ns) noexcept {
    if (began_ns_ == kUnset) began_ns_ = now_ns;
    if (changed_ns_ == kUnset || !(known == known_) || matched != matched_) {
      known_ = known;
      matched_ = matched;
      changed_ns_ = now_ns;
    }
    const bool rests = now_ns - changed_ns_ >= kRestNs;
    return rests && (known.unfinished == 0 || now_ns - began_ns_ >= kLongestNs);
  }

 private:
  static constexpr std::int64_t kUnset = -1;
  static constexpr std::int64_t kRestNs = 500'000'000;
  static constexpr std::int64_t kLongestNs = 3'000'000'000;

  std::int64_t began_ns_ = kUnset;
  std::int64_t changed_ns_ = kUnset;
  dds::Acquaintance known_{};
  int matched_ = 0;
};

}  // namespace zerodrift::recording
