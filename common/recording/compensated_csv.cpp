// SPDX-License-Identifier: Apache-2.0
#include "common/recording/compensated_csv.h"

#include <cmath>
#include <string>

namespace zerodrift::recording {
namespace {

record::RecordWriterOptions layout() {
  record::RecordWriterOptions options;
  options.metadata = {{"stream", "compensated"}};
  options.columns = {"time_s"};
  for (const auto axis : core::kAxes)
    options.columns.push_back("rate_" + std::string(core::name(axis)) + "_rad_s");
  options.columns.push_back("sequence");
  options.columns.push_back("model_epoch");
  for (const auto axis : core::kAxes) {
    const std::string suffix = "_" + std::string(core::name(axis));
    options.columns.push_back("applied_drift" + suffix + "_rad_s");
    options.columns.push_back("drift_sigma" + suffix + "_rad_s");
    options.columns.push_back("mode" + suffix);
    options.columns.push_back("reason" + suffix);
    options.columns.push_back("rung" + suffix);
  }
  return options;
}

}  // namespace

CompensatedCsv::CompensatedCsv(const std::filesystem::path& path) : writer_(path, layout()) {}

void CompensatedCsv::write(const core::CompensatedSample& sample) {
  writer_.time(sample.raw.time);
  for (const auto axis : core::kAxes) {
    const std::size_t i = core::index(axis);
    sample.raw.valid[i] ? writer_.number(sample.rate_radps[i]) : writer_.blank();
  }
  writer_.text(std::to_string(sample.raw.sequence));
  writer_.text(std::to_string(sample.model_epoch));
  for (const auto axis : core::kAxes) {
    const std::size_t i = core::index(axis);
    writer_.number(sample.applied_drift_radps[i]);
    sample.drift_variance[i] >= 0.0 ? writer_.number(std::sqrt(sample.drift_variance[i]))
                                    : writer_.blank();
    writer_.text(core::name(sample.mode[i]));
    writer_.text(core::name(sample.reason[i]));
    writer_.text(core::name(sample.rung[i]));
  }
  writer_.end_row();
}

}  // namespace zerodrift::recording
