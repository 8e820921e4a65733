// SPDX-License-Identifier: Apache-2.0
#include "services/allan_monitor/report_message.h"

#include <gtest/gtest.h>

namespace zerodrift::services {
namespace {

using allan::Identification;
using allan::NoiseTerm;
using allan::ShortTaus;

std::uint64_t told(Identification identification, ShortTaus short_taus = ShortTaus::kMixture) {
  allan::StreamReport report;
  report.coefficients.short_taus = short_taus;
  report.coefficients.coefficients[allan::index(NoiseTerm::kBiasInstability)].identification =
      identification;
  return to_message(report).bias_instability().identified();
}

// Rule: the numbers are allan_report.idl's, and recordings hold them.
TEST(ReportMessage, TellsAFigureThatWasWithheldFromOneThatWasNotFitted) {
  EXPECT_EQ(told(Identification::kNotFitted), 0U);
  EXPECT_EQ(told(Identification::kInterval), 1U);
  EXPECT_EQ(told(Identification::kUpperBound), 2U);
  EXPECT_EQ(told(Identification::kWithheld), 3U);
  EXPECT_EQ(told(Identification::kWithheld, ShortTaus::kBandLimited), 3U);
  EXPECT_EQ(told(Identification::kWithheld, ShortTaus::kNeverWhite), 4U);
}

}  // namespace
}  // namespace zerodrift::services
