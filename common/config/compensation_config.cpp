// SPDX-License-Identifier: Apache-2.0
#include "common/config/compensation_config.h"

#include <algorithm>
#include <string>
#include <system_error>

#include "common/compensation/drift_prior.h"
#include "common/compensation/option_keys.h"
#include "common/config/option_reader.h"
#include "common/config/twin_config.h"
#include "common/core/units.h"
#include "common/navigation/earth_rate.h"

namespace zerodrift::config {
namespace {

using compensation::CompensationOptions;

// Lines that start with the wrong key ("key: what" or "key what"), as errors of this file.
ConfigError error_of(const YamlDocument& file, const std::string& line) {
  const auto end = std::min(line.find_first_of(": "), line.size());
  const auto what = std::min(line.find_first_not_of(": ", end), line.size());
  return file.error(line.substr(0, end), line.substr(what));
}

void resolve_earth_rate(const YamlDocument& file, compensation::EarthRateOptions& earth) {
  if (earth.mode != compensation::EarthRateMode::kKnown) return;
  if (!earth.latitude_deg || !earth.roll_deg || !earth.pitch_deg || !earth.heading_deg) {
    throw file.error("earth_rate",
                     "mode known needs latitude_deg, roll_deg, pitch_deg and heading_deg");
  }
  const navigation::Attitude attitude{.roll_rad = *earth.roll_deg * core::kRadPerDeg,
                                      .pitch_rad = *earth.pitch_deg * core::kRadPerDeg,
                                      .heading_rad = *earth.heading_deg * core::kRadPerDeg};
  earth.rate_radps =
      navigation::earth_rate_radps_b(*earth.latitude_deg * core::kRadPerDeg, attitude, earth.frame);
}

}  // namespace

CompensationOptions load_compensation(const std::filesystem::path& path) {
  const YamlDocument file = YamlDocument::read(path);
  const std::filesystem::path folder = path.parent_path();
  CompensationOptions options;
  OptionReader reader(file,
                      [&folder](const std::string& name) { return load_prior(folder / name); });
  compensation::describe(options, reader);
  reader.refuse_unknown();
  resolve_earth_rate(file, options.earth_rate);
  if (const auto line = options.validate()) throw error_of(file, *line);
  return options;
}

namespace {

twin::Model checked_prior(twin::Model model, const std::string& file) {
  if (const auto line = compensation::find_wrong_prior(model))
    throw ConfigError(file + ": " + *line);
  return model;
}

}  // namespace

twin::Model load_prior(const std::filesystem::path& path) {
  std::error_code problem;
  if (std::filesystem::exists(path, problem)) {
    if (!std::filesystem::is_regular_file(path, problem)) {
      throw ConfigError(path.string() + ": found something else than a file, expected a model");
    }
    const std::uintmax_t size = std::filesystem::file_size(path, problem);
    if (problem || size > kLargestModelFile) {
      throw ConfigError(path.string() + ": found more bytes than a model has, expected at most " +
                        std::to_string(kLargestModelFile));
    }
  }
  return checked_prior(load_model(path).model, path.string());
}

twin::Model prior_from_text(const std::string& text, const std::string& name) {
  return checked_prior(model_from(YamlDocument::parse(text, name)).model, name);
}

}  // namespace zerodrift::config
