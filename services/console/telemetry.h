// SPDX-License-Identifier: Apache-2.0
// From the system's messages to the console's: the one place where units change. SI comes in, deg/h
// and degC/min go out (idl/proto/telemetry.proto).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/dds/discovery.h"
#include "common/dds/topics.h"
#include "common/service/hop_latency.h"
#include "idl/proto/telemetry.pb.h"

namespace zerodrift::services {

// NaN where a variance is not known (negative).
double sigma_deg_h(double variance_radps2);
// The raw rate, which the correction was taken off; NaN where the axis is not valid.
double raw_deg_h(const msg::CompensatedRate& sample, std::size_t axis);
double compensated_deg_h(const msg::CompensatedRate& sample, std::size_t axis);
double degc_per_min(double degc_per_s);
bool is_valid(const msg::CompensatedRate& sample, std::size_t axis);
// Unix time at which the source wrote it; 0 where its stamp can't be of this host's clock.
std::int64_t publish_unix_ns(const msg::CompensatedRate& sample,
                             const service::ArrivalClocks& arrival);

telemetry::AxisState axis_state(const msg::CompensatedRate& sample, std::size_t axis);
telemetry::CompensatedRate to_telemetry(const msg::CompensatedRate& sample);
// Adds one row.
void append(const msg::CompensatedRate& sample, telemetry::SampleBatch& batch);
// What a batch says of its newest sample; once a batch.
void set_newest(const msg::CompensatedRate& sample, const service::ArrivalClocks& arrival,
                telemetry::SampleBatch& batch);
telemetry::AllanReport to_telemetry(const msg::AllanReport& report);
telemetry::NavigationState to_telemetry(const msg::NavigationState& state);
telemetry::TwinReport to_telemetry(const msg::TwinReport& report);
telemetry::ThermalCoverage to_telemetry(const msg::ThermalCoverage& coverage);
telemetry::ServiceStatus to_telemetry(const msg::ServiceStatus& status, std::int64_t unix_ns);
bool ended_in_order(const telemetry::ServiceStatus& status);
telemetry::Event to_telemetry(const msg::Event& event);
telemetry::Endpoint to_telemetry(const dds::RemoteEndpoint& endpoint);

void set_time(google::protobuf::Timestamp& out, std::int64_t time_ns);
std::int64_t time_ns(const google::protobuf::Timestamp& time);  // what set_time() set

}  // namespace zerodrift::services
