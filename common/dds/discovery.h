// SPDX-License-Identifier: Apache-2.0
// Who the other participants are, what their endpoints offer and ask for, and what the middleware
// noticed about ours: gathered on the middleware's threads, reported on the thread that asks.
#pragma once

#include <fastdds/rtps/common/Guid.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/dds/matching_terms.h"
#include "common/dds/shared_memory.h"
#include "common/dds/topics.h"
#include "common/dds/writer_deadlines.h"

namespace zerodrift::dds {

// What the middleware noticed about an endpoint or a peer.
struct EndpointEvent {
  enum class Kind : std::uint8_t {
    kIncompatibleQos,
    kTypeMismatch,  // the topic's name with another type
    kSampleLost,
    kSampleRejected,
    kDeadlineMissed,  // a silence longer than the topic's deadline; reported once for each
    kLivelinessLost,
    kLivelinessRegained,
    kPeerLost,              // no sign of a participant for the participants' lease
    kSharedMemoryNotShared  // both would use it, and no sample would pass
  };
  Kind kind = Kind::kIncompatibleQos;
  std::string_view topic{};   // empty: of a participant, not of an endpoint
  std::string peer{};         // name of the participant at the other end; empty: nobody's
  std::string detail{};       // one clear line
  std::uint32_t gyro_id = 0;  // 0: of no gyro, or not known
  std::uint64_t count = 1;    // how often since it was last reported
};
using EndpointObserver = std::function<void(const EndpointEvent&)>;

// An endpoint of another participant, as it announced itself.
struct RemoteEndpoint {
  std::string topic{};
  bool is_writer = false;
  std::string process{};  // its participant's name, with "(pid N)" where it says that
  std::string reliability{};
  std::string durability{};
  std::string ownership{};
  std::uint32_t ownership_strength = 0;  // of a writer
  std::string liveliness{};
  std::chrono::nanoseconds lease{0};     // the longest there is: none
  std::chrono::nanoseconds deadline{0};  // as lease
  std::string problem{};  // why no sample passes between it and this system's endpoints; or empty
};
// Of a duration that has no end.
[[nodiscard]] bool is_endless(std::chrono::nanoseconds duration) noexcept;

enum class Direction : std::uint8_t { kWriter, kReader };

// How far discovery has come. A participant is found first, its endpoints are announced afterwards.
struct Acquaintance {
  std::size_t peers = 0;       // other participants
  std::size_t unfinished = 0;  // of these: no writer of theirs is known yet
  std::size_t endpoints = 0;   // of all participants
  bool operator==(const Acquaintance&) const = default;
};

namespace detail {

// One endpoint of this participant. The counts are the receiving thread's: no lock, no memory.
struct Endpoint {
  Endpoint(const TopicSpec& of, Direction is, EndpointObserver observes)
      : spec(of),
        direction(is),
        observer(std::make_shared<const EndpointObserver>(std::move(observes))) {}

  const TopicSpec& spec;
  Direction direction;
  std::shared_ptr<const EndpointObserver> observer;
  std::atomic<std::uint64_t> samples_lost{0};
  std::atomic<std::uint64_t> samples_rejected{0};
  std::uint64_t reported_lost = 0;  // by Discovery::report()
  std::uint64_t reported_rejected = 0;
  DeadlineWatch written{};               // a writer's own samples
  WriterDeadlines* deadlines = nullptr;  // a reader's
};

// Under this name participants announce where their shared memory is.
inline constexpr const char* kSharedMemoryProperty = "zerodrift.shared_memory";

// The participant's one listener. Set it with an empty status mask: discovery is reported all the
// same, and samples stay with their readers.
class Discovery final : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  void on_participant_discovery(
      eprosima::fastdds::dds::DomainParticipant*,
      eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& found) override;
  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant*,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& found) override;
  void on_subscriber_discovery(eprosima::fastdds::dds::DomainParticipant*,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& found) override;

  // An endpoint is there from before it is created until after it is deleted.
  void enter(Endpoint& endpoint);
  void leave(Endpoint& endpoint);

  // From the endpoints' listeners, on any thread of the middleware; takes memory, so never once a
  // sample.
  void note(const Endpoint& endpoint, EndpointEvent::Kind kind,
            const eprosima::fastrtps::rtps::GUID_t& peer, std::string detail,
            std::uint32_t gyro_id = 0);
  // The middleware says that it does not let an endpoint of a peer match ours, not which peer.
  void note_unmet(const Endpoint& endpoint, const std::string& policy);

  // Gives each event to its endpoint's observer, or to `otherwise` where that is empty. Not from a
  // listener.
  void report(const EndpointObserver& otherwise);

  // What is known of the others' endpoints of this system's topics, by topic and process; at most
  // so many. Any thread.
  [[nodiscard]] std::vector<RemoteEndpoint> remote_endpoints(std::size_t at_most);
  // Whom this participant knows of, and how far. Any thread.
  [[nodiscard]] Acquaintance acquaintance();
  // The others' endpoints on a topic, at the other end than `ours`. Any thread.
  [[nodiscard]] std::size_t counterparts(std::string_view topic, Direction ours);
  [[nodiscard]] bool is_in_partition(const eprosima::fastrtps::rtps::GUID_t& endpoint);
  // Those of them that an endpoint of ours of this topic can match, outside of partitions.
  [[nodiscard]] std::size_t matchable(const TopicSpec& spec, Direction ours);
  // This participant uses shared memory; to be called before it is created.
  void set_shared_memory(SharedMemoryPlace place) { shared_memory_ = std::move(place); }

 private:
  struct Peer {
    std::string name;
    std::string process;  // "pid 4711"; empty: it doesn't say
  };
  struct Remote {
    std::string topic;
    std::string type;
    Direction direction;
    Terms terms;
    std::uint32_t strength = 0;
    bool is_in_partition = false;
  };
  struct Pending {
    std::shared_ptr<const EndpointObserver> observer;
    EndpointEvent event;
  };
  using Guid = eprosima::fastrtps::rtps::GUID_t;
  using Prefix = eprosima::fastrtps::rtps::GuidPrefix_t;

  template <typename Counts>
  std::size_t count_others(std::string_view topic, Direction ours, Counts counts);

  // All below: under the lock.
  void note_remote(const Guid& guid, Remote remote);
  void note_own(const eprosima::fastdds::dds::DomainParticipant* participant, const Prefix& prefix);
  void gone(const Guid& guid);
  void compare_types(const Endpoint& endpoint, const Guid& guid, const Remote& remote);
  void add(const Endpoint* endpoint, EndpointEvent event);
  void add_counted(Endpoint& endpoint);
  void add_silences(Endpoint& endpoint);
  void compare_shared_memory(const Prefix& prefix, const std::string& place);
  [[nodiscard]] std::string name_of(const Prefix& prefix) const;
  [[nodiscard]] std::string description_of(const Prefix& prefix) const;
  [[nodiscard]] std::string writers_of(std::string_view topic) const;
  [[nodiscard]] RemoteEndpoint seen_from_here(const Guid& guid, const Remote& remote,
                                              const TopicSpec& spec) const;

  std::mutex mutex_;              // held for a look-up or a push; no observer is called under it
  std::map<Prefix, Peer> peers_;  // this participant among them, once it has an endpoint
  std::optional<Prefix> own_;
  std::optional<SharedMemoryPlace> shared_memory_;
  std::map<Guid, Remote> remotes_;
  std::vector<Endpoint*> endpoints_;
  std::set<std::pair<const Endpoint*, Guid>> reported_unmet_;
  std::vector<Pending> pending_;
};

}  // namespace detail
}  // namespace zerodrift::dds
