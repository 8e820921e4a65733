// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/bench_fleet_law.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/dds/topics.h"

namespace zerodrift::services {
namespace {

using enum EndpointKind;

constexpr std::uint32_t kInstances = 2;  // primary and standby
constexpr std::uint32_t kMostInstances = 16;
constexpr double kRounding = 1e-20;  // squares of relative deviations below it are none

VehicleEndpoint writes(const dds::TopicSpec& topic, Audience audience = Audience::kEverybody) {
  return {topic.name, kWriter, audience};
}

VehicleEndpoint reads(const dds::TopicSpec& topic, Audience audience = Audience::kEverybody) {
  return {topic.name, kReader, audience};
}

// What every service has (service::Host), and then its own.
VehicleProcess process(std::string_view service, std::vector<VehicleEndpoint> own,
                       std::uint32_t instance = 0) {
  own.insert(own.begin(), {writes(dds::kServiceStatus), writes(dds::kEvent)});
  return {service, instance, std::move(own)};
}

VehicleProcess compensation(std::uint32_t instance) {
  return process(
      "compensation",
      {reads(dds::kCommand), writes(dds::kCommandReply), writes(dds::kReplayProgress),
       reads(dds::kReplayProgress), reads(dds::kRateReference), reads(dds::kTemperature),
       reads(dds::kAngularRate), writes(dds::kCompensatedRate, Audience::kEverybodyAsInstance),
       reads(dds::kCompensatedRate, Audience::kOtherInstances), writes(dds::kCheckpoint),
       reads(dds::kCheckpoint)},
      instance);
}

std::vector<VehicleProcess> make_vehicle() {
  std::vector<VehicleProcess> all;
  all.push_back(process("gyro_publisher", {writes(dds::kAngularRate), writes(dds::kRateReference),
                                           writes(dds::kTemperature), reads(dds::kReplayProgress),
                                           reads(dds::kCommand), writes(dds::kCommandReply)}));
  all.push_back(process(
      "thermal_publisher",
      {writes(dds::kTemperature), reads(dds::kReplayProgress), writes(dds::kReplayProgress)}));
  for (std::uint32_t instance = 0; instance < kInstances; ++instance)
    all.push_back(compensation(instance));
  all.push_back(process("allan_monitor", {writes(dds::kAllanReport), writes(dds::kReplayProgress),
                                          reads(dds::kCompensatedRate)}));
  all.push_back(
      process("navigation_filter",
              {writes(dds::kNavigation), writes(dds::kRateReference), writes(dds::kReplayProgress),
               reads(dds::kRateReference), reads(dds::kCompensatedRate)}));
  all.push_back(process(
      "console", {writes(dds::kCommand), reads(dds::kCommandReply), reads(dds::kCompensatedRate),
                  reads(dds::kRateReference), reads(dds::kTemperature), reads(dds::kAllanReport),
                  reads(dds::kNavigation), reads(dds::kTwinReport), reads(dds::kServiceStatus),
                  reads(dds::kEvent)}));
  return all;
}

// Endpoints that name no partition are in "".
std::vector<std::string> named(std::vector<std::string> partitions) {
  if (partitions.empty()) partitions.emplace_back();
  return partitions;
}

bool meet(const std::vector<std::string>& some, const std::vector<std::string>& others) {
  return std::any_of(some.begin(), some.end(), [&](const std::string& one) {
    return std::find(others.begin(), others.end(), one) != others.end();
  });
}

struct Placed {
  VehicleEndpoint endpoint;
  std::vector<std::string> partitions;
};

std::vector<Placed> placed(std::uint32_t vehicle, Partitioning partitioning, EndpointKind kind) {
  std::vector<Placed> result;
  for (const auto& process : vehicle_processes()) {
    for (const auto& endpoint : process.endpoints) {
      if (endpoint.kind != kind) continue;
      result.push_back({endpoint, named(partitions_of(process, endpoint, vehicle, partitioning))});
    }
  }
  return result;
}

std::uint64_t pairs_between(std::uint32_t writers_of, std::uint32_t readers_of,
                            Partitioning partitioning) {
  std::uint64_t pairs = 0;
  const auto readers = placed(readers_of, partitioning, kReader);
  for (const auto& writer : placed(writers_of, partitioning, kWriter)) {
    pairs += static_cast<std::uint64_t>(
        std::count_if(readers.begin(), readers.end(), [&](const Placed& reader) {
          return writer.endpoint.topic == reader.endpoint.topic &&
                 meet(writer.partitions, reader.partitions);
        }));
  }
  return pairs;
}

struct Candidate {
  std::array<double, 3> coefficients{};
  double squares = 0.0;
  int terms = 0;
  bool is_possible = false;
};

constexpr unsigned kPerVehicle = 0b010;
// The terms whose bit of `subset` is set: 1, N, N².
Candidate solve(std::span<const FleetPoint> points, unsigned subset) {
  Candidate result;
  std::array<int, 3> powers{};
  for (int power = 0; power < 3; ++power) {
    if ((subset >> static_cast<unsigned>(power) & 1U) != 0)
      powers[static_cast<std::size_t>(result.terms++)] = power;
  }
  const auto rows = static_cast<Eigen::Index>(points.size());
  if (result.terms > rows) return result;
  Eigen::MatrixXd design(rows, result.terms);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const auto& point = points[static_cast<std::size_t>(row)];
    for (Eigen::Index term = 0; term < result.terms; ++term) {
      design(row, term) =
          std::pow(point.vehicles, powers[static_cast<std::size_t>(term)]) / point.figure;
    }
  }
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(rows);
  const Eigen::VectorXd solution = design.colPivHouseholderQr().solve(ones);
  result.is_possible = solution.allFinite() && solution.minCoeff() >= 0.0;
  result.squares = (design * solution - ones).squaredNorm();
  for (Eigen::Index term = 0; term < result.terms; ++term) {
    const auto power = static_cast<std::size_t>(powers[static_cast<std::size_t>(term)]);
    result.coefficients[power] = solution(term);
  }
  return result;
}

// A curve with as many terms as points says nothing of how well it fits: only where nothing else
// is possible.
double score(const Candidate& candidate, std::size_t points) {
  const double freedom = static_cast<double>(points) - candidate.terms;
  return freedom > 0.0 ? (candidate.squares + kRounding) / freedom
                       : std::numeric_limits<double>::max();
}

}  // namespace

const std::vector<VehicleProcess>& vehicle_processes() {
  static const std::vector<VehicleProcess> kVehicle = make_vehicle();
  return kVehicle;
}

std::vector<std::string> partitions_of(const VehicleProcess& process,
                                       const VehicleEndpoint& endpoint, std::uint32_t vehicle,
                                       Partitioning partitioning) {
  const std::string base =
      partitioning == Partitioning::kByVehicle ? "vehicle_" + std::to_string(vehicle) : "";
  const auto of_instance = [&](std::uint32_t instance) {
    return (base.empty() ? "" : base + '_') + "instance_" + std::to_string(instance);
  };
  switch (endpoint.audience) {
    case Audience::kEverybodyAsInstance:
      return {base, of_instance(process.instance)};
    case Audience::kOtherInstances: {
      std::vector<std::string> others;
      for (std::uint32_t other = 0; other < kMostInstances; ++other) {
        if (other != process.instance) others.push_back(of_instance(other));
      }
      return others;
    }
    case Audience::kEverybody:
      break;
  }
  return base.empty() ? std::vector<std::string>{} : std::vector<std::string>{base};
}

VehicleCount count_of_vehicle() {
  VehicleCount count;
  for (const auto& process : vehicle_processes()) {
    ++count.participants;
    for (const auto& endpoint : process.endpoints)
      ++(endpoint.kind == kWriter ? count.writers : count.readers);
  }
  return count;
}

std::uint64_t matching_pairs(std::uint32_t vehicles, Partitioning partitioning) {
  const std::uint64_t n = vehicles;
  if (n == 0) return 0;
  return n * pairs_between(1, 1, partitioning) + n * (n - 1) * pairs_between(1, 2, partitioning);
}

std::uint64_t pairs_with_server(std::uint32_t vehicles, Partitioning partitioning) {
  const std::vector<std::string> unnamed{""};
  const auto readers = placed(1, partitioning, kReader);
  return vehicles * static_cast<std::uint64_t>(
                        std::count_if(readers.begin(), readers.end(), [&](const Placed& reader) {
                          const bool is_written =
                              reader.endpoint.topic == dds::kServiceStatus.name ||
                              reader.endpoint.topic == dds::kEvent.name;
                          return is_written && meet(unnamed, reader.partitions);
                        }));
}

Growth fit_growth(std::span<const FleetPoint> points) {
  std::vector<FleetPoint> used;
  std::copy_if(points.begin(), points.end(), std::back_inserter(used),
               [](const FleetPoint& point) { return point.figure > 0.0; });
  Growth growth;
  if (used.empty()) return growth;
  Candidate best;
  for (unsigned subset = 1; subset < 8; ++subset) {
    if ((subset & kPerVehicle) == 0) continue;
    const Candidate candidate = solve(used, subset);
    if (!candidate.is_possible) continue;
    if (!best.is_possible || score(candidate, used.size()) < score(best, used.size()))
      best = candidate;
  }
  growth.constant = best.coefficients[0];
  growth.per_vehicle = best.coefficients[1];
  growth.per_pair = best.coefficients[2];
  growth.residual = std::sqrt(best.squares / static_cast<double>(used.size()));
  return growth;
}

double held_out_error(std::span<const FleetPoint> points) {
  if (points.size() < 3) return std::numeric_limits<double>::quiet_NaN();
  const auto largest = std::max_element(
      points.begin(), points.end(),
      [](const auto& one, const auto& other) { return one.vehicles < other.vehicles; });
  std::vector<FleetPoint> others;
  std::copy_if(points.begin(), points.end(), std::back_inserter(others),
               [&](const FleetPoint& point) { return point.vehicles != largest->vehicles; });
  if (!(largest->figure > 0.0)) return std::numeric_limits<double>::quiet_NaN();
  return fit_growth(others).at(largest->vehicles) / largest->figure - 1.0;
}

double exponent_at_the_end(std::vector<FleetPoint> points) {
  if (points.size() < 2) return std::numeric_limits<double>::quiet_NaN();
  std::sort(points.begin(), points.end(),
            [](const auto& one, const auto& other) { return one.vehicles < other.vehicles; });
  const FleetPoint& largest = points[points.size() - 1];
  const FleetPoint& before = points[points.size() - 2];
  return std::log(largest.figure / before.figure) / std::log(largest.vehicles / before.vehicles);
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace zerodrift::services
