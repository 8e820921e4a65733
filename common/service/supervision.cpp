// SPDX-License-Identifier: Apache-2.0
#include "common/service/supervision.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "common/core/one_line.h"
#include "common/service/time_option.h"

namespace zerodrift::service {

void add_supervision_options(CLI::App& app, Supervision& supervision) {
  app.add_option("--peer-within", supervision.peer_within_s,
                 "end with exit code 1 if nobody is at the other end after so long")
      ->transform(in_seconds_above_0());
  show_default_in("s", app.add_option("--stale-after", supervision.stale_after_s,
                                      "silence of a publisher that is still there, after which "
                                      "samples are stale: so long, or three of their intervals "
                                      "where that is longer")
                           ->transform(in_seconds_above_0()));
  app.add_flag(
      "--exit-when-stale", supervision.exit_when_stale,
      "end with exit code 1 then, to be started again; not after a publisher that ended in "
      "order");
  app.add_option("--health-file", supervision.health_file,
                 "written once a second, for `zerodrift health`")
      ->envname("ZERODRIFT_HEALTH_FILE");
}

FlowWatch::Verdict FlowWatch::judge(const Flow& flow, std::size_t peers, double now_s) {
  met_ = met_ || peers > 0;
  if (flow.samples != samples_ || flow.paced || peers == 0) moved_s_ = now_s;
  samples_ = flow.samples;
  if (!met_ && supervision_.peer_within_s > 0.0 &&
      now_s - started_s_ > supervision_.peer_within_s) {
    return Verdict::kNobody;
  }
  const double limit_s = std::max(supervision_.stale_after_s, 3.0 * flow.interval_s);
  return samples_ > 0 && silent_s(now_s) > limit_s ? Verdict::kStale : Verdict::kFine;
}

void write_health(const std::filesystem::path& file, const Health& health) {
  std::error_code error;
  const auto there = std::filesystem::symlink_status(file, error);
  if (std::filesystem::is_other(there) || std::filesystem::is_directory(there)) {
    throw std::runtime_error(
        fmt::format("health file {}: a device, pipe, socket or folder is there and would be "
                    "replaced; give the name of a file",
                    file.string()));
  }
  const std::filesystem::path beside = file.string() + ".new";
  std::ofstream out(beside, std::ios::trunc);
  out << fmt::format("{} {} {} {} {}\n", health.monotonic_ns, health.process_id, health.service,
                     health.state, core::one_line(health.summary));
  out.close();
  error.clear();
  if (out) std::filesystem::rename(beside, file, error);
  if (!out || error) {
    throw std::runtime_error(fmt::format(
        "health file {}: cannot be written ({}); give a folder that this user may write to",
        file.string(), error ? error.message() : std::strerror(errno)));
  }
}

Health read_health(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) {
    throw std::runtime_error(
        fmt::format("health file {}: cannot be read ({}); has the service "
                    "begun, with the same --health-file?",
                    file.string(), std::strerror(errno)));
  }
  Health health;
  in >> health.monotonic_ns >> health.process_id >> health.service >> health.state;
  if (!in) {
    throw std::runtime_error(
        fmt::format("health file {}: is none that a service writes", file.string()));
  }
  in.ignore(1);
  std::getline(in, health.summary);
  return health;
}

std::string why_unhealthy(const Health& health, std::int64_t now_ns,
                          std::chrono::duration<double> at_most) {
  const std::chrono::duration<double> age{std::chrono::nanoseconds(now_ns - health.monotonic_ns)};
  // Of the future: written before this computer was started.
  if (age > at_most || age.count() < 0.0) {
    return fmt::format("{} (pid {}) last said how it is {} s ago: it hangs or is gone",
                       health.service, health.process_id,
                       age.count() < 0.0 ? "?" : fmt::format("{:.1f}", age.count()));
  }
  if (health.state == "degraded" || health.state == "stopping") {
    return fmt::format("{} (pid {}) is {}: {}", health.service, health.process_id, health.state,
                       health.summary);
  }
  return "";
}

}  // namespace zerodrift::service
