// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/bench_fleet_vehicle.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <iostream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/service/main.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::services {
namespace {

using namespace std::chrono_literals;

// An endpoint of any topic: how many it has matched, and its end.
struct Made {
  std::function<int()> matched;
  EndpointKind kind = EndpointKind::kWriter;
};

template <typename Message>
bool make(dds::Participant& participant, const VehicleEndpoint& endpoint,
          const dds::Partitions& partitions, std::vector<Made>& made) {
  if (endpoint.topic != dds::TopicOf<Message>::kSpec.name) return false;
  if (endpoint.kind == EndpointKind::kWriter) {
    auto writer =
        std::make_shared<dds::Writer<Message>>(participant, dds::EndpointObserver{}, partitions);
    made.push_back({[writer] { return writer->matched(); }, endpoint.kind});
  } else {
    using Reader = dds::Reader<Message>;
    auto reader = std::make_shared<Reader>(
        participant, [](const Message&, const dds::SampleOrigin&) {}, dds::EndpointObserver{},
        typename Reader::OnGone{}, partitions);
    made.push_back({[reader] { return reader->matched(); }, endpoint.kind});
  }
  return true;
}

template <typename... Messages>
bool make_any_of(dds::Participant& participant, const VehicleEndpoint& endpoint,
                 const dds::Partitions& partitions, std::vector<Made>& made) {
  return (make<Messages>(participant, endpoint, partitions, made) || ...);
}

class Vehicle {
 public:
  explicit Vehicle(const FleetVehicleOptions& options) {
    const auto partitioning =
        options.is_partitioned ? Partitioning::kByVehicle : Partitioning::kNone;
    for (const auto& process : vehicle_processes()) {
      auto& participant = *participants_.emplace_back(
          std::make_unique<dds::Participant>(std::string(process.service), options.network));
      for (const auto& endpoint : process.endpoints) {
        add(participant, endpoint, partitions_of(process, endpoint, options.vehicle, partitioning));
      }
    }
  }
  ~Vehicle() { endpoints_.clear(); }
  Vehicle(const Vehicle&) = delete;
  Vehicle& operator=(const Vehicle&) = delete;

  std::string obey(const std::string& line) {
    std::istringstream words(line);
    std::string command;
    words >> command;
    if (command == "matched") {
      return std::to_string(matched(EndpointKind::kWriter)) + ' ' +
             std::to_string(matched(EndpointKind::kReader));
    }
    std::int64_t by_writers = 0;
    std::int64_t by_readers = 0;
    std::int64_t at_most_ms = 0;
    if (!(words >> by_writers >> by_readers >> at_most_ms) || command != "await")
      return "unknown command";
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::milliseconds(at_most_ms);
    while (matched(EndpointKind::kWriter) < by_writers ||
           matched(EndpointKind::kReader) < by_readers) {
      if (std::chrono::steady_clock::now() > give_up) return "no";
      std::this_thread::sleep_for(5ms);
    }
    return "yes " + std::to_string(service::monotonic_ns());
  }

 private:
  void add(dds::Participant& participant, const VehicleEndpoint& endpoint,
           const dds::Partitions& partitions) {
    const bool known = make_any_of<msg::AngularRate, msg::Temperature, msg::RateReference,
                                   msg::CompensatedRate, msg::AllanReport, msg::ServiceStatus,
                                   msg::Event, msg::Command, msg::CommandReply, msg::ReplayProgress,
                                   msg::CheckpointPart, msg::NavigationState, msg::TwinReport>(
        participant, endpoint, partitions, endpoints_);
    if (!known) {
      throw std::logic_error("bench fleet: no type for topic " + std::string(endpoint.topic));
    }
  }

  [[nodiscard]] std::int64_t matched(EndpointKind kind) const {
    std::int64_t sum = 0;
    for (const auto& endpoint : endpoints_) sum += endpoint.kind == kind ? endpoint.matched() : 0;
    return sum;
  }

  std::vector<std::unique_ptr<dds::Participant>> participants_;  // outlive their endpoints
  std::vector<Made> endpoints_;
};

}  // namespace

int run_fleet_vehicle(const FleetVehicleOptions& options) {
  Vehicle vehicle(options);
  std::cout << "made" << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    std::cout << vehicle.obey(line) << std::endl;
  }
  return service::kExitDone;
}

}  // namespace zerodrift::services
