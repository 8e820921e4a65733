// SPDX-License-Identifier: Apache-2.0
#include "common/dds/security.h"

#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <fastdds/rtps/flowcontrol/FlowControllerDescriptor.hpp>
#include <iterator>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include "common/dds/packet_guard.h"
#include "common/dds/participant.h"
#include "common/dds/receiving_watch.h"

namespace zerodrift::dds {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
namespace transport = eprosima::fastdds::rtps;

namespace {

using Clock = std::chrono::steady_clock;

// Participants on probation at a time.
constexpr std::size_t kMostOnProbation = 1024;

// ---- the library's log

// That a message can't be decrypted, or an endpoint isn't permitted, the library reports in its log
// alone.
class LogToNotices final : public fdds::LogConsumer {
 public:
  void Consume(const fdds::Log::Entry& entry) override {
    const std::string_view category = entry.context.category;
    if (!category.starts_with("SECURITY")) {
      if (entry.kind == fdds::Log::Error && !is_reported(entry)) standard_error_.Consume(entry);
      return;
    }
    if (entry.message == "No key material yet") return;  // they are on their way
    std::string text = without_source(entry.message);
    if (entry.kind == fdds::Log::Error) {
      const std::lock_guard lock(mutex_);
      last_error_ = text;
    }
    notices_.add("security_warning", std::move(text));
  }
  std::vector<SecurityNotice> take() { return notices_.take(); }
  std::string last_error() {
    fdds::Log::Flush();
    const std::lock_guard lock(mutex_);
    return std::exchange(last_error_, {});
  }

 private:
  // An exception says it, and where to look.
  static bool is_reported(const fdds::Log::Entry& entry) {
    return entry.message.starts_with("Cannot create participant") ||
           entry.message.starts_with("Problem creating ");
  }
  // One line, without "(<file>:<line>)" of the library's own build.
  static std::string without_source(const std::string& message) {
    std::string text = message.substr(0, std::min(message.find(" (./"), message.find(" (/")));
    std::replace(text.begin(), text.end(), '\n', ' ');
    const auto open = std::count(text.begin(), text.end(), '(');
    const auto closed = std::count(text.begin(), text.end(), ')');
    if (open > closed) text += ')';
    return text;
  }

  SecurityNotices notices_;
  std::mutex mutex_;
  std::string last_error_;
  fdds::StdoutErrConsumer standard_error_;
};

// The log is of the process, not of a participant: several in one process share what it says. The
// library owns the consumer and ends with the process.
LogToNotices& library_log() {
  static LogToNotices* const log = [] {
    auto owned = std::make_unique<LogToNotices>();
    LogToNotices* const raw = owned.get();
    fdds::Log::ClearConsumers();
    fdds::Log::RegisterConsumer(std::move(owned));
    fdds::Log::SetVerbosity(fdds::Log::Warning);
    return raw;
  }();
  return *log;
}

// ---- the way in

// What each datagram passes.
struct Entrance {
  Entrance(PacketGuard::Rule rule, std::shared_ptr<SecurityNotices> notices)
      : guard(rule, std::move(notices)) {}
  PacketGuard guard;
  ReceivingWatch receiving;
  std::atomic<bool> may_send{false};
};

class GuardedTransport final : public transport::ChainingTransport {
 public:
  GuardedTransport(const transport::ChainingTransportDescriptor& descriptor,
                   std::shared_ptr<Entrance> entrance)
      : ChainingTransport(descriptor),
        descriptor_(descriptor.low_level_descriptor),
        entrance_(std::move(entrance)) {}

  transport::TransportDescriptorInterface* get_configuration() override {
    return descriptor_.get();
  }
  bool send(rtps::SenderResource* low_sender_resource, const rtps::octet* send_buffer,
            std::uint32_t send_buffer_size, rtps::LocatorsIterator* destination_locators_begin,
            rtps::LocatorsIterator* destination_locators_end,
            const Clock::time_point& timeout) override {
    if (!entrance_->may_send.load(std::memory_order_acquire)) return true;
    return low_sender_resource->send(send_buffer, send_buffer_size, destination_locators_begin,
                                     destination_locators_end, timeout);
  }
  void receive(transport::TransportReceiverInterface* next_receiver,
               const rtps::octet* receive_buffer, std::uint32_t receive_buffer_size,
               const rtps::Locator_t& local_locator,
               const rtps::Locator_t& remote_locator) override {
    const auto now = Clock::now();
    const ReceivingWatch::Passage passage(entrance_->receiving, now);
    if (!entrance_->guard.lets_in({receive_buffer, receive_buffer_size}, local_locator,
                                  remote_locator, now)) {
      return;
    }
    next_receiver->OnDataReceived(receive_buffer, receive_buffer_size, local_locator,
                                  remote_locator);
  }

 private:
  std::shared_ptr<transport::TransportDescriptorInterface> descriptor_;
  std::shared_ptr<Entrance> entrance_;
};

struct GuardedDescriptor final : transport::ChainingTransportDescriptor {
  GuardedDescriptor(std::shared_ptr<transport::TransportDescriptorInterface> low_level,
                    std::shared_ptr<Entrance> its_entrance)
      : ChainingTransportDescriptor(std::move(low_level)), entrance(std::move(its_entrance)) {}
  transport::TransportInterface* create_transport() const override {
    return new GuardedTransport(*this, entrance);  // the library owns it
  }
  std::shared_ptr<Entrance> entrance;
};

// ---- who is there

ParticipantPrefix prefix_of(const rtps::GUID_t& guid) {
  ParticipantPrefix prefix{};
  std::copy_n(std::begin(guid.guidPrefix.value), prefix.size(), prefix.begin());
  return prefix;
}

std::string text_of_participant(const rtps::ParticipantProxyData& data) {
  std::string text = "'" + data.m_participantName.to_string() + "'";
  for (const auto& locator : data.metatraffic_locators.unicast) text += ' ' + text_of(locator);
  return text;
}

// Between the participant and its listener: the guard learns who is there.
class Watch : public SecurityWatch, protected fdds::DomainParticipantListener {
 public:
  Watch(PacketGuard::Rule rule, fdds::DomainParticipantListener& next)
      : next_(next), entrance_(std::make_shared<Entrance>(rule, notices_)) {}
  fdds::DomainParticipantListener* listener() noexcept override { return this; }
  std::vector<SecurityNotice> take(Clock::time_point) override { return notices_->take(); }
  void let_out() noexcept override { entrance_->may_send.store(true, std::memory_order_release); }
  [[nodiscard]] std::optional<std::int64_t> busy_since_ns() const noexcept override {
    return entrance_->receiving.busy_since_ns();
  }
  [[nodiscard]] bool lacks_certificate() const override {
    const std::lock_guard lock(secured_mutex_);
    return !secured_.empty();
  }
  [[nodiscard]] std::shared_ptr<Entrance> entrance() const { return entrance_; }

 protected:
  PacketGuard& guard() noexcept { return entrance_->guard; }
  SecurityNotices& notices() noexcept { return *notices_; }
  // Of one that has no certificates itself. Those who have some neither receive it nor are
  // received, which is no fault of anything else here.
  virtual void came(const rtps::ParticipantProxyData& participant) {
    guard().know(prefix_of(participant.m_guid));
    if (participant.identity_token_.class_id().empty()) return;
    {
      const std::lock_guard lock(secured_mutex_);
      if (secured_.size() < kMostOnProbation) secured_.insert(participant.m_guid);
    }
    notices().add("certificate_missing",
                  "participant " + text_of_participant(participant) +
                      " takes part with certificates only, and this process has none: expected "
                      "--security with its folder of keys and certificates");
  }
  virtual void went(const rtps::GUID_t& participant) {
    guard().forget(prefix_of(participant));
    const std::lock_guard lock(secured_mutex_);
    secured_.erase(participant);
  }

 private:
  void on_participant_discovery(fdds::DomainParticipant* participant,
                                rtps::ParticipantDiscoveryInfo&& info) override {
    switch (info.status) {
      case rtps::ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT: came(info.info); break;
      case rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT:
      case rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT: went(info.info.m_guid); break;
      default: break;
    }
    next_.on_participant_discovery(participant, std::move(info));
  }
  void on_publisher_discovery(fdds::DomainParticipant* participant,
                              rtps::WriterDiscoveryInfo&& info) override {
    expect(info.info.guid(), info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER);
    next_.on_publisher_discovery(participant, std::move(info));
  }
  void on_subscriber_discovery(fdds::DomainParticipant* participant,
                               rtps::ReaderDiscoveryInfo&& info) override {
    expect(info.info.guid(), info.status == rtps::ReaderDiscoveryInfo::REMOVED_READER);
    next_.on_subscriber_discovery(participant, std::move(info));
  }
  void expect(const rtps::GUID_t& guid, bool is_gone) {
    const std::uint32_t entity = guid.entityId.to_uint32();
    if (is_gone) {
      guard().forget_endpoint(prefix_of(guid), entity);
    } else {
      guard().expect_endpoint(prefix_of(guid), entity);
    }
  }

  fdds::DomainParticipantListener& next_;
  std::shared_ptr<SecurityNotices> notices_ = std::make_shared<SecurityNotices>();
  std::shared_ptr<Entrance> entrance_;
  mutable std::mutex secured_mutex_;
  std::set<rtps::GUID_t> secured_;  // others, where this one has no certificates
};

class SecuredWatch final : public Watch {
 public:
  explicit SecuredWatch(fdds::DomainParticipantListener& next)
      : Watch(PacketGuard::Rule::kSecured, next) {}
  std::vector<SecurityNotice> take(Clock::time_point now) override;
  [[nodiscard]] bool awaits_proof() const override {
    const std::lock_guard lock(mutex_);
    return std::any_of(probations_.begin(), probations_.end(),
                       [](const auto& entry) { return !entry.second.reported; });
  }

 private:
  struct Probation {
    Clock::time_point since;
    std::string who;
    bool reported = false;
  };

  void came(const rtps::ParticipantProxyData& participant) override;
  void went(const rtps::GUID_t& participant) override;
  void onParticipantAuthentication(fdds::DomainParticipant*,
                                   rtps::ParticipantAuthenticationInfo&& info) override;
  // Once a participant, however often it tries.
  void refuse(Probation& probation, const std::string& why) {
    if (std::exchange(probation.reported, true)) return;
    notices().add("participant_refused", "participant " + probation.who + ' ' + why);
  }

  mutable std::mutex mutex_;
  std::map<rtps::GUID_t, Probation> probations_;
};

// Known once it has proved who it is, not before.
void SecuredWatch::came(const rtps::ParticipantProxyData& participant) {
  const std::lock_guard lock(mutex_);
  if (probations_.size() >= kMostOnProbation) return;
  const auto [entry, is_new] = probations_.try_emplace(
      participant.m_guid, Probation{Clock::now(), text_of_participant(participant)});
  if (is_new && participant.identity_token_.class_id().empty())
    refuse(entry->second, "has no certificate");
}

void SecuredWatch::went(const rtps::GUID_t& participant) {
  const std::lock_guard lock(mutex_);
  probations_.erase(participant);
  Watch::went(participant);
}

void SecuredWatch::onParticipantAuthentication(fdds::DomainParticipant*,
                                               rtps::ParticipantAuthenticationInfo&& info) {
  const std::lock_guard lock(mutex_);
  const auto found = probations_.find(info.guid);
  if (info.status == rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT) {
    guard().know(prefix_of(info.guid));
    if (found != probations_.end()) probations_.erase(found);
    return;
  }
  if (found != probations_.end()) refuse(found->second, "could not prove who it is");
}

std::vector<SecurityNotice> SecuredWatch::take(Clock::time_point now) {
  {
    // Of two that fail to prove themselves to each other, the library reports only one.
    const std::lock_guard lock(mutex_);
    for (auto& [guid, probation] : probations_) {
      if (now - probation.since >= SenderTable::kNewFor)
        refuse(probation, "did not prove who it is");
    }
  }
  std::vector<SecurityNotice> taken = Watch::take(now);
  for (SecurityNotice& notice : library_log().take()) taken.push_back(std::move(notice));
  return taken;
}

// No more leaves a participant in a period, so that no datagram is full: a fifth less than there is
// room for, for the proofs of some 180 receivers.
constexpr const char* kUnfilled = "unfilled";
constexpr std::int32_t kMostBytes = 50000;
constexpr std::uint64_t kPeriodMs = 2;

void put_in_front(const std::shared_ptr<Entrance>& entrance, fdds::DomainParticipantQos& qos) {
  for (auto& each : qos.transport().user_transports) {
    // What comes by shared memory is of this user's own processes.
    if (dynamic_cast<transport::SharedMemTransportDescriptor*>(each.get()) != nullptr) continue;
    each = std::make_shared<GuardedDescriptor>(each, entrance);
  }
}

}  // namespace

std::shared_ptr<SecurityWatch> guard_transports(fdds::DomainParticipantListener& next,
                                                fdds::DomainParticipantQos& qos) {
  auto watch = std::make_shared<Watch>(PacketGuard::Rule::kPlain, next);
  put_in_front(watch->entrance(), qos);
  return watch;
}

std::shared_ptr<SecurityWatch> secure(const std::string& participant_name,
                                      const std::filesystem::path& folder, std::uint32_t domain,
                                      fdds::DomainParticipantListener& next,
                                      fdds::DomainParticipantQos& qos) {
  auto unfilled = std::make_shared<eprosima::fastdds::rtps::FlowControllerDescriptor>();
  unfilled->name = kUnfilled;
  unfilled->max_bytes_per_period = kMostBytes;
  unfilled->period_ms = kPeriodMs;
  qos.flow_controllers().push_back(std::move(unfilled));
  const SecurityFiles files = find_security_files(folder, security_identity(participant_name),
                                                  domain, std::chrono::system_clock::now());
  library_log().last_error();  // what comes is of this participant
  const auto set = [&](const char* name, const std::string& value) {
    qos.properties().properties().emplace_back(name, value);
  };
  const auto uri = [](const std::filesystem::path& path) {
    return "file://" + std::filesystem::absolute(path).string();
  };
  set("dds.sec.auth.plugin", "builtin.PKI-DH");
  set("dds.sec.auth.builtin.PKI-DH.identity_ca", uri(files.identity_ca));
  set("dds.sec.auth.builtin.PKI-DH.identity_certificate", uri(files.certificate));
  set("dds.sec.auth.builtin.PKI-DH.private_key", uri(files.key));
  set("dds.sec.access.plugin", "builtin.Access-Permissions");
  set("dds.sec.access.builtin.Access-Permissions.permissions_ca", uri(files.permissions_ca));
  set("dds.sec.access.builtin.Access-Permissions.governance", uri(files.governance));
  set("dds.sec.access.builtin.Access-Permissions.permissions", uri(files.permissions));
  set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");

  auto watch = std::make_shared<SecuredWatch>(next);
  put_in_front(watch->entrance(), qos);
  return watch;
}

void fill_no_datagram(fdds::DataWriterQos& qos) {
  qos.publish_mode().kind = fdds::ASYNCHRONOUS_PUBLISH_MODE;
  qos.publish_mode().flow_controller_name = kUnfilled;
}

NoPreemption::NoPreemption() noexcept {
  const sched_param ordinary{};
  is_in_force_ =
      sched_getscheduler(0) == SCHED_OTHER && sched_setscheduler(0, SCHED_BATCH, &ordinary) == 0;
}

NoPreemption::~NoPreemption() {
  const sched_param ordinary{};
  if (is_in_force_) sched_setscheduler(0, SCHED_OTHER, &ordinary);
}

std::string last_security_error() {
  return library_log().last_error();
}

}  // namespace zerodrift::dds
