// SPDX-License-Identifier: Apache-2.0
// What a ROS 2 tool does with /diagnostics, by another vendor's middleware: ros2_diagnostics_peer
// DOMAIN. One line a status on standard output, "end" behind each message, until it is stopped or
// nothing came for 20 s.
#include <dds/dds.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>

#include "cyclone_reading.h"
#include "ros2_sensors.h"

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
  char without_end[24];
  snprintf(without_end, sizeof without_end, "%ld", LONG_MAX);
  return print_samples("ros2_diagnostics_peer", argv[1],
                       &diagnostic_msgs_msg_dds__DiagnosticArray__desc, "rt/diagnostics",
                       without_end, print_array);
}
