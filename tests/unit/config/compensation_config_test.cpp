// SPDX-License-Identifier: Apache-2.0
// The configuration of compensation: defaults, every key, and one clear line for what is wrong.
#include "common/config/compensation_config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "common/compensation/compensator.h"
#include "common/compensation/drift_prior.h"
#include "common/compensation/option_keys.h"
#include "common/config/configuration_text.h"
#include "common/config/whole_file.h"
#include "common/core/units.h"
#include "tests/unit/config/error_after.h"

namespace zerodrift::config {
namespace {

using compensation::CompensationOptions;

class CompensationFile : public testing::Test {
 protected:
  CompensationFile() { std::filesystem::create_directories(folder_); }
  ~CompensationFile() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] CompensationOptions loaded(const std::string& text) const {
    write_whole(path_, text);
    return load_compensation(path_);
  }

  // Name of a model file beside the configuration, whose only effect is a bias.
  [[nodiscard]] std::string model_of_bias(const std::string& bias_deg_h) const {
    write_whole(folder_ / "model.yaml",
                "format_version: 1\neffects:\n  - {kind: bias, axis: x, parameters: {bias_deg_h: " +
                    bias_deg_h + "}}\n");
    return "model.yaml";
  }

  // What follows "<folder>/compensation.yaml:" in the error of loading this text.
  [[nodiscard]] std::string error(const std::string& text) const {
    return error_after(path_.string() + ':', [&] { (void)loaded(text); });
  }

  [[nodiscard]] std::string folder_name() const { return folder_.filename().string(); }

 private:
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("zerodrift-config-" + std::to_string(::getpid()));
  std::filesystem::path path_ = folder_ / "compensation.yaml";
};

// Everything that a file can set, to the bit.
std::string described(const CompensationOptions& o) {
  std::ostringstream text;
  text << std::hexfloat << static_cast<int>(o.scheme);
  for (const auto& feature : o.features) {
    text << " | feature " << static_cast<int>(feature.kind) << ' ' << feature.probe << ' '
         << feature.second_probe << ' ' << feature.lag_s << ' ' << feature.offset << ' '
         << feature.scale.value_or(-1.0);
  }
  text << " | rate " << static_cast<int>(o.track.rate_method) << ' '
       << o.track.local_polynomial.window_s << ' ' << o.track.sliding_mean.window_samples;
  text << " | svr " << o.model.capacity << ' ' << o.model.epsilon << ' ' << o.model.box_constraint
       << ' ' << static_cast<int>(o.model.kernel.kind) << ' ' << o.model.kernel.gamma << ' '
       << o.model.kernel.degree << ' ' << o.model.kernel.offset << ' '
       << (o.model.selection ? static_cast<int>(*o.model.selection) : -1) << ' '
       << static_cast<int>(o.model.window);
  text << " | learning " << o.learning.label_interval_s << ' ' << o.learning.confirm_s << ' '
       << o.learning.handover_s << ' ' << o.learning.initial_labels << ' '
       << o.learning.rest.dwell_s << ' ' << o.learning.rest.max_level_radps << ' '
       << o.learning.rest.max_slew_radps2 << ' ' << o.learning.scale_factor;
  text << " | earth " << static_cast<int>(o.earth_rate.mode);
  for (const double rate : o.earth_rate.rate_radps) text << ' ' << rate;
  for (const auto& polynomial : o.factory_polynomial_radps) {
    text << " | polynomial";
    for (const double coefficient : polynomial) text << ' ' << coefficient;
  }
  text << " | times " << o.temperature_delay_s << ' ' << o.temperature_stale_s << ' '
       << o.probe_stuck_s;
  const auto& reference = o.reference;
  text << " | reference " << static_cast<int>(reference.truth) << ' '
       << static_cast<int>(reference.rest) << ' ' << static_cast<int>(reference.navigation_residual)
       << ' ' << reference.await_feedback << ' ' << reference.largest_rest_sigma_radps << ' '
       << reference.largest_residual_sigma_radps << ' ' << reference.innovation_sigmas << ' '
       << reference.largest_correction_radps << ' ' << reference.correction_slew_radps2 << ' '
       << reference.correction_memory_s;
  text << " | prior " << (o.prior ? compensation::prior_identity(*o.prior) : "none");
  for (const auto& probe : o.more_probes) text << ' ' << probe;
  text << " | mounting";
  for (const auto& axis : o.mounting.axes) text << ' ' << axis;
  for (const double element : o.mounting.matrix) text << " m " << element;
  for (const double element : o.mounting.general_matrix) text << " g " << element;
  return text.str();
}

// Keys that a file can give, without the index of a list.
std::set<std::string> all_keys() {
  class Keys final : public compensation::OptionTextVisitor {
   public:
    std::set<std::string> names;
    std::optional<std::size_t> groups(const std::string&, const char*) override { return 1; }

   private:
    void see(const compensation::OptionKey& key, const std::string&) override {
      std::string name = key.name;
      if (const auto index = name.find("[0]"); index != std::string::npos) name.erase(index, 3);
      if (!key.internal) names.insert(name);
    }
  };
  CompensationOptions options;
  Keys keys;
  compensation::describe(options, keys);
  return keys.names;
}

TEST_F(CompensationFile, AnEmptyOneKeepsEveryDefault) {
  for (const char* text : {"", "{}", "# only a comment\n", "svr: {}\nlearning:\nfeatures:\n"}) {
    EXPECT_EQ(described(loaded(text)), described(CompensationOptions{})) << text;
  }
}

TEST_F(CompensationFile, EveryKeyChangesSomething) {
  const std::string earth =
      "earth_rate: {mode: known, latitude_deg: 40, roll_deg: 1, pitch_deg: 2, heading_deg: 3}";
  const auto earth_with = [&](const std::string& from, const std::string& to) {
    std::string changed = earth;
    changed.replace(changed.find(from), from.size(), to);
    return std::pair{earth, changed};
  };
  // For each key, a text without and one with it (or with another value of it).
  const std::map<std::string, std::pair<std::string, std::string>> cases{
      {"scheme", {"", "scheme: none"}},
      {"features.kind",
       {"features: [{kind: temperature}]", "features: [{kind: temperature_rate}]"}},
      {"features.probe",
       {"features: [{kind: temperature}]", "features: [{kind: temperature, probe: case}]"}},
      {"features.second_probe",
       {"features: [{kind: probe_difference, second_probe: case}]",
        "features: [{kind: probe_difference, second_probe: board}]"}},
      {"features.lag_s",
       {"features: [{kind: lagged_temperature, lag_s: 1}]",
        "features: [{kind: lagged_temperature, lag_s: 2}]"}},
      {"features.scale",
       {"features: [{kind: temperature}]", "features: [{kind: temperature, scale: 3}]"}},
      {"temperature_rate.estimator", {"", "temperature_rate: {estimator: sliding_mean}"}},
      {"temperature_rate.window_s", {"", "temperature_rate: {window_s: 30}"}},
      {"svr.capacity", {"", "svr: {capacity: 100}"}},
      {"svr.epsilon", {"", "svr: {epsilon: 0.02}"}},
      {"svr.box_constraint", {"", "svr: {box_constraint: 10}"}},
      {"svr.kernel", {"", "svr: {kernel: matern52}"}},
      {"svr.gamma", {"", "svr: {gamma: 0.5}"}},
      {"svr.degree", {"svr: {kernel: polynomial}", "svr: {kernel: polynomial, degree: 2}"}},
      {"svr.offset", {"svr: {kernel: polynomial}", "svr: {kernel: polynomial, offset: 2}"}},
      {"svr.selection", {"", "svr: {selection: fixed}"}},
      {"svr.window", {"", "svr: {window: fifo}"}},
      {"learning.label_interval_s", {"", "learning: {label_interval_s: 10}"}},
      {"learning.confirm_s", {"", "learning: {confirm_s: 10}"}},
      {"learning.handover_s", {"", "learning: {handover_s: 2}"}},
      {"learning.max_drift_deg_h", {"", "learning: {max_drift_deg_h: 5}"}},
      {"learning.max_drift_slew_deg_h_s", {"", "learning: {max_drift_slew_deg_h_s: 0.1}"}},
      {"learning.scale_factor", {"", "learning: {scale_factor: true}"}},
      {"earth_rate.mode", {"", "earth_rate: {mode: unknown}"}},
      {"earth_rate.latitude_deg", earth_with("latitude_deg: 40", "latitude_deg: 41")},
      {"earth_rate.roll_deg", earth_with("roll_deg: 1", "roll_deg: 5")},
      {"earth_rate.pitch_deg", earth_with("pitch_deg: 2", "pitch_deg: 5")},
      {"earth_rate.heading_deg", earth_with("heading_deg: 3", "heading_deg: 5")},
      {"earth_rate.frame", earth_with("heading_deg: 3", "heading_deg: 3, frame: frd")},
      {"mounting.axes", {"", "mounting: {axes: [-y, x, z]}"}},
      {"mounting.matrix", {"", "mounting: {matrix: [0, -1, 0, 1, 0, 0, 0, 0, 1]}"}},
      {"mounting.general_matrix",
       {"", "mounting: {general_matrix: [0, -1, 0.02, 1, 0, 0, 0, 0, 1.01]}"}},
      {"factory_polynomial.x_deg_h", {"", "factory_polynomial: {x_deg_h: [1, 2]}"}},
      {"factory_polynomial.y_deg_h", {"", "factory_polynomial: {y_deg_h: [1, 2]}"}},
      {"factory_polynomial.z_deg_h", {"", "factory_polynomial: {z_deg_h: [1, 2]}"}},
      {"temperature_delay_s", {"", "temperature_delay_s: 0.1"}},
      {"temperature_stale_s", {"", "temperature_stale_s: 5"}},
      {"probe_stuck_s", {"", "probe_stuck_s: 60"}},
      {"reference.truth", {"", "reference: {truth: refuse}"}},
      {"reference.rest", {"", "reference: {rest: refuse}"}},
      {"reference.navigation_residual", {"", "reference: {navigation_residual: accept}"}},
      {"reference.await_feedback", {"", "reference: {await_feedback: true}"}},
      {"reference.largest_rest_sigma_deg_h", {"", "reference: {largest_rest_sigma_deg_h: 0.5}"}},
      {"reference.largest_residual_sigma_deg_h",
       {"", "reference: {largest_residual_sigma_deg_h: 0.5}"}},
      {"reference.innovation_sigmas", {"", "reference: {innovation_sigmas: 4}"}},
      {"reference.largest_correction_deg_h", {"", "reference: {largest_correction_deg_h: 0.2}"}},
      {"reference.correction_slew_deg_h_s", {"", "reference: {correction_slew_deg_h_s: 0.1}"}},
      {"reference.correction_memory_s", {"", "reference: {correction_memory_s: 60}"}},
      {"prior", {"", "prior: " + model_of_bias("0.5")}},
      {"probes", {"", "probes: [board]"}},
  };
  std::set<std::string> tried;
  for (const auto& [key, texts] : cases) {
    tried.insert(key);
    EXPECT_NE(described(loaded(texts.first)), described(loaded(texts.second))) << key;
  }
  EXPECT_EQ(tried, all_keys()) << "every key needs a case here";
}

TEST_F(CompensationFile, ValuesArriveInTheirUnits) {
  const auto options = loaded(
      "learning: {max_drift_deg_h: 5, confirm_s: 7}\n"
      "temperature_rate: {window_s: 60}\n"
      "factory_polynomial: {y_deg_h: [0.5, -0.25]}\n");
  EXPECT_EQ(options.learning.rest.max_level_radps, core::radps_from_deg_h(5.0));
  EXPECT_EQ(options.learning.rest.dwell_s, 7.0);
  EXPECT_EQ(options.track.sliding_mean.window_samples, 12000U) << "K of the paper at 200 Hz";
  EXPECT_TRUE(options.factory_polynomial_radps[0].empty());
  ASSERT_EQ(options.factory_polynomial_radps[1].size(), 2U);
  EXPECT_EQ(options.factory_polynomial_radps[1][1], core::radps_from_deg_h(-0.25));
}

TEST_F(CompensationFile, TheKernelAndItsSelectionArriveByTheirNames) {
  using regression::KernelKind;
  using regression::SelectionCriterion;
  const std::pair<std::string, KernelKind> kernels[] = {{"rbf", KernelKind::kRbf},
                                                        {"matern32", KernelKind::kMatern32},
                                                        {"matern52", KernelKind::kMatern52},
                                                        {"polynomial", KernelKind::kPolynomial},
                                                        {"linear", KernelKind::kLinear}};
  for (const auto& [name, kind] : kernels)
    EXPECT_EQ(loaded("svr: {kernel: " + name + "}").model.kernel.kind, kind) << name;

  const std::pair<std::string, std::optional<SelectionCriterion>> selections[] = {
      {"marginal_likelihood", SelectionCriterion::kMarginalLikelihood},
      {"leave_one_out", SelectionCriterion::kLeaveOneOut},
      {"paper", SelectionCriterion::kPaper},
      {"fixed", std::nullopt}};
  for (const auto& [name, criterion] : selections)
    EXPECT_EQ(loaded("svr: {selection: " + name + "}").model.selection, criterion) << name;

  const auto kernel =
      loaded("svr: {kernel: polynomial, gamma: 0.5, degree: 2, offset: 0.25}").model.kernel;
  EXPECT_EQ(kernel, (regression::Kernel{KernelKind::kPolynomial, 0.5, 2, 0.25}));
}

TEST_F(CompensationFile, AKeyThatTheKernelHasNotIsNamed) {
  EXPECT_EQ(error("svr:\n  degree: 2\n"), "2: svr.degree: expected with kernel polynomial only");
  EXPECT_EQ(error("svr:\n  kernel: matern32\n  offset: 1\n"),
            "3: svr.offset: expected with kernel polynomial only");
  EXPECT_EQ(error("svr:\n  kernel: linear\n  gamma: 1\n"),
            "3: svr.gamma: found a gamma of kernel linear, which has none");
}

TEST_F(CompensationFile, AKeyThatTheModeOrTheKindHasNotIsNamed) {
  for (const char* key : {"latitude_deg", "roll_deg", "pitch_deg", "heading_deg"}) {
    for (const char* mode : {"auto", "included", "unknown"}) {
      EXPECT_EQ(error("earth_rate:\n  mode: " + std::string(mode) + "\n  " + key + ": 48\n"),
                "3: earth_rate." + std::string(key) + ": expected with mode known only");
    }
  }
  EXPECT_EQ(error("earth_rate: {latitude_deg: 48}\n"),
            "1: earth_rate.latitude_deg: expected with mode known only");
  EXPECT_EQ(error("features:\n  - {kind: temperature, lag_s: 5}\n"),
            "2: features[0].lag_s: expected with kind lagged_temperature only");
  EXPECT_EQ(error("features:\n  - {kind: temperature, second_probe: case}\n"),
            "2: features[0].second_probe: expected with kind probe_difference only");
}

// Rule: what passes here never fails where the learner is made, at any corner of the ranges.
TEST_F(CompensationFile, WhatIsAcceptedTheLearnerAcceptsToo) {
  const std::string kernels[] = {"rbf, gamma: 1e-4",
                                 "matern52, gamma: 1e4",
                                 "linear",
                                 "polynomial, degree: 8, offset: 5.6",
                                 "polynomial, offset: 100",
                                 "polynomial, degree: 1, offset: 1e6"};
  std::size_t accepted = 0;
  for (const std::string& kernel : kernels) {
    for (const char* epsilon : {"1e-4", "1.1e-3", "1"}) {
      for (const char* box : {"1e-3", "1", "1e6"}) {
        const std::string text = "svr: {capacity: 10, kernel: " + kernel + ", epsilon: " + epsilon +
                                 ", box_constraint: " + box + "}";
        if (error(text) != "no error") continue;
        ++accepted;
        EXPECT_NO_THROW(compensation::Compensator{loaded(text)}) << text;
      }
    }
  }
  EXPECT_EQ(accepted, 6U * (3U * 3U - 1U))
      << "only the smallest tube with the largest C is refused";
}

TEST_F(CompensationFile, AnUnknownKeyIsNamed) {
  EXPECT_EQ(error("svr:\n  epsilom: 1\n"), "2: svr.epsilom: unknown key; did you mean 'epsilon'?");
  EXPECT_EQ(error("svr:\n  rbf_gamma: 1\n"),
            "2: svr.rbf_gamma: unknown key; did you mean 'gamma'?");
  EXPECT_EQ(error("schema: none\n"), "1: schema: unknown key; did you mean 'scheme'?");
}

TEST_F(CompensationFile, AWordThatIsNoChoiceIsNamedWithTheChoices) {
  EXPECT_EQ(error("\nscheme: offline\n"),
            "2: scheme: found 'offline', expected one of online-svr, stack, none");
  EXPECT_EQ(error("svr:\n  window: lifo\n"),
            "2: svr.window: found 'lifo', expected one of two_tier, fifo");
  EXPECT_EQ(error("svr:\n  kernel: gauss\n"),
            "2: svr.kernel: found 'gauss', expected one of rbf, matern32, matern52, polynomial, "
            "linear");
  EXPECT_EQ(error("svr:\n  selection: none\n"),
            "2: svr.selection: found 'none', expected one of marginal_likelihood, leave_one_out, "
            "paper, fixed");
  EXPECT_EQ(error("earth_rate: {mode: flat}\n"),
            "1: earth_rate.mode: found 'flat', expected one of auto, included, known, unknown");
  EXPECT_EQ(error("temperature_rate:\n  estimator: mean\n"),
            "2: temperature_rate.estimator: found 'mean', expected one of sliding_mean, "
            "local_polynomial");
  EXPECT_EQ(error("features:\n  - kind: temperature\n  - kind: humidity\n"),
            "3: features[1].kind: found 'humidity', expected one of temperature, "
            "temperature_rate, temperature_times_rate, lagged_temperature, probe_difference, "
            "pulse_mean, pulse_rate");
}

TEST_F(CompensationFile, AWrongTypeIsNamed) {
  EXPECT_EQ(error("svr: {epsilon: small}\n"),
            "1: svr.epsilon: expected a plain number, found 'small'");
  EXPECT_EQ(error("svr: {capacity: 10.5}\n"),
            "1: svr.capacity: expected a whole number, 10 to 5000, found '10.5'");
  EXPECT_EQ(error("probe_stuck_s: 15 min\n"),
            "1: probe_stuck_s: expected a plain number in s, found '15 min'");
  EXPECT_EQ(error("svr: 3\n"), "1: svr: expected keys and values, found '3'");
  EXPECT_EQ(error("features: temperature\n"), "1: features: expected a list, found 'temperature'");
}

TEST_F(CompensationFile, AValueOutOfRangeIsNamed) {
  const std::map<std::string, std::string> cases{
      {"svr:\n  epsilon: 0\n", "2: svr.epsilon: found 0, expected 0.0001 to 1"},
      {"svr:\n  epsilon: 1.5\n", "2: svr.epsilon: found 1.5, expected 0.0001 to 1"},
      {"svr:\n  box_constraint: 1e6\n  epsilon: 1e-3\n",
       "3: svr.epsilon: found 0.001, expected more than 0.001, 1e-9 box_constraint"},
      {"svr:\n  box_constraint: -1\n", "2: svr.box_constraint: found -1, expected 0.001 to 1e+06"},
      {"svr:\n  box_constraint: 2e6\n",
       "2: svr.box_constraint: found 2e+06, expected 0.001 to 1e+06"},
      {"svr:\n  gamma: -1\n", "2: svr.gamma: found -1, expected 0.0001 to 10000"},
      {"svr:\n  gamma: 1e-5\n", "2: svr.gamma: found 1e-05, expected 0.0001 to 10000"},
      {"svr:\n  gamma: 1e5\n", "2: svr.gamma: found 100000, expected 0.0001 to 10000"},
      {"svr:\n  kernel: polynomial\n  degree: 0\n", "3: svr.degree: found 0, expected 1 to 8"},
      {"svr:\n  kernel: polynomial\n  degree: 9\n", "3: svr.degree: found 9, expected 1 to 8"},
      {"svr:\n  kernel: polynomial\n  degree: -2\n", "3: svr.degree: found -2, expected 1 to 8"},
      {"svr:\n  kernel: polynomial\n  offset: -1\n", "3: svr.offset: found -1, expected 0 to 100"},
      {"svr:\n  kernel: polynomial\n  degree: 2\n  offset: 1001\n",
       "4: svr.offset: found 1001, expected 0 to 1000"},
      {"svr:\n  capacity: 9\n", "2: svr.capacity: found 9, expected 10 to 5000"},
      {"svr:\n  capacity: 5001\n", "2: svr.capacity: found 5001, expected 10 to 5000"},
      {"learning:\n  label_interval_s: -1\n",
       "2: learning.label_interval_s: found -1, expected 0 to 1e+06"},
      {"mounting:\n  axes: [x, y]\n",
       "2: mounting.axes: found another list, expected each of x, y, z once, with or without -"},
      {"mounting:\n  matrix: [1, 0, 0, 0, 1, 0, 0, 0]\n",
       "2: mounting.matrix: found 8 numbers, expected 9, row by row"},
      {"mounting:\n  matrix: [1, 0, 0, 0, 1, 0.01, 0, 0, 1]\n",
       "2: mounting.matrix: found rows off orthogonal by 0.010000, expected at most 0.001000 "
       "(mounting.general_matrix takes axes that are not square)"},
      {"mounting:\n  general_matrix: [1, 0, 0, 0, 1, 0.2, 0, 0, 1]\n",
       "2: mounting.general_matrix: found rows off orthogonal by 0.200000, expected at most "
       "0.100000"},
      {"mounting: {axes: [x, y, z], matrix: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n",
       "1: mounting: found more than one of axes, matrix and general_matrix"},
      {"learning:\n  handover_s: 0\n",
       "2: learning.handover_s: found 0, expected a number above 0, at most 1e+06"},
      {"learning:\n  confirm_s: 601\n", "2: learning.confirm_s: found 601, expected 0 to 600"},
      {"learning:\n  max_drift_deg_h: -1\n",
       "2: learning.max_drift_deg_h: found -1, expected a number above 0"},
      {"learning:\n  max_drift_slew_deg_h_s: 0\n",
       "2: learning.max_drift_slew_deg_h_s: found 0, expected a number above 0"},
      {"temperature_delay_s: 11\n", "1: temperature_delay_s: found 11, expected 0 to 10"},
      {"temperature_stale_s: 0\n",
       "1: temperature_stale_s: found 0, expected a number above 0, at most 1e+06"},
      {"probe_stuck_s: -5\n",
       "1: probe_stuck_s: found -5, expected a number above 0, at most 1e+06"},
      {"temperature_rate:\n  window_s: 0\n",
       "2: temperature_rate.window_s: found 0, expected 1 to 14400"},
      {"temperature_rate:\n  estimator: sliding_mean\n  window_s: 1e30\n",
       "3: temperature_rate.window_s: found 1e+30, expected 1 to 14400"},
      {"features:\n  - kind: lagged_temperature\n    lag_s: -1\n",
       "3: features[0].lag_s: found -1, expected a number above 0, at most 900000"},
      {"features:\n  - {kind: temperature, scale: 0}\n",
       "2: features[0].scale: found 0, expected 1e-09 to 1e+09"},
      {"features:\n  - {kind: temperature, scale: 1e-320}\n",
       "2: features[0].scale: found 9.99989e-321, expected 1e-09 to 1e+09"},
      {"features: []\n",
       "1: features: found an empty list, expected one or more, or no such key, which keeps the "
       "default"},
      {"earth_rate: {mode: known, latitude_deg: 91, roll_deg: 0, pitch_deg: 0, heading_deg: 0}\n",
       "1: earth_rate.latitude_deg: found 91, expected -90 to 90"},
      {"earth_rate: {mode: known, latitude_deg: 0, roll_deg: 181, pitch_deg: 0, heading_deg: 0}\n",
       "1: earth_rate.roll_deg: found 181, expected -180 to 180"},
      {"earth_rate: {mode: known, latitude_deg: 0, roll_deg: 0, pitch_deg: 5000, heading_deg: 0}\n",
       "1: earth_rate.pitch_deg: found 5000, expected -90 to 90"},
      {"earth_rate: {mode: known, latitude_deg: 0, roll_deg: 0, pitch_deg: 0, heading_deg: 1e18}\n",
       "1: earth_rate.heading_deg: found 1e+18, expected -180 to 360"},
  };
  for (const auto& [text, line] : cases) EXPECT_EQ(error(text), line) << text;
}

// Rule: the path counts from the configuration's folder, and what is wrong is told of the key and
// of the model's file.
TEST_F(CompensationFile, ThePriorIsAModelFileBesideTheConfiguration) {
  const auto options = loaded("prior: " + model_of_bias("0.5") + "\n");
  ASSERT_TRUE(options.prior.has_value());
  EXPECT_EQ(options.prior->effects.front().parameters.at("bias_deg_h"), 0.5);
  EXPECT_EQ(loaded("prior: ../" + folder_name() + "/model.yaml\n").prior->effects.size(), 1U);
  const auto refused = [&](const std::string& text, const std::string& file,
                           const std::string& what) {
    try {
      (void)loaded(text);
      ADD_FAILURE() << text;
    } catch (const ConfigError& problem) {
      const std::string line = problem.what();
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
      EXPECT_NE(line.find("compensation.yaml:1: "), std::string::npos) << line;
      EXPECT_NE(line.find(file), std::string::npos) << line;
      EXPECT_NE(line.find(what), std::string::npos) << line;
    }
  };
  refused("prior: none.yaml\n", "none.yaml", ": cannot open");
  refused("prior: .\n", "", "found something else than a file");
  refused("prior: " + model_of_bias("wide") + "\n", "model.yaml:3", "bias_deg_h");
  refused("probes: ['']\n", "compensation.yaml:1", "probes[0]");
  (void)model_of_bias("1}}\n  - {kind: biass, axis: x, parameters: {bias_deg_h: 1");
  refused("prior: model.yaml\n", "model.yaml:4", "biass");
}

TEST_F(CompensationFile, AKnownEarthRateNeedsItsAngles) {
  EXPECT_EQ(error("scheme: none\nearth_rate:\n  mode: known\n  latitude_deg: 40\n"),
            "3: earth_rate: mode known needs latitude_deg, roll_deg, pitch_deg and heading_deg");
}

TEST_F(CompensationFile, AGroupThatIsNoMappingIsNamed) {
  EXPECT_EQ(error("features: [3]\n"), "1: features[0]: expected keys and values, found '3'");
  EXPECT_EQ(error("features:\n  - probe: coil\n"),
            "2: features[0].kind: found '', expected one of temperature, temperature_rate, "
            "temperature_times_rate, lagged_temperature, probe_difference, pulse_mean, pulse_rate");
  EXPECT_EQ(error("factory_polynomial: {x_deg_h: 3}\n"),
            "1: factory_polynomial.x_deg_h: expected a list, found '3'");
  EXPECT_EQ(error("svr: {epsilon: 1, epsilon: 1}\n"), "1: svr.epsilon: this key stands twice");
  EXPECT_EQ(error("svr: {kernel: {a: 1}}\n"), "1: svr.kernel: expected a text, found a mapping");
}

// Rule: one attitude, one Earth rate, in the axes that the vehicle's are.
TEST_F(CompensationFile, TheEarthsRateIsInTheFrameThatIsSaid) {
  const std::string known =
      "earth_rate: {mode: known, latitude_deg: 48, roll_deg: 10, pitch_deg: -20, heading_deg: 30";
  const auto flu = loaded(known + "}").earth_rate.rate_radps;
  const auto frd = loaded(known + ", frame: frd}").earth_rate.rate_radps;
  EXPECT_EQ(loaded(known + ", frame: flu}").earth_rate.rate_radps, flu);
  EXPECT_EQ(frd, (core::PerAxis<double>{flu[0], -flu[1], -flu[2]}));
}

TEST_F(CompensationFile, ALimitThatIsNoneIsPrintedAsThatAndNotAsANumber) {
  EXPECT_NE(effective_yaml({}).find("\n  # max_drift_deg_h: no limit  # "), std::string::npos);
  EXPECT_NE(
      effective_yaml(loaded("learning: {max_drift_deg_h: 5}")).find("\n  max_drift_deg_h: 5 "),
      std::string::npos);
}

// Law: what is printed as being in force, read again, is in force.
TEST_F(CompensationFile, WhatIsPrintedAsInForceReadsBackToTheSame) {
  const std::string texts[] = {
      "", "scheme: none\nsvr: {kernel: polynomial, degree: 2, offset: 0.25, epsilon: 0.013}\n",
      "features:\n  - {kind: probe_difference, probe: 'it''s: #1', second_probe: board}\n"
      "  - {kind: lagged_temperature, lag_s: 33.3, scale: 0.7}\n  - {kind: pulse_mean}\n",
      "svr: {kernel: linear, window: fifo, selection: fixed}\nprobes: [board, '007']\n"
      "factory_polynomial: {x_deg_h: [0.1, -3e-5], z_deg_h: [7]}\n",
      "earth_rate: {mode: known, latitude_deg: 48.1, roll_deg: 1, pitch_deg: -2, heading_deg: 33}\n"
      "learning: {max_drift_deg_h: 100, confirm_s: 7}\nreference: {await_feedback: true}\n"
      "temperature_rate: {estimator: sliding_mean, window_s: 33}\n"};
  for (const std::string& text : texts) {
    const CompensationOptions options = loaded(text);
    const std::string yaml = effective_yaml(options);
    const CompensationOptions again = loaded(yaml);
    EXPECT_EQ(effective_yaml(again), yaml);
    for (const auto decides : {compensation::Decides::kModel, compensation::Decides::kAnswers}) {
      const auto before = compensation::option_values(options, decides);
      const auto after = compensation::option_values(again, decides);
      ASSERT_EQ(before.size(), after.size());
      for (std::size_t i = 0; i < before.size(); ++i)
        EXPECT_EQ(before[i].value, after[i].value) << before[i].key << " of\n" << yaml;
    }
  }
}

TEST_F(CompensationFile, TheReferencePageIsWhatTheProgramPrints) {
  EXPECT_EQ(read_whole(std::string(ZERODRIFT_SOURCE_DIR) + "/docs/configuration.md"),
            configuration_reference())
      << "docs/configuration.md is made by `zerodrift config reference`";
}

}  // namespace
}  // namespace zerodrift::config
