// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/options.h"

#include <charconv>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "common/config/compensation_config.h"
#include "common/service/instance_sync.h"
#include "common/service/time_option.h"
#include "services/compensation/command_files.h"

namespace zerodrift::services {
namespace {

std::pair<std::uint32_t, std::string> gyro_and_topic(const std::string& text) {
  const std::size_t equals = text.find('=');
  std::uint32_t gyro_id = 0;
  const std::string_view id = std::string_view(text).substr(0, equals);
  const auto [end, error] = std::from_chars(id.data(), id.data() + id.size(), gyro_id);
  if (equals == std::string::npos || error != std::errc() || end != id.data() + id.size() ||
      gyro_id == 0) {
    throw std::invalid_argument("--ros2-imu: found '" + text +
                                "', expected GYRO_ID=TOPIC with an id from 1 on, e.g. 1=imu/data");
  }
  return {gyro_id, text.substr(equals + 1)};
}

std::optional<double> checkpoint_period(std::string_view text) {
  const auto time_s = core::parse_time_s(text);
  return time_s && *time_s >= 1.0 && *time_s <= 86400.0 ? time_s : std::nullopt;
}

}  // namespace

CompensationNodeOptions CompensationArguments::complete() const {
  require_place_of_checkpoints(node.checkpoint_dir);
  CompensationNodeOptions options = node;
  options.redundant = node.redundant || ownership_strength > 0;
  if (!config.empty()) options.compensation = config::load_compensation(config);
  if (!prior.empty()) options.compensation.prior = config::load_prior(prior);
  for (const std::string& text : ros2_imu) {
    auto [gyro_id, topic] = gyro_and_topic(text);
    const dds::RosImuOptions imu{.name = std::move(topic),
                                 .frame_id = ros2_frame_id,
                                 .frame = ros2_frame == gyro_frame ? dds::RosFrame::kAsMeasured
                                                                   : dds::RosFrame::kYAndZReversed};
    if (const auto problem = imu.validate()) throw std::invalid_argument(*problem);
    options.ros2_imu[gyro_id] = imu;
  }
  return options;
}

void add_options(CLI::App& app, CompensationArguments& arguments) {
  CompensationNodeOptions& node = arguments.node;
  app.add_option("--config", arguments.config,
                 "YAML or JSON file (docs/configuration.md); defaults without");
  app.add_option("--prior", arguments.prior,
                 "a twin's model: drift = model + what is learned of the remainder; overrides the "
                 "file. Of one gyro: run a service for each");
  app.add_option("--instance", node.instance,
                 "number of this instance, 0 to 15; with several, give each its own")
      ->check(CLI::Range(0U, service::kMostInstances - 1))
      ->capture_default_str();
  app.add_flag(
      "--redundant", node.redundant,
      "one of several instances that answer the same: a subscriber misses nothing when one "
      "dies");
  app.add_option("--ownership-strength", arguments.ownership_strength,
                 "former name of --redundant, where it is above 0")
      ->group("");
  app.add_option(
         "--await-subscribers", node.await_subscribers,
         "with records and simulations: take no sample before so many subscribers are there")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option("--max-gyros", node.max_gyros,
                 "gyros compensated at most; samples of others are not answered, which is reported")
      ->check(CLI::Range(std::size_t{1}, CompensationNode::kMostGyros))
      ->capture_default_str();
  app.add_option("--checkpoint-dir", node.checkpoint_dir,
                 "existing, writable folder of checkpoints: of `ctl checkpoint` and `ctl restore`, "
                 "and of those that are made from time to time and resumed from at the start")
      ->check(CLI::ExistingDirectory);
  app.add_option("--checkpoint-period", node.checkpoint_period_s,
                 "with --checkpoint-dir: time between two checkpoints made without being asked")
      ->transform(service::with_unit(checkpoint_period, "a time from 1s to 24h, as 60, 60s or 5min",
                                     "60s|5min|5h|200ms"))
      ->default_str("60s");
  app.add_option("--model-dir", node.model_dir,
                 "existing folder of model files: what `ctl adopt` takes models from, by name; "
                 "without, none is adopted")
      ->check(CLI::ExistingDirectory);
  const auto frames = CLI::IsMember({"flu", "frd"});
  app.add_option("--ros2-imu", arguments.ros2_imu,
                 "GYRO_ID=TOPIC (repeatable): that gyro's rates as ROS 2's sensor_msgs/Imu too, "
                 "e.g. 1=imu/data; with it, the state of gyros and services on /diagnostics")
      ->delimiter(',');
  app.add_option("--gyro-frame", arguments.gyro_frame,
                 "body frame that the gyro measures in, forward-left-up or forward-right-down")
      ->check(frames)
      ->capture_default_str();
  app.add_option("--ros2-frame", arguments.ros2_frame,
                 "body frame of --ros2-imu; flu is what ROS 2 nodes expect (REP 103)")
      ->check(frames)
      ->capture_default_str();
  app.add_option("--ros2-frame-id", arguments.ros2_frame_id,
                 "frame_id in the header of --ros2-imu; gyro_<id> without");
}

}  // namespace zerodrift::services
