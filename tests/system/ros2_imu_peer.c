// SPDX-License-Identifier: Apache-2.0
// A ROS 2 node's subscription as another vendor's middleware makes it, with the quality of service
// that ROS 2 nodes subscribe to sensors with, but reliable and as deep as is needed to count:
// ros2_imu_peer DOMAIN TOPIC SAMPLES. One line a sample on standard output. Exit codes as
// cyclone_peer.
#include <dds/dds.h>
#include <inttypes.h>
#include <stdio.h>

#include "cyclone_reading.h"
#include "ros2_sensors.h"

static void print_sample(const void* lent) {
  const sensor_msgs_msg_dds__Imu_* imu = lent;
  printf("%s %" PRId32 " %" PRIu32 " %a %a %a", imu->header_.frame_id_, imu->header_.stamp_.sec_,
         imu->header_.stamp_.nanosec_, imu->angular_velocity_.x_, imu->angular_velocity_.y_,
         imu->angular_velocity_.z_);
  for (size_t i = 0; i < 9; ++i) printf(" %a", imu->angular_velocity_covariance_[i]);
  printf(" %a %a\n", imu->orientation_covariance_[0], imu->linear_acceleration_covariance_[0]);
}

int main(int argc, char** argv) {
  if (argc != 4) {
    fprintf(stderr, "usage: ros2_imu_peer DOMAIN TOPIC SAMPLES\n");
    return 2;
  }
  return print_samples("ros2_imu_peer", argv[1], &sensor_msgs_msg_dds__Imu__desc, argv[2], argv[3],
                       print_sample);
}
