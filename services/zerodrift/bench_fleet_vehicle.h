// SPDX-License-Identifier: Apache-2.0
// The processes of one vehicle as one light process, for the fleet bench: the same participants
// with the same writers and readers of the real topics, and no samples. Led by lines on standard
// input, each answered by one on standard output; the first line comes by itself:
//
//                             made: every endpoint is there
//   await WRITERS READERS MS  yes NS | no: when (monotonic clock) this vehicle's writers had
//                             matched so many readers and its readers so many writers; or not
//                             within so many ms
//   matched                   WRITERS READERS: how many readers its writers have matched now, and
//                             how many writers its readers
#pragma once

#include "common/dds/participant.h"
#include "services/zerodrift/bench_fleet_law.h"

namespace zerodrift::services {

struct FleetVehicleOptions {
  dds::NetworkOptions network;
  std::uint32_t vehicle = 1;
  bool is_partitioned = false;
};

int run_fleet_vehicle(const FleetVehicleOptions& options);

}  // namespace zerodrift::services
