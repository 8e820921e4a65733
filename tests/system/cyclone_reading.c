// SPDX-License-Identifier: Apache-2.0
#include "cyclone_reading.h"

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

int receive(dds_entity_t participant, dds_entity_t reader, long wanted, PrintSample print) {
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
