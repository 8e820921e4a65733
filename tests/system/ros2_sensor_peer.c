// SPDX-License-Identifier: Apache-2.0
// A ROS 2 node of an IMU as another vendor's middleware makes it: ros2_sensor_peer DOMAIN SAMPLES.
// Publishes sensor_msgs/Imu on rt/imu/data_raw and sensor_msgs/Temperature on rt/imu/temperature
// with the quality of service for sensor data, and hears angular_rate, so that it is never far
// ahead of what came back of it. Until it hears one, and one of gyro 99, the test's word that
// everybody is there, it repeats messages of the year 2001; then SAMPLES messages with a
// temperature each hundredth, each printed as a line, the last followed by "end". It stays, silent,
// until it is stopped. 1: nothing came back for 20 s.
#include <dds/dds.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "angular_rate.h"
#include "ros2_sensors.h"

#define WORD 99
#define AHEAD 32
#define BATCH 64

typedef struct {
  dds_entity_t imu;
  dds_entity_t temperature;
  dds_entity_t rates;
  dds_entity_t waitset;
  int word;        // was heard
  int connected;   // a rate of another gyro came
  long came_back;  // such rates since both
} Node;

static dds_entity_t create_writer(dds_entity_t participant, const dds_topic_descriptor_t* type,
                                  const char* name) {
  const dds_entity_t topic = dds_create_topic(participant, type, name, NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 5);
  const dds_entity_t writer = dds_create_writer(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  return writer;
}

static dds_entity_t create_reader(dds_entity_t participant) {
  const dds_entity_t topic =
      dds_create_topic(participant, &zerodrift_msg_AngularRate_desc, "angular_rate", NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  return reader;
}

// Takes what came. Negative: the middleware failed.
static int hear(Node* node) {
  void* samples[BATCH] = {NULL};
  dds_sample_info_t infos[BATCH];
  const int count = dds_take(node->rates, samples, infos, BATCH, BATCH);
  for (int i = 0; i < count; ++i) {
    if (!infos[i].valid_data) continue;
    const zerodrift_msg_AngularRate* rate = samples[i];
    if (rate->gyro_id == WORD) {
      node->word = 1;
      continue;
    }
    if (node->word && node->connected) ++node->came_back;
    node->connected = 1;
  }
  if (count > 0) dds_return_loan(node->rates, samples, count);
  return count;
}

// 200 Hz; `epoch_s`: of the first.
static builtin_interfaces_msg_dds__Time_ stamp_of(long n, int32_t epoch_s) {
  const builtin_interfaces_msg_dds__Time_ stamp = {.sec_ = epoch_s + (int32_t)(n / 200),
                                                   .nanosec_ = (uint32_t)(n % 200) * 5000000u};
  return stamp;
}

static char frame_id[] = "imu_link";

static int publish_imu(const Node* node, long n, int32_t epoch_s, int is_printed) {
  const double rate = 1e-3 / (3.0 + (double)n);
  sensor_msgs_msg_dds__Imu_ imu;
  memset(&imu, 0, sizeof imu);
  imu.header_.stamp_ = stamp_of(n, epoch_s);
  imu.header_.frame_id_ = frame_id;
  imu.orientation_covariance_[0] = -1.0;
  imu.linear_acceleration_covariance_[0] = -1.0;
  imu.angular_velocity_.x_ = rate;
  imu.angular_velocity_.y_ = -0.3 * rate;
  imu.angular_velocity_.z_ = n % 2 == 0 ? -0.0 : rate * rate;
  if (is_printed)
    printf("imu %" PRId32 " %" PRIu32 " %a %a %a\n", imu.header_.stamp_.sec_,
           imu.header_.stamp_.nanosec_, imu.angular_velocity_.x_, imu.angular_velocity_.y_,
           imu.angular_velocity_.z_);
  return dds_write(node->imu, &imu);
}

static int publish_temperature(const Node* node, long n, int32_t epoch_s, int is_printed) {
  sensor_msgs_msg_dds__Temperature_ reading;
  memset(&reading, 0, sizeof reading);
  reading.header_.stamp_ = stamp_of(n, epoch_s);
  reading.header_.frame_id_ = frame_id;
  reading.temperature_ = 20.0 + 1.0 / (3.0 + (double)n);
  if (is_printed)
    printf("temperature %" PRId32 " %" PRIu32 " %a\n", reading.header_.stamp_.sec_,
           reading.header_.stamp_.nanosec_, reading.temperature_);
  return dds_write(node->temperature, &reading);
}

// Until the word, every 50 ms.
static int repeat_until_word(Node* node) {
  for (long n = 0; !node->word || !node->connected; ++n) {
    if (publish_imu(node, n, 1000000000, 0) < 0 || publish_temperature(node, n, 1000000000, 0) < 0)
      return 1;
    dds_waitset_wait(node->waitset, NULL, 0, DDS_MSECS(50));
    if (hear(node) < 0) return 1;
  }
  return 0;
}

static int publish_all(Node* node, long samples) {
  for (long n = 0; n < samples; ++n) {
    while (n - node->came_back >= AHEAD) {
      if (dds_waitset_wait(node->waitset, NULL, 0, DDS_SECS(20)) <= 0 || hear(node) < 0) return 1;
    }
    if (publish_imu(node, n, 1700000000, 1) < 0) return 1;
    if (n % 100 == 0 && publish_temperature(node, n, 1700000000, 1) < 0) return 1;
  }
  return 0;
}

int main(int argc, char** argv) {
  if (argc != 3) {
    fprintf(stderr, "usage: ros2_sensor_peer DOMAIN SAMPLES\n");
    return 2;
  }
  const dds_domainid_t domain = (dds_domainid_t)strtoul(argv[1], NULL, 10);
  const dds_entity_t participant = dds_create_participant(domain, NULL, NULL);
  if (participant < 0) {
    fprintf(stderr, "ros2_sensor_peer: %s\n", dds_strretcode(participant));
    return 2;
  }
  Node node = {
      .imu = create_writer(participant, &sensor_msgs_msg_dds__Imu__desc, "rt/imu/data_raw"),
      .temperature =
          create_writer(participant, &sensor_msgs_msg_dds__Temperature__desc, "rt/imu/temperature"),
      .rates = create_reader(participant)};
  node.waitset = dds_create_waitset(participant);
  dds_waitset_attach(node.waitset, dds_create_readcondition(node.rates, DDS_ANY_STATE), 0);
  const int code = repeat_until_word(&node) != 0 || publish_all(&node, strtol(argv[2], NULL, 10));
  if (code == 0) {
    printf("end\n");
    fflush(stdout);
    pause();
  }
  dds_delete(participant);
  return code;
}
