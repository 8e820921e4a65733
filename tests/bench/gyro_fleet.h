// SPDX-License-Identifier: Apache-2.0
// Many synthetic gyros in one process, for the benches: a writer a gyro, samples of all at one
// pace. Led by lines on standard input, each answered by one on standard output:
//
//   ready                     yes | no: every writer knows a reader
//   send HZ COUNT             NEWEST REFUSED: sequence number of every gyro's last sample, and what
//                             the middleware did not take; COUNT samples of each gyro
#pragma once

#include "common/dds/participant.h"

namespace zerodrift::bench {

struct GyroFleetOptions {
  dds::NetworkOptions network;
  std::uint32_t gyros = 1;  // ids from 1
};

int run_gyro_fleet(const GyroFleetOptions& options);

}  // namespace zerodrift::bench
