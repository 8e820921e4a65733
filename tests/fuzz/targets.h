// SPDX-License-Identifier: Apache-2.0
// Every parser that takes foreign bytes, as a function of these bytes. A target refuses what the
// parser may refuse and throws Broken where it did what no input may make it do; a sanitizer sees
// the rest.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string_view>

namespace zerodrift::fuzz {

using Bytes = std::span<const std::uint8_t>;

class Broken : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

// What an input looks like stands at the head of targets/<name>.cpp.
void chamber_limits(Bytes input);
void checkpoint(Bytes input);
void column_map(Bytes input);
void compensation_config(Bytes input);
void datagram(Bytes input);
void dds_payload(Bytes input);
void diagnosis_findings(Bytes input);
void mcap(Bytes input);
void formula(Bytes input);
void foxglove_frame(Bytes input);
void http_target(Bytes input);
void record_csv(Bytes input);
void ros2_bag(Bytes input);
void running_state(Bytes input);
void sample_stream(Bytes input);
void serial_frames(Bytes input);
void sysfs_thermometer(Bytes input);
void twin_model(Bytes input);
void twin_profile(Bytes input);

struct Target {
  std::string_view
      name;  // of the file in targets/, the folder in corpus/ and the program fuzz_<name>
  void (*run)(Bytes input);
};

inline constexpr std::array kTargets{
    Target{"chamber_limits", chamber_limits},
    Target{"checkpoint", checkpoint},
    Target{"column_map", column_map},
    Target{"compensation_config", compensation_config},
    Target{"datagram", datagram},
    Target{"dds_payload", dds_payload},
    Target{"diagnosis_findings", diagnosis_findings},
    Target{"mcap", mcap},
    Target{"formula", formula},
    Target{"foxglove_frame", foxglove_frame},
    Target{"http_target", http_target},
    Target{"record_csv", record_csv},
    Target{"ros2_bag", ros2_bag},
    Target{"running_state", running_state},
    Target{"sample_stream", sample_stream},
    Target{"serial_frames", serial_frames},
    Target{"sysfs_thermometer", sysfs_thermometer},
    Target{"twin_model", twin_model},
    Target{"twin_profile", twin_profile},
};

}  // namespace zerodrift::fuzz
