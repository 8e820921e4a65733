// SPDX-License-Identifier: Apache-2.0
// What a fleet is made of and how much of it there is to discover: the endpoints of one vehicle's
// processes, the law by which those of N vehicles match, and the curve through measured figures.
// Pure.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace zerodrift::services {

enum class EndpointKind : std::uint8_t { kWriter, kReader };

// Whom an endpoint of compensation is for (services/compensation/instances.h); all others are for
// everybody.
enum class Audience : std::uint8_t { kEverybody, kEverybodyAsInstance, kOtherInstances };

struct VehicleEndpoint {
  std::string_view topic;
  EndpointKind kind = EndpointKind::kWriter;
  Audience audience = Audience::kEverybody;
};

// One process with its participant, as deployed.
struct VehicleProcess {
  std::string_view service;  // the name of the program
  std::uint32_t instance = 0;
  std::vector<VehicleEndpoint> endpoints{};
};

// A gyro and a thermometer, compensation twice, and who listens; one gyro and one probe a vehicle.
const std::vector<VehicleProcess>& vehicle_processes();

enum class Partitioning : std::uint8_t {
  kNone,       // as the services are
  kByVehicle,  // supposed: every endpoint in a partition of its vehicle
};

// Empty: that of endpoints that name none.
std::vector<std::string> partitions_of(const VehicleProcess& process,
                                       const VehicleEndpoint& endpoint, std::uint32_t vehicle,
                                       Partitioning partitioning);

struct VehicleCount {
  std::uint64_t participants = 0;
  std::uint64_t writers = 0;
  std::uint64_t readers = 0;
};
VehicleCount count_of_vehicle();

// Pairs of a writer and a reader that match, over all vehicles of one domain:
//   N × (pairs within a vehicle) + N (N - 1) × (pairs of one vehicle's writers and another's
//   readers).
// One participant's writer matches its own reader too.
std::uint64_t matching_pairs(std::uint32_t vehicles, Partitioning partitioning);

// Pairs of what one discovery server writes, its status and its events, and of those vehicles'
// readers. It names no partition.
std::uint64_t pairs_with_server(std::uint32_t vehicles, Partitioning partitioning);

struct FleetPoint {
  double vehicles = 0.0;
  double figure = 0.0;
};

// figure = constant + per_vehicle × N + per_pair × N².
struct Growth {
  double constant = 0.0;
  double per_vehicle = 0.0;
  double per_pair = 0.0;
  double residual = 0.0;  // root mean square of the relative deviations of the points from it

  [[nodiscard]] double at(double vehicles) const noexcept {
    return constant + vehicles * (per_vehicle + vehicles * per_pair);
  }
};

// Least squares of the relative deviations with no negative coefficient (nothing in a fleet is
// given back by a further vehicle), by trial of all subsets of the three terms that have the linear
// one (Lawson and Hanson 1974, ch. 23: the solution is that of its positive terms alone); of these
// the one with the least squares a degree of freedom. Figures that are not above 0 are left out.
// Zeros where nothing is left.
Growth fit_growth(std::span<const FleetPoint> points);

// How far the curve through all but the largest fleet misses the largest, as a share of it: what an
// extrapolation of some factor of two costs. NaN with fewer than three points.
double held_out_error(std::span<const FleetPoint> points);

// By which power of the fleet's size the figure grows from the last but one to the largest: above 2
// the curve is below what is to come. NaN with fewer than two points.
double exponent_at_the_end(std::vector<FleetPoint> points);

// Of an odd or even number of values, at least one.
double median_of(std::vector<double> values);

}  // namespace zerodrift::services
