// SPDX-License-Identifier: Apache-2.0
// Events of counters that a data path keeps: a table says which counter is which event.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "common/service/host.h"

namespace zerodrift::service {

template <typename Counts>
struct CountedEvent {
  std::uint64_t Counts::*counter;
  const char* code;
  std::string_view text;
};

// Raises for each counter that has grown by how much it has. `common` gives what the events share;
// its text stands before theirs.
template <typename Counts, std::size_t size>
void raise_grown(Host& host, const std::array<CountedEvent<Counts>, size>& events,
                 const Occurrence& common, const Counts& before, const Counts& now) {
  for (const CountedEvent<Counts>& event : events) {
    if (now.*event.counter <= before.*event.counter) continue;
    Occurrence occurrence = common;
    occurrence.code = event.code;
    occurrence.text += event.text;
    host.raise_counted(std::move(occurrence), now.*event.counter - before.*event.counter);
  }
}

}  // namespace zerodrift::service
