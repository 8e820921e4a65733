// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/cyclone_hop.h"

#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>

#include "angular_rate.h"
#include "tests/support/cyclone_loopback.h"

#define DEPTH 2000

struct cyclone_hop {
  dds_entity_t domain;
  dds_entity_t participant;
  dds_entity_t writer;
  dds_entity_t reader;
  cyclone_on_sample on_sample;
  void* context;
};

static void on_data(dds_entity_t reader, void* argument) {
  const struct cyclone_hop* hop = argument;
  void* samples[1] = {NULL};  // lent by the middleware
  dds_sample_info_t info[1];
  while (dds_take(reader, samples, info, 1, 1) == 1) {
    if (info[0].valid_data) {
      const zerodrift_msg_AngularRate* rate = samples[0];
      const struct cyclone_sample sample = {rate->sequence_number, rate->publish_time_ns,
                                            rate->interval_s};
      hop->on_sample(hop->context, &sample);
    }
    dds_return_loan(reader, samples, 1);
    samples[0] = NULL;
  }
}

static dds_entity_t topic(const struct cyclone_hop* hop, const char* name, const char* direction) {
  char text[256];
  snprintf(text, sizeof text, "%s_%s", name, direction);
  return dds_create_topic(hop->participant, &zerodrift_msg_AngularRate_desc, text, NULL, NULL);
}

static void open_endpoints(struct cyclone_hop* hop, const char* name, bool near_end) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, DEPTH);
  dds_listener_t* listener = dds_create_listener(hop);
  dds_lset_data_available(listener, on_data);
  hop->writer =
      dds_create_writer(hop->participant, topic(hop, name, near_end ? "there" : "back"), qos, NULL);
  hop->reader = dds_create_reader(hop->participant, topic(hop, name, near_end ? "back" : "there"),
                                  qos, listener);
  dds_delete_listener(listener);
  dds_delete_qos(qos);
}

struct cyclone_hop* cyclone_hop_open(uint32_t domain, const char* name, bool near_end,
                                     cyclone_on_sample on_sample, void* context) {
  struct cyclone_hop* hop = calloc(1, sizeof *hop);
  if (hop == NULL) return NULL;
  hop->on_sample = on_sample;
  hop->context = context;
  hop->domain = dds_create_domain(domain, kLoopbackOnly);
  hop->participant = dds_create_participant(domain, NULL, NULL);
  if (hop->participant > 0) open_endpoints(hop, name, near_end);
  if (hop->writer > 0 && hop->reader > 0) return hop;
  cyclone_hop_close(hop);
  return NULL;
}

void cyclone_hop_close(struct cyclone_hop* hop) {
  if (hop->participant > 0) dds_delete(hop->participant);
  if (hop->domain > 0) dds_delete(hop->domain);
  free(hop);
}

bool cyclone_hop_connected(const struct cyclone_hop* hop) {
  dds_publication_matched_status_t there;
  dds_subscription_matched_status_t back;
  return dds_get_publication_matched_status(hop->writer, &there) == DDS_RETCODE_OK &&
         dds_get_subscription_matched_status(hop->reader, &back) == DDS_RETCODE_OK &&
         there.current_count > 0 && back.current_count > 0;
}

void cyclone_hop_send(struct cyclone_hop* hop, const struct cyclone_sample* sample) {
  const double rate_radps = 7.3e-5;
  zerodrift_msg_AngularRate rate = {.gyro_id = 1,
                                    .validity = 7,
                                    .sequence_number = sample->sequence,
                                    .sensor_time_ns = sample->sent_ns,
                                    .rate_radps = {rate_radps, rate_radps, rate_radps},
                                    .interval_s = sample->interval_s,
                                    .clock_source = 1,
                                    .publish_time_ns = sample->sent_ns};
  dds_write(hop->writer, &rate);
}
