// SPDX-License-Identifier: Apache-2.0
// A ROS 2 node's subscription as another vendor's middleware makes it: ros2_imu_peer DOMAIN TOPIC
// SAMPLES. One line a sample on standard output. Exit codes as cyclone_peer.
#include <dds/dds.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "cyclone_reading.h"
#include "ros2_sensors.h"

// rmw_qos_profile_sensor_data: what ROS 2 nodes subscribe to sensors with, but reliable and as deep
// as is needed to count.
static dds_entity_t create_reader(dds_entity_t participant, const char* name) {
  const dds_entity_t topic =
      dds_create_topic(participant, &sensor_msgs_msg_dds__Imu__desc, name, NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  return reader;
}

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
  const dds_domainid_t domain = (dds_domainid_t)strtoul(argv[1], NULL, 10);
  const dds_entity_t participant = dds_create_participant(domain, NULL, NULL);
  const dds_entity_t reader = participant < 0 ? participant : create_reader(participant, argv[2]);
  if (reader < 0) {
    fprintf(stderr, "ros2_imu_peer: %s\n", dds_strretcode(reader));
    return 2;
  }
  const int code = receive(participant, reader, strtol(argv[3], NULL, 10), print_sample);
  dds_delete(participant);
  return code;
}
