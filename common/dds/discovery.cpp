// SPDX-License-Identifier: Apache-2.0
#include "common/dds/discovery.h"

#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <unistd.h>

#include <algorithm>
#include <fastdds/dds/core/policy/ParameterTypes.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <sstream>
#include <tuple>

#include "common/dds/participant.h"

namespace zerodrift::dds {

bool is_endless(std::chrono::nanoseconds duration) noexcept {
  return duration.count() >= eprosima::fastrtps::c_TimeInfinite.to_ns();
}

}  // namespace zerodrift::dds

namespace zerodrift::dds::detail {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using Kind = EndpointEvent::Kind;

namespace {

constexpr std::size_t kMostPending = 256;
constexpr std::size_t kMostRemotes = 65536;  // that are known by name and terms
constexpr std::size_t kWritersNamed = 3;

template <typename Qos>
Terms terms(const Qos& qos) {
  return {.reliability = static_cast<int>(qos.m_reliability.kind),
          .durability = static_cast<int>(qos.m_durability.kind),
          .liveliness = static_cast<int>(qos.m_liveliness.kind),
          .ownership = static_cast<int>(qos.m_ownership.kind),
          .deadline_ns = qos.m_deadline.period.to_ns(),
          .lease_ns = qos.m_liveliness.lease_duration.to_ns()};
}

std::string offers(Direction direction) {
  return direction == Direction::kWriter ? "offers " : "asks for ";
}

std::string hexadecimal(const rtps::GuidPrefix_t& prefix) {
  std::ostringstream text;
  text << prefix;
  return text.str();
}

}  // namespace

// ---------------------------------------- the middleware's threads

void Discovery::on_participant_discovery(fdds::DomainParticipant*,
                                         rtps::ParticipantDiscoveryInfo&& found) {
  using Info = rtps::ParticipantDiscoveryInfo;
  const Prefix prefix = found.info.m_guid.guidPrefix;
  const std::lock_guard lock(mutex_);
  if (found.status == Info::DISCOVERED_PARTICIPANT ||
      found.status == Info::CHANGED_QOS_PARTICIPANT) {
    Peer peer{.name = found.info.m_participantName.to_string(), .process = {}};
    for (const auto& property : found.info.m_properties) {
      if (property.first() == fdds::parameter_policy_physical_data_process)
        peer.process = "pid " + property.second();
    }
    if (peers_.size() < kMostRemotes) peers_[prefix] = std::move(peer);
    for (const auto& property : found.info.m_properties)
      if (property.first() == kSharedMemoryProperty)
        compare_shared_memory(prefix, property.second());
    return;
  }
  if (found.status == Info::DROPPED_PARTICIPANT) {
    add(nullptr, {.kind = Kind::kPeerLost,
                  .peer = name_of(prefix),
                  .detail = description_of(prefix) + " is silent; it did not say that it ends"});
  }
  peers_.erase(prefix);
  std::erase_if(remotes_, [&](const auto& entry) { return entry.first.guidPrefix == prefix; });
  std::erase_if(reported_unmet_,
                [&](const auto& reported) { return reported.second.guidPrefix == prefix; });
}

void Discovery::compare_shared_memory(const Prefix& prefix, const std::string& place) {
  if (!shared_memory_) return;
  std::string reason =
      why_not_shared(*shared_memory_, SharedMemoryPlace::parse(place), description_of(prefix));
  if (reason.empty()) return;
  add(nullptr,
      {.kind = Kind::kSharedMemoryNotShared, .peer = name_of(prefix), .detail = std::move(reason)});
}

// The middleware reports the participant's own endpoints too, but not of the participant.
void Discovery::note_own(const fdds::DomainParticipant* participant, const Prefix& prefix) {
  if (participant == nullptr || participant->guid().guidPrefix != prefix) return;
  own_ = prefix;
  peers_.try_emplace(prefix, Peer{.name = participant->get_qos().name().to_string(),
                                  .process = "pid " + std::to_string(::getpid())});
}

void Discovery::on_publisher_discovery(fdds::DomainParticipant* participant,
                                       rtps::WriterDiscoveryInfo&& found) {
  const auto& info = found.info;
  const std::lock_guard lock(mutex_);
  note_own(participant, info.guid().guidPrefix);
  if (found.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER) return gone(info.guid());
  note_remote(info.guid(), {.topic = info.topicName().to_string(),
                            .type = info.typeName().to_string(),
                            .direction = Direction::kWriter,
                            .terms = terms(info.m_qos),
                            .strength = info.m_qos.m_ownershipStrength.value,
                            .is_in_partition = !info.m_qos.m_partition.empty()});
}

void Discovery::on_subscriber_discovery(fdds::DomainParticipant* participant,
                                        rtps::ReaderDiscoveryInfo&& found) {
  const auto& info = found.info;
  const std::lock_guard lock(mutex_);
  note_own(participant, info.guid().guidPrefix);
  if (found.status == rtps::ReaderDiscoveryInfo::REMOVED_READER) return gone(info.guid());
  note_remote(info.guid(), {.topic = info.topicName().to_string(),
                            .type = info.typeName().to_string(),
                            .direction = Direction::kReader,
                            .terms = terms(info.m_qos),
                            .is_in_partition = !info.m_qos.m_partition.empty()});
}

void Discovery::note_remote(const Guid& guid, Remote remote) {
  for (const Endpoint* endpoint : endpoints_) compare_types(*endpoint, guid, remote);
  if (remotes_.size() < kMostRemotes) remotes_.insert_or_assign(guid, std::move(remote));
}

void Discovery::gone(const Guid& guid) {
  remotes_.erase(guid);
  std::erase_if(reported_unmet_, [&](const auto& reported) { return reported.second == guid; });
}

// The middleware passes over an endpoint of another type without a word.
void Discovery::compare_types(const Endpoint& endpoint, const Guid& guid, const Remote& remote) {
  if (remote.topic != endpoint.spec.name || remote.type == endpoint.spec.type) return;
  if (remote.direction == endpoint.direction) return;
  if (!reported_unmet_.insert({&endpoint, guid}).second) return;
  add(&endpoint,
      {.kind = Kind::kTypeMismatch,
       .topic = endpoint.spec.name,
       .peer = name_of(guid.guidPrefix),
       .detail = description_of(guid.guidPrefix) +
                 (remote.direction == Direction::kWriter ? " writes " : " reads ") + remote.type +
                 ", here it is " + std::string(endpoint.spec.type) + "; no sample passes"});
}

void Discovery::note(const Endpoint& endpoint, Kind kind, const Guid& peer, std::string detail,
                     std::uint32_t gyro_id) {
  const std::lock_guard lock(mutex_);
  const bool is_of_peer = peer != Guid::unknown();
  add(&endpoint,
      {.kind = kind,
       .topic = endpoint.spec.name,
       .peer = is_of_peer ? name_of(peer.guidPrefix) : std::string(),
       .detail = is_of_peer ? description_of(peer.guidPrefix) + " " + detail : std::move(detail),
       .gyro_id = gyro_id});
}

void Discovery::note_unmet(const Endpoint& endpoint, const std::string& policy) {
  const Terms ours = terms_of(endpoint.spec);
  const bool is_writer = endpoint.direction == Direction::kWriter;
  const std::lock_guard lock(mutex_);
  bool reported = false;
  for (const auto& [guid, remote] : remotes_) {
    if (remote.direction == endpoint.direction || remote.topic != endpoint.spec.name) continue;
    const auto policies = is_writer ? unmet(ours, remote.terms) : unmet(remote.terms, ours);
    if (policies.empty()) continue;
    reported = true;
    if (!reported_unmet_.insert({&endpoint, guid}).second) continue;
    for (const Policy unmet_policy : policies) {
      add(&endpoint,
          {.kind = Kind::kIncompatibleQos,
           .topic = endpoint.spec.name,
           .peer = name_of(guid.guidPrefix),
           .detail = description_of(guid.guidPrefix) + " " + offers(remote.direction) +
                     name(unmet_policy) + " " + described(unmet_policy, remote.terms) + ", this " +
                     (is_writer ? "writer " : "reader ") + offers(endpoint.direction) +
                     described(unmet_policy, ours) + "; no sample passes"});
    }
  }
  if (reported) return;
  add(&endpoint,
      {.kind = Kind::kIncompatibleQos,
       .topic = endpoint.spec.name,
       .detail = "somebody " + offers(is_writer ? Direction::kReader : Direction::kWriter) +
                 "another " + policy + "; no sample passes"});
}

// ---------------------------------------- the owner's thread

void Discovery::enter(Endpoint& endpoint) {
  const std::lock_guard lock(mutex_);
  endpoints_.push_back(&endpoint);
  for (const auto& [guid, remote] : remotes_) compare_types(endpoint, guid, remote);
}

// What it lost is still reported.
void Discovery::leave(Endpoint& endpoint) {
  const std::lock_guard lock(mutex_);
  add_counted(endpoint);
  std::erase(endpoints_, &endpoint);
  std::erase_if(reported_unmet_, [&](const auto& reported) { return reported.first == &endpoint; });
}

void Discovery::report(const EndpointObserver& otherwise) {
  std::vector<Pending> pending;
  {
    const std::lock_guard lock(mutex_);
    for (Endpoint* endpoint : endpoints_) {
      add_counted(*endpoint);
      add_silences(*endpoint);
    }
    pending.swap(pending_);
  }
  for (const Pending& one : pending) {
    const bool has_observer = one.observer != nullptr && *one.observer;
    const EndpointObserver& observer = has_observer ? *one.observer : otherwise;
    if (observer) observer(one.event);
  }
}

Acquaintance Discovery::acquaintance() {
  const std::lock_guard lock(mutex_);
  std::set<Prefix> with_writers;
  for (const auto& [guid, remote] : remotes_)
    if (remote.direction == Direction::kWriter) with_writers.insert(guid.guidPrefix);
  Acquaintance known{.endpoints = remotes_.size()};
  for (const auto& [prefix, peer] : peers_) {
    if (prefix == own_) continue;
    ++known.peers;
    if (!with_writers.contains(prefix)) ++known.unfinished;
  }
  return known;
}

template <typename Counts>
std::size_t Discovery::count_others(std::string_view topic, Direction ours, Counts counts) {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::count_if(remotes_.begin(), remotes_.end(), [&](const auto& known) {
        const auto& [guid, remote] = known;
        return remote.topic == topic && remote.direction != ours && guid.guidPrefix != own_ &&
               counts(guid, remote);
      }));
}

std::size_t Discovery::counterparts(std::string_view topic, Direction ours) {
  return count_others(topic, ours, [](const Guid&, const Remote&) { return true; });
}

bool Discovery::is_in_partition(const rtps::GUID_t& endpoint) {
  const std::lock_guard lock(mutex_);
  const auto known = remotes_.find(endpoint);
  return known != remotes_.end() && known->second.is_in_partition;
}

std::size_t Discovery::matchable(const TopicSpec& spec, Direction ours) {
  return count_others(spec.name, ours, [&](const Guid& guid, const Remote& remote) {
    return !remote.is_in_partition && seen_from_here(guid, remote, spec).problem.empty();
  });
}

std::vector<RemoteEndpoint> Discovery::remote_endpoints(std::size_t at_most) {
  std::vector<RemoteEndpoint> all;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [guid, remote] : remotes_) {
      const auto* spec = std::find_if(
          kAllTopics.begin(), kAllTopics.end(),
          [&topic = remote.topic](const TopicSpec& known) { return known.name == topic; });
      if (spec == kAllTopics.end()) continue;
      if (all.size() == at_most) break;
      all.push_back(seen_from_here(guid, remote, *spec));
    }
  }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return std::tie(a.topic, a.is_writer, a.process) < std::tie(b.topic, b.is_writer, b.process);
  });
  return all;
}

// What a topic's endpoints offer is what they ask for, so one set of terms is both.
RemoteEndpoint Discovery::seen_from_here(const Guid& guid, const Remote& remote,
                                         const TopicSpec& spec) const {
  const Terms ours = terms_of(spec);
  const bool is_writer = remote.direction == Direction::kWriter;
  RemoteEndpoint endpoint{.topic = remote.topic,
                          .is_writer = is_writer,
                          .process = description_of(guid.guidPrefix),
                          .reliability = described(Policy::kReliability, remote.terms),
                          .durability = durability(remote.terms.durability),
                          .ownership = described(Policy::kOwnership, remote.terms),
                          .ownership_strength = remote.strength,
                          .liveliness = liveliness(remote.terms.liveliness),
                          .lease = std::chrono::nanoseconds(remote.terms.lease_ns),
                          .deadline = std::chrono::nanoseconds(remote.terms.deadline_ns),
                          .problem = {}};
  if (remote.type != spec.type) {
    endpoint.problem = "its type is " + remote.type + ", here it is " + std::string(spec.type);
    return endpoint;
  }
  const auto policies = is_writer ? unmet(remote.terms, ours) : unmet(ours, remote.terms);
  for (const Policy policy : policies) {
    if (!endpoint.problem.empty()) endpoint.problem += "; ";
    endpoint.problem += std::string("it ") + offers(remote.direction) + name(policy) + ' ' +
                        described(policy, remote.terms) + ", here is " +
                        (is_writer ? "asked for " : "offered ") + described(policy, ours);
  }
  return endpoint;
}

void Discovery::add_counted(Endpoint& endpoint) {
  const auto add_new = [&](Kind kind, const std::atomic<std::uint64_t>& counter,
                           std::uint64_t& reported, const std::string& what) {
    const std::uint64_t now = counter.load(std::memory_order_relaxed);
    if (now == reported) return;
    add(&endpoint, {.kind = kind,
                    .topic = endpoint.spec.name,
                    .peer = writers_of(endpoint.spec.name),
                    .detail = what,
                    .count = now - reported});
    reported = now;
  };
  const std::string from = " of " + writers_of(endpoint.spec.name);
  add_new(Kind::kSampleLost, endpoint.samples_lost, endpoint.reported_lost,
          "samples" + from + " were lost on the way");
  add_new(Kind::kSampleRejected, endpoint.samples_rejected, endpoint.reported_rejected,
          "samples" + from + " were rejected: the reader's history is full");
}

void Discovery::add_silences(Endpoint& endpoint) {
  const auto deadline = endpoint.spec.deadline;
  if (deadline.count() == 0) return;
  const std::string longer =
      " nothing for more than " + milliseconds(std::chrono::nanoseconds(deadline).count());
  if (endpoint.deadlines != nullptr) {
    for (const auto& [writer, gyro_id, times] : endpoint.deadlines->silent(deadline)) {
      add(&endpoint, {.kind = Kind::kDeadlineMissed,
                      .topic = endpoint.spec.name,
                      .peer = name_of(writer.guidPrefix),
                      .detail = description_of(writer.guidPrefix) + " sent" + longer,
                      .gyro_id = gyro_id,
                      .count = times});
    }
    return;
  }
  const std::uint64_t times = endpoint.written.take_silences(steady_ns(), deadline);
  if (times == 0) return;
  add(&endpoint, {.kind = Kind::kDeadlineMissed,
                  .topic = endpoint.spec.name,
                  .detail = "this writer wrote" + longer,
                  .count = times});
}

void Discovery::add(const Endpoint* endpoint, EndpointEvent event) {
  const bool is_full = pending_.size() >= kMostPending;
  for (Pending& known : pending_) {
    const bool is_same =
        known.event.kind == event.kind && known.event.topic == event.topic &&
        (is_full || (known.event.peer == event.peer && known.event.gyro_id == event.gyro_id));
    if (!is_same) continue;
    event.count += known.event.count;
    known.event = std::move(event);
    return;
  }
  pending_.push_back({endpoint == nullptr ? nullptr : endpoint->observer, std::move(event)});
}

std::string Discovery::name_of(const Prefix& prefix) const {
  const auto known = peers_.find(prefix);
  return known == peers_.end() || known->second.name.empty() ? "participant " + hexadecimal(prefix)
                                                             : known->second.name;
}

std::string Discovery::description_of(const Prefix& prefix) const {
  const auto known = peers_.find(prefix);
  const bool has_process = known != peers_.end() && !known->second.process.empty();
  return name_of(prefix) + (has_process ? " (" + known->second.process + ")" : "");
}

// The middleware doesn't say whose samples were lost.
std::string Discovery::writers_of(std::string_view topic) const {
  std::set<std::string> names;
  for (const auto& [guid, remote] : remotes_) {
    if (remote.direction == Direction::kWriter && remote.topic == topic)
      names.insert(name_of(guid.guidPrefix));
    if (names.size() == kWritersNamed) break;
  }
  std::string text;
  for (const std::string& one : names) text += (text.empty() ? "" : " or ") + one;
  return text.empty() ? "a writer that is gone" : text;
}

}  // namespace zerodrift::dds::detail
