// SPDX-License-Identifier: Apache-2.0
// How peers made with Cyclone DDS read.
#pragma once

#include <dds/dds.h>

typedef void (*PrintSample)(const void* sample);

// Hands samples to `print` until there were `wanted`. 0; 1 when none came for 20 s or the
// middleware failed.
int receive(dds_entity_t participant, dds_entity_t reader, long wanted, PrintSample print);
