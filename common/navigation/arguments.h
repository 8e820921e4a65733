// SPDX-License-Identifier: Apache-2.0
// A command line's part of GyroNavigationOptions, in the units people use: the service and
// `zerodrift navigate` have the same.
#pragma once

#include <optional>
#include <string>

#include "common/navigation/gyro_navigation.h"

namespace zerodrift::navigation {

struct NavigationArguments {
  std::optional<double> latitude_deg{};
  std::optional<double> heading_deg{};
  double roll_deg = 0.0;
  double pitch_deg = 0.0;
  double heading_sigma_deg = 0.1;
  double tilt_sigma_deg = 0.1;
  double alignment_s = 60.0;
  std::string frame = "flu";
  std::string updates = "rest";
  bool residual_feedback = false;

  // Throws std::invalid_argument with one line that names the wrong option.
  [[nodiscard]] GyroNavigationOptions complete() const;
};

// `app`: a CLI::App, which this folder doesn't know. Gives the option --alignment, a time whose
// unit is the caller's to read.
template <typename App>
auto* add_arguments(App& app, NavigationArguments& arguments) {
  app.add_option("--latitude", arguments.latitude_deg,
                 "deg, north positive; without, Earth's rate is left out and no reference given");
  app.add_option("--heading", arguments.heading_deg,
                 "at the start, deg clockwise from north; without, it is sought by Earth's rate");
  app.add_option("--roll", arguments.roll_deg,
                 "at the start and at each stop, deg, right side down")
      ->capture_default_str();
  app.add_option("--pitch", arguments.pitch_deg, "as --roll, deg, nose up")->capture_default_str();
  app.add_option("--heading-sigma", arguments.heading_sigma_deg, "1 sigma of --heading, deg")
      ->capture_default_str();
  app.add_option("--tilt-sigma", arguments.tilt_sigma_deg, "1 sigma of --roll and --pitch, deg")
      ->capture_default_str();
  app.add_option("--frame", arguments.frame, "axes of the gyro: flu or frd")->capture_default_str();
  auto* alignment =
      app.add_option("--alignment", arguments.alignment_s,
                     "hold the attitude at the start for so long as it stands, at most");
  app.add_option("--updates", arguments.updates,
                 "rest: the filters are updated at rest; none: free inertial")
      ->capture_default_str();
  app.add_flag(
      "--residual-feedback", arguments.residual_feedback,
      "also publish what each update at rest finds left of the drift; the compensation takes "
      "it only with reference.navigation_residual: accept");
  return alignment;
}

}  // namespace zerodrift::navigation
