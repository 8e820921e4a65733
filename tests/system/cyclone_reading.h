// SPDX-License-Identifier: Apache-2.0
// How peers made with Cyclone DDS read.
#pragma once

#include <dds/dds.h>

typedef void (*PrintSample)(const void* sample);

// Reads a topic as our reliable readers do, and hands samples to `print` until there were `samples`
// (text, as is the domain). Gives an exit code: 0; 1 when none came for 20 s or the middleware
// failed meanwhile; 2, with a line, where it gives no reader.
int print_samples(const char* program, const char* domain, const dds_topic_descriptor_t* type,
                  const char* topic, const char* samples, PrintSample print);
