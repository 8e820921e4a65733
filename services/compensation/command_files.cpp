// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/command_files.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/compensation/drift_prior.h"
#include "common/config/compensation_config.h"
#include "common/core/counted.h"
#include "common/files/boot_id.h"
#include "common/files/descriptor.h"
#include "common/files/file_error.h"
#include "common/files/named_file.h"
#include "common/files/unfinished_file.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::services {
namespace {

std::string read(const std::filesystem::path& folder, const std::string& file,
                 std::size_t most_bytes) {
  try {
    return files::read_named(folder, file, most_bytes);
  } catch (const files::NameRefused& refused) {
    throw CommandRefused(refused.what());
  }
}

constexpr int kMostRefused = 9;  // files of a gyro that are put aside

void require_name(const std::string& name) {
  if (const auto problem = files::problem_of_name(name)) throw CommandRefused(*problem);
}

}  // namespace

std::string checkpoint_name(const std::string& argument) {
  if (argument.empty()) return "saved";
  require_name(argument);
  return argument;
}

std::string checkpoint_file_name(std::uint32_t gyro_id, const std::string& name) {
  return std::to_string(gyro_id) + "-" + name + ".ckpt";
}

std::string put_aside(const std::filesystem::path& folder, std::uint32_t gyro_id) {
  std::error_code error;
  const auto latest = folder / checkpoint_file_name(gyro_id, kLatestCheckpoint);
  if (!std::filesystem::is_regular_file(latest, error)) return "";
  for (int k = 1; k <= kMostRefused; ++k) {
    const std::string name = k == 1 ? "refused" : "refused-" + std::to_string(k);
    const auto target = folder / checkpoint_file_name(gyro_id, name);
    if (std::filesystem::exists(target, error)) continue;
    std::filesystem::rename(latest, target, error);
    return error ? "" : name;
  }
  return "";
}

std::string how_long_ago(std::int64_t saved_unix_s, std::int64_t now_unix_s) {
  constexpr std::int64_t kHourS = 3600;
  constexpr std::int64_t kDayS = 24 * kHourS;
  if (saved_unix_s == 0) return "at a time that it doesn't say";
  if (saved_unix_s > now_unix_s) return "at a time that is still to come by this clock";
  const std::int64_t age_s = now_unix_s - std::max<std::int64_t>(saved_unix_s, 0);
  if (age_s < 2 * kHourS) return std::to_string(age_s) + " s ago";
  if (age_s < 2 * kDayS) return std::to_string(age_s / kHourS) + " hours ago";
  return std::to_string(age_s / kDayS) + " days ago";
}

void require_place_of_checkpoints(const std::filesystem::path& folder) {
  if (folder.empty()) return;
  const files::UnfinishedFile probe(folder / (".probe." + std::to_string(::getpid())));
  const files::Descriptor file(
      ::open(probe.path().c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600));
  const int error = errno;
  if (file.is_open() || error == ENOSPC || error == EDQUOT) return;
  throw std::invalid_argument("--checkpoint-dir: found '" + folder.string() +
                              "', in which no file can be created (" + std::strerror(error) +
                              "), expected a folder that this user may write to");
}

std::shared_ptr<compensation::RestoredLearner> checkpoint_named(const std::filesystem::path& folder,
                                                                const std::string& name,
                                                                const checkpoint::Owner& owner) {
  const std::string file = checkpoint_file_name(owner.gyro_id, name);
  const std::string bytes = read(folder, file, checkpoint::kLargestFile);
  try {
    return checkpoint::restored_from(bytes, owner, files::boot_id());
  } catch (const checkpoint::CheckpointError& error) {
    throw CommandRefused(files::quoted_name(file) + " " + error.kind());
  } catch (const std::exception&) {
    throw CommandRefused(files::quoted_name(file) + " can't be used");
  }
}

void save_as(const std::filesystem::path& folder, const std::string& name,
             const checkpoint::Owner& owner, compensation::LearnerState state) {
  const std::string file = checkpoint_file_name(owner.gyro_id, name);
  state.boot = files::boot_id();
  state.saved_unix_s = service::unix_time_ns() / 1'000'000'000;
  try {
    checkpoint::save(folder / file, owner, state);
  } catch (const files::FileError& error) {
    // "<path>: <what the system says>": where the service's folders lie is not everybody's.
    const std::string text = error.what();
    const std::size_t reason = text.find(": ", folder.string().size());
    throw CommandRefused(files::quoted_name(file) + (reason == std::string::npos
                                                         ? ": cannot be written"
                                                         : text.substr(reason)));
  }
}

twin::Model model_named(const std::filesystem::path& folder, const std::string& name) {
  if (folder.empty()) {
    throw CommandRefused(
        "models are taken from a folder of the service's computer, and none is configured; start "
        "the service with --model-dir DIR");
  }
  require_name(name);
  const std::string text = read(folder, name, config::kLargestModelFile);
  const auto refusal = [&](const std::string& place) {
    return CommandRefused("model " + files::quoted_name(name) + " can't be a prior" +
                          (place.empty() ? "" : ": " + place) +
                          "; `zerodrift compensate --prior` where the file lies tells why");
  };
  try {
    return config::prior_from_text(text, name);
  } catch (const config::ConfigError& error) {
    throw refusal(error.place());
  } catch (const std::exception&) {
    throw refusal("");
  }
}

std::shared_ptr<compensation::PriorChange> change_to(
    const twin::Model& model, const std::string& name,
    const compensation::CompensationOptions& options) {
  try {
    return std::make_shared<compensation::PriorChange>(options, model);
  } catch (const std::invalid_argument&) {
    const auto probes = options.probes();
    const auto is_missing = [&](const std::string& probe) {
      return std::find(probes.begin(), probes.end(), probe) == probes.end();
    };
    const auto needed = compensation::prior_probes(model, probes);
    const auto missing =
        static_cast<std::size_t>(std::count_if(needed.begin(), needed.end(), is_missing));
    std::string known;
    for (const auto& probe : probes) known += (known.empty() ? "" : ", ") + probe;
    throw CommandRefused("model " + files::quoted_name(name) + " reads " +
                         core::counted(missing, "temperature") + " that " +
                         (missing == 1 ? "is not configured; name the probe"
                                       : "are not configured; name the probes") +
                         " under probes in the service's --config, which has " + known);
  }
}

}  // namespace zerodrift::services
