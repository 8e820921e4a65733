// SPDX-License-Identifier: Apache-2.0
// The twin's model and profile files. Errors are ConfigError, one line each.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/config/config_error.h"
#include "common/config/yaml_document.h"
#include "common/twin/model.h"
#include "common/twin/profile.h"
#include "idl/proto/twin.pb.h"

namespace zerodrift::config {

struct LoadedModel {
  twin::Model model;
  std::vector<std::string>
      warnings;  // one line each: what of a newer version's file is kept unread
};

// Reads and validates. In a file of this format version (twin::kModelFormatVersion; absent = 1) or
// an older one an unknown key or effect is an error. In a newer version's file it is kept, reported
// as a warning, takes no part in simulation, and save_model writes it back.
[[nodiscard]] LoadedModel load_model(const std::filesystem::path& path);
[[nodiscard]] LoadedModel model_from(const YamlDocument& document);

// The model as YAML.
[[nodiscard]] std::string model_text(const twin::Model& model);
// Writes that, whole or not at all. load_model gives it back equal to the bit;
// comments of a file it was read from are not kept.
void save_model(const twin::Model& model, const std::filesystem::path& path);

[[nodiscard]] twin::Profile load_profile(const std::filesystem::path& path);
// Writes the profile as YAML, whole or not at all, behind these lines of comment. load_profile
// gives it back; rates and angles, which the file has in degrees, to a last bit.
void save_profile(const twin::Profile& profile, const std::vector<std::string>& comments,
                  const std::filesystem::path& path);

// A value that the schema allows and the twin doesn't; `problem` names its key.
class InvalidField : public std::invalid_argument {
 public:
  explicit InvalidField(twin::Problem problem)
      : std::invalid_argument(problem.text()), problem_(std::move(problem)) {}

  [[nodiscard]] const twin::Problem& problem() const noexcept { return problem_; }

 private:
  twin::Problem problem_;
};

// Throw InvalidField where a field is missing, wrong or fails the twin's own validation.
[[nodiscard]] twin::Model model_from_proto(const proto::TwinModel& message);
[[nodiscard]] twin::Profile profile_from_proto(const proto::TwinProfile& message);
[[nodiscard]] proto::TwinModel to_proto(const twin::Model& model);
[[nodiscard]] proto::TwinProfile to_proto(const twin::Profile& profile);

}  // namespace zerodrift::config
