// SPDX-License-Identifier: Apache-2.0
#include "common/dds/security.h"

#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>

#include <algorithm>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <iterator>
#include <map>
#include <mutex>
#include <utility>

#include "common/dds/participant.h"

namespace zerodrift::dds {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
namespace transport = eprosima::fastdds::rtps;

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kProvesItselfWithin(5);
// Participants on probation at a time.
constexpr std::size_t kMostOnProbation = 1024;

// ---- the library's log

// That a message can't be decrypted, or an endpoint isn't permitted, the library tells in its log
// alone.
class LogToNotices final : public fdds::LogConsumer {
 public:
  void Consume(const fdds::Log::Entry& entry) override {
    const std::string_view category = entry.context.category;
    if (!category.starts_with("SECURITY")) {
      if (entry.kind == fdds::Log::Error && !is_told(entry)) standard_error_.Consume(entry);
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
  static bool is_told(const fdds::Log::Entry& entry) {
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

class GuardedTransport final : public transport::ChainingTransport {
 public:
  GuardedTransport(const transport::ChainingTransportDescriptor& descriptor,
                   std::shared_ptr<PacketGuard> guard)
      : ChainingTransport(descriptor),
        descriptor_(descriptor.low_level_descriptor),
        guard_(std::move(guard)) {}

  transport::TransportDescriptorInterface* get_configuration() override {
    return descriptor_.get();
  }
  bool send(rtps::SenderResource* low_sender_resource, const rtps::octet* send_buffer,
            std::uint32_t send_buffer_size, rtps::LocatorsIterator* destination_locators_begin,
            rtps::LocatorsIterator* destination_locators_end,
            const Clock::time_point& timeout) override {
    return low_sender_resource->send(send_buffer, send_buffer_size, destination_locators_begin,
                                     destination_locators_end, timeout);
  }
  void receive(transport::TransportReceiverInterface* next_receiver,
               const rtps::octet* receive_buffer, std::uint32_t receive_buffer_size,
               const rtps::Locator_t& local_locator,
               const rtps::Locator_t& remote_locator) override {
    if (!guard_->lets_in({receive_buffer, receive_buffer_size}, local_locator, remote_locator)) {
      return;
    }
    next_receiver->OnDataReceived(receive_buffer, receive_buffer_size, local_locator,
                                  remote_locator);
  }

 private:
  std::shared_ptr<transport::TransportDescriptorInterface> descriptor_;
  std::shared_ptr<PacketGuard> guard_;
};

struct GuardedDescriptor final : transport::ChainingTransportDescriptor {
  GuardedDescriptor(std::shared_ptr<transport::TransportDescriptorInterface> low_level,
                    std::shared_ptr<PacketGuard> its_guard)
      : ChainingTransportDescriptor(std::move(low_level)), guard(std::move(its_guard)) {}
  transport::TransportInterface* create_transport() const override {
    return new GuardedTransport(*this, guard);  // the library owns it
  }
  std::shared_ptr<PacketGuard> guard;
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

class Watch final : public SecurityWatch, private fdds::DomainParticipantListener {
 public:
  explicit Watch(fdds::DomainParticipantListener& next) : next_(next) {}
  fdds::DomainParticipantListener* listener() noexcept override { return this; }
  std::vector<SecurityNotice> take(Clock::time_point now) override;
  [[nodiscard]] std::shared_ptr<PacketGuard> guard() const { return guard_; }

 private:
  struct Probation {
    Clock::time_point since;
    std::string who;
    bool told = false;
  };

  void on_participant_discovery(fdds::DomainParticipant* participant,
                                rtps::ParticipantDiscoveryInfo&& info) override {
    judge(info);
    next_.on_participant_discovery(participant, std::move(info));
  }
  void on_publisher_discovery(fdds::DomainParticipant* participant,
                              rtps::WriterDiscoveryInfo&& info) override {
    next_.on_publisher_discovery(participant, std::move(info));
  }
  void on_subscriber_discovery(fdds::DomainParticipant* participant,
                               rtps::ReaderDiscoveryInfo&& info) override {
    next_.on_subscriber_discovery(participant, std::move(info));
  }
  void onParticipantAuthentication(fdds::DomainParticipant*,
                                   rtps::ParticipantAuthenticationInfo&& info) override;
  void judge(const rtps::ParticipantDiscoveryInfo& info);
  // Once a participant, however often it tries.
  void refuse(Probation& probation, const std::string& why) {
    if (std::exchange(probation.told, true)) return;
    notices_->add("participant_refused", "participant " + probation.who + ' ' + why);
  }

  fdds::DomainParticipantListener& next_;
  std::shared_ptr<SecurityNotices> notices_ = std::make_shared<SecurityNotices>();
  std::shared_ptr<PacketGuard> guard_ =
      std::make_shared<PacketGuard>(PacketGuard::Rule::kSecured, notices_);
  std::mutex mutex_;
  std::map<rtps::GUID_t, Probation> probations_;
};

void Watch::judge(const rtps::ParticipantDiscoveryInfo& info) {
  const rtps::GUID_t guid = info.info.m_guid;
  const std::lock_guard lock(mutex_);
  switch (info.status) {
    case rtps::ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT:
      if (probations_.size() < kMostOnProbation) {
        const auto [entry, is_new] =
            probations_.try_emplace(guid, Probation{Clock::now(), text_of_participant(info.info)});
        if (is_new && info.info.identity_token_.class_id().empty())
          refuse(entry->second, "has no certificate");
      }
      break;
    case rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT:
    case rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT:
      probations_.erase(guid);
      guard_->forget(prefix_of(guid));
      break;
    default:
      break;
  }
}

void Watch::onParticipantAuthentication(fdds::DomainParticipant*,
                                        rtps::ParticipantAuthenticationInfo&& info) {
  const std::lock_guard lock(mutex_);
  const auto found = probations_.find(info.guid);
  if (info.status == rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT) {
    if (found != probations_.end()) probations_.erase(found);
    return;
  }
  if (found != probations_.end()) refuse(found->second, "could not prove who it is");
}

std::vector<SecurityNotice> Watch::take(Clock::time_point now) {
  {
    // Of two that fail to prove themselves to each other, the library tells only one.
    const std::lock_guard lock(mutex_);
    for (auto& [guid, probation] : probations_) {
      if (now - probation.since >= kProvesItselfWithin)
        refuse(probation, "did not prove who it is");
    }
  }
  std::vector<SecurityNotice> taken = notices_->take();
  for (SecurityNotice& notice : library_log().take()) taken.push_back(std::move(notice));
  return taken;
}

// Without security: the form of datagrams alone.
class FormWatch final : public SecurityWatch {
 public:
  fdds::DomainParticipantListener* listener() noexcept override { return nullptr; }
  std::vector<SecurityNotice> take(Clock::time_point) override { return notices_->take(); }
  [[nodiscard]] std::shared_ptr<PacketGuard> guard() const { return guard_; }

 private:
  std::shared_ptr<SecurityNotices> notices_ = std::make_shared<SecurityNotices>();
  std::shared_ptr<PacketGuard> guard_ =
      std::make_shared<PacketGuard>(PacketGuard::Rule::kWellFormed, notices_);
};

void put_in_front(const std::shared_ptr<PacketGuard>& guard, fdds::DomainParticipantQos& qos) {
  for (auto& each : qos.transport().user_transports) {
    // What comes by shared memory is of this user's own processes.
    if (dynamic_cast<transport::SharedMemTransportDescriptor*>(each.get()) != nullptr) continue;
    each = std::make_shared<GuardedDescriptor>(each, guard);
  }
}

}  // namespace

std::shared_ptr<SecurityWatch> guard_transports(fdds::DomainParticipantQos& qos) {
  auto watch = std::make_shared<FormWatch>();
  put_in_front(watch->guard(), qos);
  return watch;
}

std::shared_ptr<SecurityWatch> secure(const std::string& participant_name,
                                      const std::filesystem::path& folder,
                                      fdds::DomainParticipantListener& next,
                                      fdds::DomainParticipantQos& qos) {
  const SecurityFiles files = find_security_files(folder, security_identity(participant_name),
                                                  std::chrono::system_clock::now());
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

  auto watch = std::make_shared<Watch>(next);
  put_in_front(watch->guard(), qos);
  return watch;
}

std::string last_security_error() {
  return library_log().last_error();
}

}  // namespace zerodrift::dds
