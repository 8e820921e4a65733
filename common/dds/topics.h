// SPDX-License-Identifier: Apache-2.0
// The one place that names topics and chooses their quality of service.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "idl/dds/allan_reportPubSubTypes.h"
#include "idl/dds/angular_ratePubSubTypes.h"
#include "idl/dds/checkpointPubSubTypes.h"
#include "idl/dds/compensated_ratePubSubTypes.h"
#include "idl/dds/environmentPubSubTypes.h"
#include "idl/dds/navigationPubSubTypes.h"
#include "idl/dds/rate_referencePubSubTypes.h"
#include "idl/dds/ros2_sensorsPubSubTypes.h"
#include "idl/dds/servicePubSubTypes.h"
#include "idl/dds/temperaturePubSubTypes.h"
#include "idl/dds/thermal_coveragePubSubTypes.h"
#include "idl/dds/twin_reportPubSubTypes.h"

namespace zerodrift::dds {

enum class Reliability : std::uint8_t { kBestEffort, kReliable };
enum class Durability : std::uint8_t { kVolatile, kTransientLocal };
enum class Ownership : std::uint8_t { kShared, kExclusive };

// Reliable, because a lost sample breaks "one raw, one compensated"; the heartbeat below keeps a
// repair within milliseconds (the default period of 3 s stalls or loses). Only replay_progress may
// lose a sample: each one says everything, and the newest is repeated.
//
// A writer writes one key of a sample topic (a writer a gyro, a writer a probe). With several keys
// of unequal rates the kept history has holes, and Fast DDS then announces every hole to every
// reader with every heartbeat, at a cost that grows with the hole (DECISIONS.md).
struct TopicSpec {
  std::string_view name;
  std::string_view type;
  std::int32_t depth;  // samples kept for each key: what survives an interruption of the transport
  std::int32_t keys;   // keys held at most
  Reliability reliability;
  Durability durability;
  Ownership ownership;
  std::chrono::milliseconds heartbeat;
  std::chrono::milliseconds lifespan;  // 0: unlimited
  // A longer time from one sample of a key to the next is reported, on both sides; 0: never.
  // Watched by our own endpoints and no deadline QoS: for that the middleware restarts a timer with
  // every sample at both ends, a tenth to a fifth of a hop (DECISIONS.md).
  std::chrono::milliseconds deadline{0};
  // A writer that wrote nothing for so long counts as gone until it writes again (liveliness
  // MANUAL_BY_TOPIC); 0: never, as long as its participant is there. The kinds by participant are
  // never used with a lease: any process that lives asserts them for all (DECISIONS.md).
  std::chrono::milliseconds lease{0};
};

// 2000 samples: 10 s at 200 Hz, 1 s at 2 kHz; the environment may be as dense as the rates.
// Progress is sent once in a window, see ReplayPacer.
inline constexpr std::int32_t kSampleDepth = 2000;

using std::chrono_literals::operator""ms;
// Where a deadline or lease is:
// - angular_rate, 100 ms: ten periods of the slowest gyro that navigation uses (100 Hz).
// - compensated_rate, 100 ms: as angular_rate, since it comes at that pace.
// - service_status, 1 s and 2 s: four periods and eight; a status is written four times a second.
//   Its keys: up to five names a gyro (each instance's, publisher's and filter's part) and services.
// - replay_progress, 2 s: after so long it is reported that a consumer says nothing. A replay waits
//   for it all the same, until it has left: one that stands still would lose what was sent
//   meanwhile. Who stands still for longer than the participants' lease has left, and ends.
// clang-format off
inline constexpr TopicSpec kAngularRate{"angular_rate", "zerodrift::msg::AngularRate", kSampleDepth, 128, Reliability::kReliable, Durability::kVolatile, Ownership::kShared, 5ms, 0ms, 100ms};
inline constexpr TopicSpec kTemperature{"temperature", "zerodrift::msg::Temperature", 512, 1024, Reliability::kReliable, Durability::kTransientLocal, Ownership::kShared, 20ms, 0ms};
inline constexpr TopicSpec kRateReference{"rate_reference", "zerodrift::msg::RateReference", kSampleDepth, 128, Reliability::kReliable, Durability::kVolatile, Ownership::kShared, 5ms, 0ms};
inline constexpr TopicSpec kCompensatedRate{"compensated_rate", "zerodrift::msg::CompensatedRate", kSampleDepth, 128, Reliability::kReliable, Durability::kVolatile, Ownership::kShared, 5ms, 0ms, 100ms};
inline constexpr TopicSpec kAllanReport{"allan_report", "zerodrift::msg::AllanReport", 1, 1024, Reliability::kReliable, Durability::kTransientLocal, Ownership::kShared, 20ms, 0ms};
inline constexpr TopicSpec kServiceStatus{"service_status", "zerodrift::msg::ServiceStatus", 1, 1024, Reliability::kReliable, Durability::kTransientLocal, Ownership::kShared, 20ms, 0ms, 1000ms, 2000ms};
inline constexpr TopicSpec kEvent{"event", "zerodrift::msg::Event", 256, 1, Reliability::kReliable, Durability::kTransientLocal, Ownership::kShared, 20ms, 0ms};
inline constexpr TopicSpec kCommand{"command", "zerodrift::msg::Command", 64, 128, Reliability::kReliable, Durability::kVolatile, Ownership::kShared, 20ms, 0ms};
inline constexpr TopicSpec kCommandReply{"command_reply", "zerodrift::msg::CommandReply", 64, 128, Reliability::kReliable, Durability::kVolatile, Ownership::kShared, 20ms, 0ms};
inline constexpr TopicSpec kReplayProgress{"replay_progress", "zerodrift::msg::ReplayProgress", 1, 512, Reliability::kBestEffort, Durability::kVolatile, Ownership::kShared, 5ms, 0ms, 0ms, 2000ms};
inline constexpr TopicSpec kCheckpoint{"checkpoint", "zerodrift::msg::CheckpointPart", 64, 128, Reliability::kReliable, Durability::kVolatile, Ownership::kShared, 20ms, 0ms};
inline constexpr TopicSpec kNavigation{"navigation", "zerodrift::msg::NavigationState", 1, 384, Reliability::kReliable, Durability::kVolatile, Ownership::kShared, 20ms, 0ms};
inline constexpr TopicSpec kTwinReport{"twin_report", "zerodrift::msg::TwinReport", 1, 384, Reliability::kReliable, Durability::kTransientLocal, Ownership::kShared, 20ms, 0ms};
inline constexpr TopicSpec kEnvironment{"environment", "zerodrift::msg::Environment", kSampleDepth, 128, Reliability::kReliable, Durability::kTransientLocal, Ownership::kShared, 5ms, 0ms};
inline constexpr TopicSpec kThermalCoverage{"thermal_coverage", "zerodrift::msg::ThermalCoverage", 1, 128, Reliability::kReliable, Durability::kTransientLocal, Ownership::kShared, 20ms, 0ms};
// clang-format on

// What ROS 2 nodes subscribe to (ros2_imu.h). Not of our own interface, so not among the above; the
// name is the default of the one that the user chooses. Ten samples are what ROS 2 keeps by
// default.
inline constexpr TopicSpec kRos2Imu{"rt/imu",
                                    "sensor_msgs::msg::dds_::Imu_",
                                    10,
                                    1,
                                    Reliability::kReliable,
                                    Durability::kVolatile,
                                    Ownership::kShared,
                                    5ms,
                                    0ms};

// The state of gyros and services for ROS 2 nodes (ros2_diagnostics.h). As ROS 2's own publishers
// of it: reliable, volatile.
inline constexpr TopicSpec kRos2Diagnostics{"rt/diagnostics",
                                            "diagnostic_msgs::msg::dds_::DiagnosticArray_",
                                            1,
                                            1,
                                            Reliability::kReliable,
                                            Durability::kVolatile,
                                            Ownership::kShared,
                                            20ms,
                                            0ms};

// What ROS 2 nodes publish (ros2_input.h), read with the quality of service that ROS 2 has for
// sensor data: best effort matches any writer.
inline constexpr TopicSpec kRos2ImuInput{
    "rt/imu",           kRos2Imu.type, 10, 1, Reliability::kBestEffort, Durability::kVolatile,
    Ownership::kShared, 5ms,           0ms};
inline constexpr TopicSpec kRos2TemperatureInput{"rt/temperature",
                                                 "sensor_msgs::msg::dds_::Temperature_",
                                                 10,
                                                 1,
                                                 Reliability::kBestEffort,
                                                 Durability::kVolatile,
                                                 Ownership::kShared,
                                                 5ms,
                                                 0ms};

// Binds a message type to its topic and its generated type support.
template <typename Support, const TopicSpec& kOfTopic>
struct Binding {
  using TypeSupport = Support;
  static constexpr TopicSpec kSpec = kOfTopic;
};
template <typename Message>
struct TopicOf;
// clang-format off
template <> struct TopicOf<msg::AngularRate> : Binding<msg::AngularRatePubSubType, kAngularRate> {};
template <> struct TopicOf<msg::Temperature> : Binding<msg::TemperaturePubSubType, kTemperature> {};
template <> struct TopicOf<msg::RateReference> : Binding<msg::RateReferencePubSubType, kRateReference> {};
template <> struct TopicOf<msg::CompensatedRate> : Binding<msg::CompensatedRatePubSubType, kCompensatedRate> {};
template <> struct TopicOf<msg::AllanReport> : Binding<msg::AllanReportPubSubType, kAllanReport> {};
template <> struct TopicOf<msg::ServiceStatus> : Binding<msg::ServiceStatusPubSubType, kServiceStatus> {};
template <> struct TopicOf<msg::Event> : Binding<msg::EventPubSubType, kEvent> {};
template <> struct TopicOf<msg::Command> : Binding<msg::CommandPubSubType, kCommand> {};
template <> struct TopicOf<msg::CommandReply> : Binding<msg::CommandReplyPubSubType, kCommandReply> {};
template <> struct TopicOf<msg::ReplayProgress> : Binding<msg::ReplayProgressPubSubType, kReplayProgress> {};
template <> struct TopicOf<msg::CheckpointPart> : Binding<msg::CheckpointPartPubSubType, kCheckpoint> {};
template <> struct TopicOf<msg::NavigationState> : Binding<msg::NavigationStatePubSubType, kNavigation> {};
template <> struct TopicOf<msg::TwinReport> : Binding<msg::TwinReportPubSubType, kTwinReport> {};
template <> struct TopicOf<msg::Environment> : Binding<msg::EnvironmentPubSubType, kEnvironment> {};
template <> struct TopicOf<msg::ThermalCoverage> : Binding<msg::ThermalCoveragePubSubType, kThermalCoverage> {};
template <> struct TopicOf<sensor_msgs::msg::dds_::Imu_> : Binding<sensor_msgs::msg::dds_::Imu_PubSubType, kRos2Imu> {};
template <> struct TopicOf<sensor_msgs::msg::dds_::Temperature_> : Binding<sensor_msgs::msg::dds_::Temperature_PubSubType, kRos2TemperatureInput> {};
template <> struct TopicOf<diagnostic_msgs::msg::dds_::DiagnosticArray_> : Binding<diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType, kRos2Diagnostics> {};
// clang-format on

// Of our own interface; a new topic's message belongs here.
using AllMessages =
    std::tuple<msg::AngularRate, msg::Temperature, msg::RateReference, msg::CompensatedRate,
               msg::AllanReport, msg::ServiceStatus, msg::Event, msg::Command, msg::CommandReply,
               msg::ReplayProgress, msg::CheckpointPart, msg::NavigationState, msg::TwinReport,
               msg::Environment, msg::ThermalCoverage>;
inline constexpr auto kAllTopics =
    []<typename... Message>(std::type_identity<std::tuple<Message...>>) {
      return std::array{TopicOf<Message>::kSpec...};
    }(std::type_identity<AllMessages>{});

}  // namespace zerodrift::dds
