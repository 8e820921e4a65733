// SPDX-License-Identifier: Apache-2.0
/* One hop of Cyclone DDS with our AngularRate, to be measured beside ours. Plain C: nothing else of
 * this program sees that middleware. Loopback only; reliable, volatile, as the topic has it. */
#ifndef ZERODRIFT_COMMON_DDS_CYCLONE_HOP_H
#define ZERODRIFT_COMMON_DDS_CYCLONE_HOP_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct cyclone_hop;

struct cyclone_sample {
  uint64_t sequence;
  int64_t sent_ns;
  double interval_s;
};

/* On a thread of the middleware. */
typedef void (*cyclone_on_sample)(void* context, const struct cyclone_sample* sample);

/* `name` keeps apart hops in one domain. Null where the middleware refuses. */
struct cyclone_hop* cyclone_hop_open(uint32_t domain, const char* name, bool near_end,
                                     cyclone_on_sample on_sample, void* context);
void cyclone_hop_close(struct cyclone_hop* hop);
/* Both directions are matched. */
bool cyclone_hop_connected(const struct cyclone_hop* hop);
void cyclone_hop_send(struct cyclone_hop* hop, const struct cyclone_sample* sample);

#ifdef __cplusplus
}
#endif
#endif
