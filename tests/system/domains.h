// SPDX-License-Identifier: Apache-2.0
// A DDS domain for each system test, so that no test hears another.
#pragma once

#include <cstdint>

namespace zerodrift::system_test {

enum class Domain : std::uint32_t {
  kRecordLive = 120,
  kSimulationLive,
  kTwoGyros,
  kTurnsWithoutReference,
  kTurnsWithReference,
  kRealRecord,
  kBadSamples,
  kTemperatureStops,
  kProbeStuck,
  kTwoPublishersOneId,
  kBadStart,
  kTruncatedRecord,
  kBadInTheMiddle,
  kSerialGyro,
  kSysfsThermometer,
  kCyclonePeer,
  kMemory,
  kStopAlone,
  kStopInMidRun,
  kStopWithoutConsumer,
  kStopInPause,
  kThermalKilled,
  kThermalKilledAtRealTime,
  kControl,
  kControlNobody,
  kCompare,
  kCheckpoint,
  kAllanLateJoiner,
  kAllanTwoGyros,
  kAllanNoiseStep,
  kAllanHarmfulCompensation,
  kAllanStuck,
  kAllanGap,
  kAllanBadSamples,
  kAllanNewRate,
  kAllanSameN,
  kAllanCommand,
  kPrior,
  kDiagnoseCommand,
  kAllanProgress,
  kDiagnoseLive,
  kDiagnoseLiveStop,
  kLast = 199,
};

}  // namespace zerodrift::system_test
