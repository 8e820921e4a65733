// SPDX-License-Identifier: Apache-2.0
// One end of a link in a process of its own, led by lines on its standard input. Each is answered
// by one line on its standard output:
//
//   connected                 yes | no
//   send HZ COUNT             FIRST LAST: sequence numbers of what was sent, once it was
//   answer on | off           done; whether each sample received is sent back
//   received FIRST LAST       DUPLICATES, then the latency of each received in ns (-1: not
//   received) lose PERMILLE             number of sockets that lose datagrams from now on
//
// It ends with its standard input.
#pragma once

#include "common/service/realtime.h"
#include "tests/bench/latency_link.h"

namespace zerodrift::bench {

struct LatencyEndOptions {
  LinkOptions link;
  std::size_t capacity = 0;  // samples of its whole life
  service::RealtimeOptions realtime;
};

int run_latency_end(const LatencyEndOptions& options);

}  // namespace zerodrift::bench
