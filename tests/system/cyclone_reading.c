// SPDX-License-Identifier: Apache-2.0
#include "cyclone_reading.h"

#include <stdio.h>
#include <stdlib.h>

#define BATCH 64

// Hands on what is there; the number of samples, or negative where the middleware failed.
static int take(dds_entity_t reader, PrintSample print) {
  void* samples[BATCH] = {NULL};  // NULL: lent by the middleware
  dds_sample_info_t infos[BATCH];
  const int count = dds_take(reader, samples, infos, BATCH, BATCH);
  int valid = 0;
  for (int i = 0; i < count; ++i) {
    if (!infos[i].valid_data) continue;
    print(samples[i]);
    ++valid;
  }
  if (count > 0) dds_return_loan(reader, samples, count);
  return count < 0 ? count : valid;
}

static int receive(dds_entity_t participant, dds_entity_t reader, long wanted, PrintSample print) {
  const dds_entity_t condition = dds_create_readcondition(reader, DDS_ANY_STATE);
  const dds_entity_t waitset = dds_create_waitset(participant);
  dds_waitset_attach(waitset, condition, 0);
  for (long received = 0; received < wanted;) {
    if (dds_waitset_wait(waitset, NULL, 0, DDS_SECS(20)) <= 0) return 1;
    const int count = take(reader, print);
    if (count < 0) return 1;
    received += count;
  }
  return 0;
}

// The counterpart of the writer's quality of service in common/dds/topics.h.
static dds_entity_t create_reader(dds_entity_t participant, const dds_topic_descriptor_t* type,
                                  const char* name) {
  const dds_entity_t topic = dds_create_topic(participant, type, name, NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  return reader;
}

int print_samples(const char* program, const char* domain, const dds_topic_descriptor_t* type,
                  const char* topic, const char* samples, PrintSample print) {
  const dds_entity_t participant =
      dds_create_participant((dds_domainid_t)strtoul(domain, NULL, 10), NULL, NULL);
  const dds_entity_t reader =
      participant < 0 ? participant : create_reader(participant, type, topic);
  if (reader < 0) {
    fprintf(stderr, "%s: %s\n", program, dds_strretcode(reader));
    return 2;
  }
  const int code = receive(participant, reader, strtol(samples, NULL, 10), print);
  dds_delete(participant);
  return code;
}
