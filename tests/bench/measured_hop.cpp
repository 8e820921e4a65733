// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/measured_hop.h"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>

namespace zerodrift::dds {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::Duration_t;

namespace {

// Data sharing refuses a type with a key.
class KeylessRate final : public msg::AngularRatePubSubType {
 public:
  KeylessRate() { m_isGetKeyDefined = false; }
};

// Many alternatives at once: more participants than a system of services has.
constexpr std::uint32_t kParticipantsPerHost = 100;

// As the default profile of participant.cpp: loopback only.
void add_udp(fdds::DomainParticipantQos& qos) {
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  udp->maxInitialPeersRange = kParticipantsPerHost;
  udp->sendBufferSize = 1U << 20U;
  udp->receiveBufferSize = 1U << 20U;
  udp->non_blocking_send = false;
  qos.transport().user_transports.push_back(udp);
  rtps::Locator_t loopback;
  loopback.kind = LOCATOR_KIND_UDPv4;
  loopback.port = 0;
  rtps::IPLocator::setIPv4(loopback, "127.0.0.1");
  auto& builtin = qos.wire_protocol().builtin;
  builtin.initialPeersList.push_back(loopback);
  builtin.metatrafficUnicastLocatorList.push_back(loopback);
  qos.wire_protocol().default_unicast_locator_list.push_back(loopback);
}

fdds::DomainParticipantQos participant_qos(HopTransport transport) {
  fdds::DomainParticipantQos qos;
  qos.name("measured_hop");
  qos.transport().use_builtin_transports = false;
  if (transport == HopTransport::kSharedMemory) {
    auto memory = std::make_shared<eprosima::fastdds::rtps::SharedMemTransportDescriptor>();
    memory->maxInitialPeersRange = kParticipantsPerHost;
    qos.transport().user_transports.push_back(memory);
  } else {
    add_udp(qos);
  }
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.initial_announcements.count = 20;
  discovery.initial_announcements.period = Duration_t(0, 50000000);
  return qos;
}

}  // namespace

class MeasuredHop::Writing final : public fdds::DataWriterListener {
 public:
  void on_publication_matched(fdds::DataWriter*,
                              const fdds::PublicationMatchedStatus& status) override {
    matched = status.current_count;
  }
  std::atomic<int> matched{0};
};

class MeasuredHop::Reading final : public fdds::DataReaderListener {
 public:
  explicit Reading(OnSample handler) : on_sample(std::move(handler)) {}
  void on_subscription_matched(fdds::DataReader*,
                               const fdds::SubscriptionMatchedStatus& status) override {
    matched = status.current_count;
  }
  void on_data_available(fdds::DataReader* reader) override {
    fdds::SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) on_sample(message);
    }
  }
  std::atomic<int> matched{0};
  OnSample on_sample;
  msg::AngularRate message;
};

MeasuredHop::MeasuredHop(const NetworkOptions& network, const HopAlternative& alternative,
                         const std::string& name, HopEnd end, OnSample on_sample)
    : writing_(std::make_unique<Writing>()),
      reading_(std::make_unique<Reading>(std::move(on_sample))) {
  eprosima::fastrtps::LibrarySettingsAttributes settings;
  settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
  fdds::Log::SetVerbosity(fdds::Log::Error);
  participant_ = fdds::DomainParticipantFactory::get_instance()->create_participant(
      network.domain, participant_qos(alternative.transport));
  if (participant_ == nullptr) throw DdsError("dds: cannot create a participant to be measured");

  fdds::TypeSupport type(alternative.transport == HopTransport::kDataSharing
                             ? new KeylessRate
                             : new msg::AngularRatePubSubType);
  type->auto_fill_type_object(false);
  type->auto_fill_type_information(false);
  const std::string type_name(kAngularRate.type);
  type.register_type(participant_, type_name);
  const bool near = end == HopEnd::kNear;
  const auto make = [&](const char* direction) {
    return participant_->create_topic(name + direction, type_name, fdds::TOPIC_QOS_DEFAULT);
  };
  auto* there = make("_there");
  auto* back = make("_back");
  fdds::DataWriterQos writer_qos = dds::writer_qos(kAngularRate);
  fdds::DataReaderQos reader_qos = dds::reader_qos(kAngularRate);
  if (alternative.change != nullptr) alternative.change(writer_qos, reader_qos);
  writer_ = participant_->create_publisher(fdds::PUBLISHER_QOS_DEFAULT)
                ->create_datawriter(near ? there : back, writer_qos, writing_.get());
  auto* reader = participant_->create_subscriber(fdds::SUBSCRIBER_QOS_DEFAULT)
                     ->create_datareader(near ? back : there, reader_qos, reading_.get());
  if (writer_ == nullptr || reader == nullptr) {
    throw DdsError("dds: cannot create an endpoint with the quality of service '" +
                   std::string(alternative.name) + "'");
  }
}

MeasuredHop::~MeasuredHop() {
  participant_->delete_contained_entities();
  fdds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

bool MeasuredHop::connected() const {
  return writing_->matched > 0 && reading_->matched > 0;
}

bool MeasuredHop::send(msg::AngularRate& sample) noexcept {
  return writer_->write(&sample);
}

}  // namespace zerodrift::dds
