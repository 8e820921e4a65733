// SPDX-License-Identifier: Apache-2.0
#include "common/dds/participant.h"

#include <arpa/inet.h>
#include <fastdds/rtps/attributes/ServerAttributes.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <fastdds/dds/core/policy/ParameterTypes.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <iterator>
#include <mutex>
#include <optional>
#include <system_error>

namespace zerodrift::dds {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::Duration_t;

namespace {

constexpr std::uint32_t kLargestDomain = 232;
constexpr const char* kLoopback = "127.0.0.1";
// Participants that discovery looks for on each peer: every one has its own port.
constexpr std::uint32_t kParticipantsPerHost = 40;

Duration_t duration(std::chrono::milliseconds ms) {
  return {static_cast<std::int32_t>(ms.count() / 1000),
          static_cast<std::uint32_t>(ms.count() % 1000) * 1000000U};
}

rtps::Locator_t locator(const std::string& address) {
  rtps::Locator_t result;
  result.kind = LOCATOR_KIND_UDPv4;
  result.port = 0;
  // IPLocator would take "999.1.1.1" for 231.1.1.1.
  in_addr checked{};
  if (inet_pton(AF_INET, address.c_str(), &checked) != 1 ||
      !rtps::IPLocator::setIPv4(result, address)) {
    throw DdsError("dds: '" + address + "' is not an IPv4 address; expected e.g. 192.168.0.10");
  }
  return result;
}

// Delivery within a process would run a reader's callback inside write(); every service here is its
// own process, and tests stand for processes.
void set_library_defaults_once() {
  static std::once_flag once;
  std::call_once(once, [] {
    eprosima::fastrtps::LibrarySettingsAttributes settings;
    settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
    eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
    fdds::Log::SetVerbosity(fdds::Log::Error);
  });
}

// Fast DDS goes on without a word where none of the named interfaces exists.
void check_exists(const std::string& interface) {
  const rtps::Locator_t wanted = locator(interface);
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) throw DdsError("dds: cannot list the interfaces of this machine");
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(all, &freeifaddrs);
  for (const ifaddrs* entry = all; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    sockaddr_in address{};
    std::memcpy(&address, entry->ifa_addr, sizeof address);
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
    if (rtps::IPLocator::compareAddress(locator(text.data()), wanted)) return;
  }
  throw DdsError("dds: no interface of this machine has address " + interface);
}

constexpr const char* kDefaultServerPort = "11811";  // the middleware's own default

struct ServerAddress {
  std::string address;
  std::string port;
};

ServerAddress server_address(const std::string& text) {
  const auto colon = text.find(':');
  ServerAddress server{text.substr(0, colon),
                       colon == std::string::npos ? kDefaultServerPort : text.substr(colon + 1)};
  unsigned port = 0;
  const char* end = server.port.data() + server.port.size();
  const auto parsed = std::from_chars(server.port.data(), end, port);
  if (parsed.ec != std::errc{} || parsed.ptr != end || port == 0 || port > 65535) {
    throw DdsError("dds: discovery server '" + text +
                   "': expected IPv4 or IPv4:PORT, e.g. 192.168.0.10:11811");
  }
  locator(server.address);  // throws where it is no address
  return server;
}

// The servers of the list, each under the name that its place gives it.
rtps::RemoteServerList_t servers(const NetworkOptions& network) {
  std::string list;
  for (const auto& text : network.discovery_servers) {
    const auto [address, port] = server_address(text);
    if (network.interfaces.empty() && !rtps::IPLocator::isLocal(locator(address))) {
      throw DdsError("dds: discovery server " + text +
                     " is beyond this machine: name an interface");
    }
    list += (list.empty() ? "" : ";") + address + ':' + port;
  }
  rtps::RemoteServerList_t found;
  if (!rtps::load_environment_server_info(list, found)) {
    throw DdsError("dds: the middleware does not take the discovery servers '" + list + "'");
  }
  return found;
}

// Fast DDS 2.9.1 ends the process by an assertion where a server and a secured participant meet.
void discover_through_servers(const NetworkOptions& network, fdds::DomainParticipantQos& qos) {
  if (!network.security_dir.empty()) {
    throw DdsError(
        "dds: with security there are no discovery servers, which the middleware does not secure; "
        "expected --peer ADDRESS for each other computer");
  }
  auto& builtin = qos.wire_protocol().builtin;
  builtin.initialPeersList.clear();
  auto& known = builtin.discovery_config.m_DiscoveryServers;
  known = servers(network);
  if (!network.serves) {
    builtin.discovery_config.discoveryProtocol = rtps::DiscoveryProtocol_t::CLIENT;
    return;
  }
  if (*network.serves >= network.discovery_servers.size()) {
    throw DdsError("dds: discovery server " + std::to_string(*network.serves) +
                   " is not in the list of " + std::to_string(network.discovery_servers.size()) +
                   "; the first is 0");
  }
  const std::string own_address =
      server_address(network.discovery_servers[*network.serves]).address;
  check_exists(own_address);
  if (!network.interfaces.empty() && std::find(network.interfaces.begin(), network.interfaces.end(),
                                               own_address) == network.interfaces.end()) {
    throw DdsError("dds: this discovery server's own address " + own_address +
                   " is none of the interfaces named");
  }
  builtin.discovery_config.discoveryProtocol = rtps::DiscoveryProtocol_t::SERVER;
  const auto own = std::next(known.begin(), static_cast<std::ptrdiff_t>(*network.serves));
  qos.wire_protocol().prefix = own->guidPrefix;
  builtin.metatrafficUnicastLocatorList = own->metatrafficUnicastLocatorList;
  known.erase(own);
}

// Beside UDP, which keeps discovery and what goes to other computers.
SharedMemoryPlace add_shared_memory(const NetworkOptions& network,
                                    fdds::DomainParticipantQos& qos) {
  if (!network.security_dir.empty()) {
    throw DdsError(
        "dds: with security the transport is udp: what goes through shared memory is "
        "not checked datagram by datagram");
  }
  remove_stale_segments();
  check_shared_memory(network.domain);
  auto memory = std::make_shared<eprosima::fastdds::rtps::SharedMemTransportDescriptor>();
  memory->maxInitialPeersRange = kParticipantsPerHost;
  memory->segment_size(kSegmentBytes);
  qos.transport().user_transports.push_back(memory);
  // Without named ones the middleware announces those of both transports.
  qos.wire_protocol().default_unicast_locator_list.clear();
  SharedMemoryPlace place = SharedMemoryPlace::here();
  qos.properties().properties().emplace_back(detail::kSharedMemoryProperty, place.text(), true);
  return place;
}

void confine_to(const NetworkOptions& network, fdds::DomainParticipantQos& qos) {
  const bool loopback_only = network.interfaces.empty();
  const std::vector<std::string> interfaces =
      loopback_only ? std::vector<std::string>{kLoopback} : network.interfaces;

  for (const auto& interface : interfaces) check_exists(interface);

  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = interfaces;
  udp->maxInitialPeersRange = kParticipantsPerHost;
  udp->sendBufferSize = 1U << 20U;
  udp->receiveBufferSize = 1U << 20U;
  udp->non_blocking_send = false;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);

  auto& builtin = qos.wire_protocol().builtin;
  std::vector<std::string> peers = network.peers;
  if (!loopback_only) peers.insert(peers.end(), interfaces.begin(), interfaces.end());
  if (loopback_only) peers = {kLoopback};
  for (const auto& peer : peers) builtin.initialPeersList.push_back(locator(peer));
  // Named unicast locators keep the default multicast ones from being added.
  for (const auto& address : interfaces) {
    builtin.metatrafficUnicastLocatorList.push_back(locator(address));
    qos.wire_protocol().default_unicast_locator_list.push_back(locator(address));
  }
  if (!network.discovery_servers.empty()) discover_through_servers(network, qos);
}

bool can_bind(const std::string& address, std::uint32_t port) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return true;  // the middleware says better what is wrong
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(port));
  inet_pton(AF_INET, address.c_str(), &at.sin_addr);
  const bool is_bound = ::bind(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  ::close(socket);
  return is_bound;
}

// The middleware takes a port further up where all of these are taken: there it is looked for by
// nobody, and two of that kind never meet. Servers are told the port.
void check_can_be_found(const NetworkOptions& network, const fdds::DomainParticipantQos& qos) {
  if (!network.discovery_servers.empty()) return;
  const std::string address = network.interfaces.empty() ? kLoopback : network.interfaces.front();
  for (std::uint32_t place = 0; place < kParticipantsPerHost; ++place) {
    const auto port = qos.wire_protocol().port.getUnicastPort(network.domain, place);
    if (can_bind(address, port)) return;
  }
  throw DdsError("dds: domain " + std::to_string(network.domain) + " is full: " + address +
                 " has " + std::to_string(kParticipantsPerHost) +
                 " participants, and others look for no more; take another domain for some, or "
                 "discovery servers");
}

// What an event about this process calls it, beside its name.
void set_process(fdds::DomainParticipantQos& qos) {
  auto& properties = qos.properties().properties();
  const std::string key = fdds::parameter_policy_physical_data_process;
  std::erase_if(properties, [&](const auto& property) { return property.name() == key; });
  properties.emplace_back(key, std::to_string(getpid()), true);
}

fdds::ReliabilityQosPolicyKind reliability(const TopicSpec& spec) {
  return spec.reliability == Reliability::kReliable ? fdds::RELIABLE_RELIABILITY_QOS
                                                    : fdds::BEST_EFFORT_RELIABILITY_QOS;
}

// What both ends of a topic have in common. Liveliness is manual by topic, wherever there is a
// lease; what is offered is what is asked for.
template <typename Qos>
Qos common_qos(const TopicSpec& spec) {
  Qos qos;
  qos.reliability().kind = reliability(spec);
  qos.durability().kind = spec.durability == Durability::kTransientLocal
                              ? fdds::TRANSIENT_LOCAL_DURABILITY_QOS
                              : fdds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = fdds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = spec.depth;
  qos.resource_limits().max_instances = spec.keys;
  qos.resource_limits().max_samples_per_instance = spec.depth;
  qos.resource_limits().max_samples = spec.keys * spec.depth;
  qos.resource_limits().allocated_samples = spec.depth;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
  if (spec.ownership == Ownership::kExclusive) qos.ownership().kind = fdds::EXCLUSIVE_OWNERSHIP_QOS;
  if (spec.lease.count() > 0) {
    qos.liveliness().kind = fdds::MANUAL_BY_TOPIC_LIVELINESS_QOS;
    qos.liveliness().lease_duration = duration(spec.lease);
  }
  return qos;
}

std::string policy_name(fdds::QosPolicyId_t policy) {
  switch (policy) {
    case fdds::RELIABILITY_QOS_POLICY_ID: return "reliability";
    case fdds::DURABILITY_QOS_POLICY_ID: return "durability";
    case fdds::DEADLINE_QOS_POLICY_ID: return "deadline";
    case fdds::LIVELINESS_QOS_POLICY_ID: return "liveliness";
    case fdds::OWNERSHIP_QOS_POLICY_ID: return "ownership";
    default: return "policy " + std::to_string(policy);
  }
}

}  // namespace

Participant::Participant(const std::string& name, const NetworkOptions& network) {
  if (network.domain > kLargestDomain) {
    throw DdsError("dds: domain " + std::to_string(network.domain) + " is not within 0.." +
                   std::to_string(kLargestDomain));
  }
  set_library_defaults_once();
  fdds::DomainParticipantQos qos;
  qos.name(name);
  confine_to(network, qos);
  check_can_be_found(network, qos);
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.initial_announcements.count = 20;
  discovery.initial_announcements.period = Duration_t(0, 50000000);
  discovery.leaseDuration = duration(kParticipantLease);
  discovery.leaseDuration_announcementperiod = duration(kAnnouncementPeriod);

  set_process(qos);
  if (network.transport == Transport::kSharedMemory)
    discovery_.set_shared_memory(add_shared_memory(network, qos));
  is_secured_ = !network.security_dir.empty();
  security_ = is_secured_ ? secure(name, network.security_dir, network.domain, discovery_, qos)
                          : guard_transports(discovery_, qos);

  participant_ = fdds::DomainParticipantFactory::get_instance()->create_participant(
      network.domain, qos, security_->listener(), fdds::StatusMask::none());
  if (participant_ == nullptr && is_secured_) {
    throw DdsError("security: the middleware does not take " + network.security_dir.string() +
                   refusal() + "; are its documents for domain " + std::to_string(network.domain) +
                   '?');
  }
  if (participant_ == nullptr) {
    throw DdsError("dds: cannot create a participant in domain " + std::to_string(network.domain) +
                   "; are the interfaces up and UDP ports free?");
  }
  security_->let_out();
}

Participant::~Participant() {
  participant_->delete_contained_entities();
  fdds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

std::string Participant::refusal() const {
  const std::string reason = is_secured_ ? last_security_error() : "";
  return reason.empty() ? "" : ": " + reason;
}

std::vector<SecurityNotice> Participant::take_security_notices() {
  return security_->take(std::chrono::steady_clock::now());
}

fdds::Publisher* Participant::publisher(const Partitions& partitions) {
  const std::lock_guard lock(groups_mutex_);
  fdds::Publisher*& made = publishers_[partitions];
  if (made == nullptr) {
    fdds::PublisherQos qos;
    for (const auto& name : partitions) qos.partition().push_back(name.c_str());
    made = participant_->create_publisher(qos);
  }
  return made;
}

fdds::Subscriber* Participant::subscriber(const Partitions& partitions) {
  const std::lock_guard lock(groups_mutex_);
  fdds::Subscriber*& made = subscribers_[partitions];
  if (made == nullptr) {
    fdds::SubscriberQos qos;
    for (const auto& name : partitions) qos.partition().push_back(name.c_str());
    made = participant_->create_subscriber(qos);
  }
  return made;
}

fdds::Topic* Participant::topic(const TopicSpec& spec, fdds::TypeSupport type) {
  const std::string name(spec.name);
  if (auto* known = dynamic_cast<fdds::Topic*>(participant_->lookup_topicdescription(name));
      known != nullptr) {
    return known;
  }
  // Without these two, other vendors' participants drop the endpoint.
  type->auto_fill_type_object(false);
  type->auto_fill_type_information(false);
  type.register_type(participant_, std::string(spec.type));
  auto* made = participant_->create_topic(name, std::string(spec.type), fdds::TOPIC_QOS_DEFAULT);
  if (made == nullptr) throw DdsError("dds: cannot create topic '" + name + "'");
  return made;
}

fdds::DataWriter* Participant::make_writer(fdds::Publisher& publisher, const TopicSpec& spec,
                                           const fdds::TypeSupport& type,
                                           fdds::DataWriterListener& listener) {
  fdds::DataWriterQos qos = writer_qos(spec);
  std::optional<NoPreemption> while_its_sender_starts;
  if (is_secured_ && spec.reliability == Reliability::kReliable) {
    fill_no_datagram(qos);
    while_its_sender_starts.emplace();
  }
  auto* made = publisher.create_datawriter(topic(spec, type), qos, &listener);
  if (made != nullptr) return made;
  throw DdsError("dds: cannot create a writer for topic '" + std::string(spec.name) + "'" +
                 refusal());
}

fdds::DataReader* Participant::make_reader(fdds::Subscriber& subscriber, const TopicSpec& spec,
                                           const fdds::TypeSupport& type,
                                           fdds::DataReaderListener& listener) {
  auto* made = subscriber.create_datareader(topic(spec, type), reader_qos(spec), &listener);
  if (made != nullptr) return made;
  throw DdsError("dds: cannot create a reader for topic '" + std::string(spec.name) + "'" +
                 refusal());
}

fdds::DataWriterQos writer_qos(const TopicSpec& spec) {
  auto qos = common_qos<fdds::DataWriterQos>(spec);
  qos.reliability().max_blocking_time = duration(std::chrono::milliseconds(100));
  qos.publish_mode().kind = fdds::SYNCHRONOUS_PUBLISH_MODE;
  if (spec.lifespan.count() > 0) qos.lifespan().duration = duration(spec.lifespan);
  qos.reliable_writer_qos().times.heartbeatPeriod = duration(spec.heartbeat);
  qos.reliable_writer_qos().times.nackResponseDelay = duration(std::chrono::milliseconds(0));
  // A nack of a sample sent less than this ago is not obeyed. Not 0: Fast DDS starts this timer
  // with each sample that finds it stopped, before the datagram goes out, and 0 resumes its event
  // thread with every sample (DECISIONS.md).
  qos.reliable_writer_qos().times.nackSupressionDuration = duration(spec.heartbeat);
  return qos;
}

fdds::DataReaderQos reader_qos(const TopicSpec& spec) {
  auto qos = common_qos<fdds::DataReaderQos>(spec);
  qos.reliable_reader_qos().times.heartbeatResponseDelay = duration(std::chrono::milliseconds(0));
  return qos;
}

namespace detail {
namespace {

std::string ms(std::chrono::milliseconds span) {
  return std::to_string(span.count()) + " ms";
}

}  // namespace

using Kind = EndpointEvent::Kind;

void WriterListener::on_offered_incompatible_qos(fdds::DataWriter*,
                                                 const fdds::OfferedIncompatibleQosStatus& status) {
  discovery_.note_unmet(endpoint_, policy_name(status.last_policy_id));
}

void WriterListener::on_liveliness_lost(fdds::DataWriter*, const fdds::LivelinessLostStatus&) {
  discovery_.note(
      endpoint_, Kind::kLivelinessLost, rtps::GUID_t::unknown(),
      "this writer wrote nothing for " + ms(endpoint_.spec.lease) + ": readers take it for gone");
}

void ReaderListener::on_subscription_matched(fdds::DataReader*,
                                             const fdds::SubscriptionMatchedStatus& status) {
  matched_.store(status.current_count, std::memory_order_release);
  if (status.current_count_change >= 0) return;
  const rtps::GUID_t writer = iHandle2GUID(status.last_publication_handle);
  deadlines_.forget(writer);
  {
    const std::lock_guard lock(silent_mutex_);
    silent_.erase(writer);
  }
  on_writer_gone(writer, Departure::kLeft);
}

// A writer that is deleted counts as one alive less, but not as one not alive more.
void ReaderListener::on_liveliness_changed(fdds::DataReader*,
                                           const fdds::LivelinessChangedStatus& status) {
  const rtps::GUID_t writer = iHandle2GUID(status.last_publication_handle);
  if (status.not_alive_count_change > 0) {
    {
      const std::lock_guard lock(silent_mutex_);
      if (!silent_.insert(writer).second) return;
    }
    discovery_.note(endpoint_, Kind::kLivelinessLost, writer,
                    "wrote nothing for " + ms(endpoint_.spec.lease));
    deadlines_.forget(writer);
    on_writer_gone(writer, Departure::kSilent);
  } else if (status.alive_count_change > 0) {
    {
      const std::lock_guard lock(silent_mutex_);
      if (silent_.erase(writer) == 0) return;  // the first time
    }
    discovery_.note(endpoint_, Kind::kLivelinessRegained, writer, "is back");
  }
}

void ReaderListener::on_requested_incompatible_qos(
    fdds::DataReader*, const fdds::RequestedIncompatibleQosStatus& status) {
  discovery_.note_unmet(endpoint_, policy_name(status.last_policy_id));
}

// These two are the receiving thread's: counted, reported later.
// Of a topic that keeps one sample, what was lost has been replaced by what is newer and says all.
void ReaderListener::on_sample_lost(fdds::DataReader*, const fdds::SampleLostStatus& status) {
  if (endpoint_.spec.depth == 1) return;
  endpoint_.samples_lost.store(static_cast<std::uint64_t>(status.total_count),
                               std::memory_order_relaxed);
}

void ReaderListener::on_sample_rejected(fdds::DataReader*,
                                        const eprosima::fastrtps::SampleRejectedStatus& status) {
  endpoint_.samples_rejected.store(status.total_count, std::memory_order_relaxed);
}

}  // namespace detail
}  // namespace zerodrift::dds
