// SPDX-License-Identifier: Apache-2.0
// A subscriber of compensated_rate made with another vendor's middleware: cyclone_peer DOMAIN
// SAMPLES One line a sample on standard output, every number so that it reads back to the same
// bits. Ends with 0 after SAMPLES samples, with 1 when none came for 20 s, with 2 for wrong usage.
#include <dds/dds.h>
#include <inttypes.h>
#include <stdio.h>

#include "compensated_rate.h"
#include "cyclone_reading.h"

static void print_values(const double* values, size_t count) {
  for (size_t i = 0; i < count; ++i) printf(" %a", values[i]);
}

static void print_octets(const uint8_t* values) {
  for (size_t i = 0; i < 3; ++i) printf(" %u", values[i]);
}

static void print_sample(const void* lent) {
  const zerodrift_msg_CompensatedRate* sample = lent;
  printf("%" PRIu32 " %" PRIu64 " %" PRId64 " %" PRIu32, sample->gyro_id, sample->sequence_number,
         sample->sensor_time_ns, sample->validity);
  print_values(sample->rate_radps, 3);
  print_values(sample->delta_angle_rad, 3);
  print_values(&sample->interval_s, 1);
  print_values(sample->applied_drift_radps, 3);
  print_values(sample->drift_variance_radps2, 3);
  print_values(sample->rate_covariance_radps2, 9);
  printf(" %" PRIu64, sample->model_epoch);
  print_octets(sample->mode);
  print_octets(sample->reason);
  print_octets(sample->rung);
  printf(" %u %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRId64 " %" PRId64 " %" PRId64 "\n",
         sample->order, sample->frame, sample->clock_source, sample->instance,
         sample->publish_time_ns, sample->ingress_time_ns, sample->egress_time_ns);
}

int main(int argc, char** argv) {
  if (argc != 3) {
    fprintf(stderr, "usage: cyclone_peer DOMAIN SAMPLES\n");
    return 2;
  }
  return print_samples("cyclone_peer", argv[1], &zerodrift_msg_CompensatedRate_desc,
                       "compensated_rate", argv[2], print_sample);
}
