// SPDX-License-Identifier: Apache-2.0
// What a ROS 2 tool does with /diagnostics, by another vendor's middleware: ros2_diagnostics_peer
// DOMAIN. One line a status on standard output, "end" behind each message, until it is stopped or
// nothing came for 20 s.
#include <dds/dds.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>

#include "cyclone_reading.h"
#include "ros2_sensors.h"

// As diagnostic_aggregator subscribes: reliable, volatile, the default depth.
static dds_entity_t create_reader(dds_entity_t participant) {
  const dds_entity_t topic = dds_create_topic(
      participant, &diagnostic_msgs_msg_dds__DiagnosticArray__desc, "rt/diagnostics", NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  return reader;
}

static void print_array(const void* lent) {
  const diagnostic_msgs_msg_dds__DiagnosticArray_* array = lent;
  for (uint32_t i = 0; i < array->status_._length; ++i) {
    const diagnostic_msgs_msg_dds__DiagnosticStatus_* status = &array->status_._buffer[i];
    printf("%d | %s | %s | %s", status->level_, status->name_, status->hardware_id_,
           status->message_);
    for (uint32_t k = 0; k < status->values_._length; ++k)
      printf(" | %s=%s", status->values_._buffer[k].key_, status->values_._buffer[k].value_);
    printf("\n");
  }
  printf("end %" PRId32 " %" PRIu32 "\n", array->header_.stamp_.sec_,
         array->header_.stamp_.nanosec_);
  fflush(stdout);
}

int main(int argc, char** argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: ros2_diagnostics_peer DOMAIN\n");
    return 2;
  }
  const dds_domainid_t domain = (dds_domainid_t)strtoul(argv[1], NULL, 10);
  const dds_entity_t participant = dds_create_participant(domain, NULL, NULL);
  const dds_entity_t reader = participant < 0 ? participant : create_reader(participant);
  if (reader < 0) {
    fprintf(stderr, "ros2_diagnostics_peer: %s\n", dds_strretcode(reader));
    return 2;
  }
  const int code = receive(participant, reader, LONG_MAX, print_array);
  dds_delete(participant);
  return code;
}
