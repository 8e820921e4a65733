// SPDX-License-Identifier: Apache-2.0
// Input: one byte, then the content of a thermometer's file. The byte says of which kind: m for
// millidegrees, w for the 1-wire text.
#include "common/drivers/sysfs_thermometer.h"

#include <cmath>

#include "common/drivers/driver_error.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/scratch_file.h"

namespace zerodrift::fuzz {

void sysfs_thermometer(Bytes input) {
  static ScratchFile millidegrees("temp1_input");
  static ScratchFile one_wire("w1_slave");
  if (input.empty()) return;
  ScratchFile& file = input.front() == 'w' ? one_wire : millidegrees;
  file.fill(as_text(input.subspan(1)));
  try {
    drivers::SysfsThermometer thermometer(drivers::describe_thermometer("coil", file.path()));
    const drivers::ThermometerReading reading = thermometer.read();
    demand(reading.sample.measured == std::isfinite(reading.sample.temperature_degc),
           "what was measured is a number");
    if (!reading.sample.measured) demand_one_line(reading.reason);
  } catch (const drivers::DriverError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
