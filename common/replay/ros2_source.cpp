// SPDX-License-Identifier: Apache-2.0
#include "common/replay/ros2_source.h"

#include <stdexcept>

namespace zerodrift::replay {
namespace {

using service::Severity;

constexpr double kPatienceS = 5.0;  // until a line says who is waited for

}  // namespace

void add_ros2_options(CLI::App& app, RosOptions& options) {
  app.add_option("--ros2-domain", options.domain,
                 "ros2: ROS_DOMAIN_ID of the nodes, if it isn't --domain")
      ->check(CLI::Range(0U, 232U));
}

RosParticipant::RosParticipant(service::Host& host, const dds::NetworkOptions& network,
                               const RosOptions& options)
    : host_(host), domain_(options.domain.value_or(network.domain)) {
  if (domain_ == network.domain) return;
  if (!network.security_dir.empty()) {
    throw std::invalid_argument(
        "--ros2-domain: found " + std::to_string(domain_) +
        " beside --security, expected the domain of the secured system: rates from an unsecured "
        "domain would pass for its own");
  }
  dds::NetworkOptions other = network;
  other.domain = domain_;
  other_.emplace(host.name() + "_ros2", other);
}

void RosParticipant::report() {
  if (other_) other_->report_events(host_.observer());
}

RosTopicWatch::RosTopicWatch(service::Host& host, std::uint32_t gyro_id, std::uint32_t domain)
    : host_(host), gyro_id_(gyro_id), domain_(domain) {}

void RosTopicWatch::raise(const char* code, Severity severity, const std::string& topic,
                          const std::string& text, std::uint64_t times) {
  host_.raise_counted({.code = code,
                       .severity = severity,
                       .text = text,
                       .gyro_id = gyro_id_,
                       .sensor_time_ns = 0,
                       .subject = topic},
                      times);
}

void RosTopicWatch::report(const std::string& topic, std::string_view type, int publishers,
                           std::uint64_t refused, double waited_s) {
  const std::uint64_t unstamped = unstamped_;
  raise("ros2_stamp_missing", Severity::kWarning, topic,
        topic +
            ": messages without a header.stamp (0, or no time) are left out: a sample's time is "
            "its sensor's",
        unstamped - reported_unstamped_);
  reported_unstamped_ = unstamped;
  if (publishers == 0 && received_ == 0 && waited_s > kPatienceS && !reported_nobody_) {
    reported_nobody_ = true;
    raise("ros2_no_publisher", Severity::kInformation, topic,
          "nobody publishes " + topic + " (" + std::string(type) + ") in domain " +
              std::to_string(domain_) + " yet; `ros2 topic info -v` names topic, type and domain",
          1);
  }
  raise("duplicate_publisher", Severity::kWarning, topic,
        topic +
            ": a second publisher sends on this topic; only the first is used, until it is gone "
            "or silent",
        refused - reported_refused_);
  reported_refused_ = refused;
}

}  // namespace zerodrift::replay
