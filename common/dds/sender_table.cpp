// SPDX-License-Identifier: Apache-2.0
#include "common/dds/sender_table.h"

#include <fastrtps/utils/IPLocator.h>

#include <algorithm>
#include <utility>

namespace zerodrift::dds {
namespace {

constexpr std::size_t kMostInterfaces = 8;

using eprosima::fastrtps::rtps::IPLocator;

}  // namespace

SenderTable::Verdict SenderTable::judge(const Prefix& prefix, const Source& from, Time now) {
  if (const auto known = known_.find(prefix); known != known_.end())
    return judge_known(known->second, from, now);
  if (const auto newcomer = newcomers_.find(prefix); newcomer != newcomers_.end())
    return judge_known(newcomer->second, from, now);
  return admit(prefix, from, now);
}

SenderTable::Verdict SenderTable::judge_known(Sender& sender, const Source& from, Time now) const {
  for (SeenFrom& seen : sender.sources) {
    if (seen.source == from) {
      seen.at = now;
      return Verdict::kGenuine;
    }
    // A participant has one sending socket for each interface: another port of an address that is
    // known is somebody else's.
    if (!IPLocator::compareAddress(seen.source, from)) continue;
    if (!gives_way_after_ || now - seen.at < *gives_way_after_) return Verdict::kImpostor;
    seen = {from, now};
    return Verdict::kGenuine;
  }
  if (sender.sources.size() >= kMostInterfaces) return Verdict::kImpostor;
  sender.sources.push_back({from, now});
  return Verdict::kGenuine;
}

SenderTable::Verdict SenderTable::admit(const Prefix& prefix, const Source& from, Time now) {
  std::erase_if(newcomers_, [&](const auto& each) { return now - each.second.since >= kNewFor; });
  const auto of_source = std::count_if(newcomers_.begin(), newcomers_.end(), [&](const auto& each) {
    return each.second.sources.front().source == from;
  });
  if (newcomers_.size() >= kMostNewcomers ||
      static_cast<std::size_t>(of_source) >= kMostOfASource) {
    return Verdict::kTooMany;
  }
  newcomers_[prefix] = {.sources = {{from, now}}, .since = now};
  return Verdict::kGenuine;
}

void SenderTable::know(const Prefix& prefix) {
  if (known_.size() >= kMostKnown) return;
  // A discovery server speaks of participants that have sent nothing yet.
  Sender& sender = known_[prefix];
  if (const auto newcomer = newcomers_.find(prefix); newcomer != newcomers_.end()) {
    sender = std::move(newcomer->second);
    newcomers_.erase(newcomer);
  }
}

void SenderTable::forget(const Prefix& prefix) {
  known_.erase(prefix);
  newcomers_.erase(prefix);
}

}  // namespace zerodrift::dds
