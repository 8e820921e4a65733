// SPDX-License-Identifier: Apache-2.0
// Instances receive each other's answers. One that is behind asks another for its state on the
// checkpoint topic, keeps a log of its inputs meanwhile, and goes on from the state through the log
// (common/service/gyro_pipeline.h).
#include <chrono>
#include <cstddef>
#include <exception>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "common/checkpoint/checkpoint_bytes.h"
#include "common/config/compensation_config.h"
#include "common/config/twin_config.h"
#include "common/core/state_archive.h"
#include "common/service/monotonic_clock.h"
#include "services/compensation/compensation_node.h"
#include "services/compensation/instances.h"

namespace zerodrift::services {

using service::Severity;

namespace {

using namespace std::chrono_literals;

constexpr auto kQuiescentWithin = 20s;  // a model is due for a fraction of the time
// What was written before the state is with all readers then, or never: whoever takes the state
// writes what comes after it.
constexpr auto kReceivedWithin = 1s;
constexpr std::size_t kRoomForPath = 1U << 20U;
constexpr std::size_t kLargestPart = 32768;
constexpr std::uint32_t kPartsAtOnce = 16;  // a quarter of the topic's history
constexpr std::size_t kShortLog = 16;       // inputs that samples may wait for

std::string prior_text(const Gyro& source) {
  return source.options.prior ? config::model_text(*source.options.prior) : "";
}

bool is_in_sync(const Gyro& source) {
  return source.pipeline().sync().health() == service::InstanceSync::Health::kInSync;
}

}  // namespace

void CompensationNode::on_peer(const msg::CompensatedRate& message) {
  const std::lock_guard lock(data_mutex_);
  if (Gyro* source = gyros_.find(message.gyro_id())) source->pipeline().receive(mark_of(message));
}

void CompensationNode::on_checkpoint(const msg::CheckpointPart& part) {
  if (part.instance() == options_.instance) return;
  const std::lock_guard lock(data_mutex_);
  Gyro* const source = gyros_.find(part.gyro_id());
  if (source == nullptr) return;
  if (part.parts() == 0) {
    if (part.asked() == options_.instance && is_in_sync(*source))
      ask_request_thread([this, source] { give_state(*source); });
    return;
  }
  if (!source->pipeline().is_logging()) return;
  auto state = source->arriving.take(part);
  if (!state) return;
  ask_request_thread([this, source, state = *std::move(state)] {
    try {
      catch_up(*source, state);
    } catch (const std::exception& error) {
      source->events.raise("cannot_catch_up", Severity::kError,
                           std::string("another instance's state can't be used: ") + error.what());
    }
  });
}

// Of the tick; data_mutex_ is held.
void CompensationNode::ask_for_state(Gyro& source, std::int64_t now_ns) {
  const auto giver = source.pipeline().state_to_ask_for(now_ns);
  if (!giver) return;
  msg::CheckpointPart question;
  question.gyro_id(source.id);
  question.instance(options_.instance);
  question.asked(*giver);
  checkpoint_writer_->write(question);
}

// ---------------------------------------- the giver, on its request thread

void CompensationNode::give_state(Gyro& source) {
  std::optional<RunningState> state;
  try {
    state = running_state(source);
  } catch (const std::exception&) {
    return;  // a learner that hangs is reported; the other asks again
  }
  if (!state) return;
  source.wait_until_received(kReceivedWithin);
  const std::string_view bytes = state->bytes;
  const auto parts = static_cast<std::uint32_t>((bytes.size() + kLargestPart - 1) / kLargestPart);
  msg::CheckpointPart message;
  message.gyro_id(source.id);
  message.instance(options_.instance);
  message.asked(options_.instance);
  message.run_id(state->run);
  message.sequence_number(state->sequence);
  message.parts(parts);
  for (std::uint32_t part = 0; part < parts && !requests_closed_; ++part) {
    const std::string_view its = bytes.substr(part * kLargestPart, kLargestPart);
    message.part(part);
    message.bytes().assign(its.begin(), its.end());
    checkpoint_writer_->write(message);
    if (part % kPartsAtOnce == kPartsAtOnce - 1)
      checkpoint_writer_->wait_until_received(kReceivedWithin);
  }
}

// Data path and learner at the same point: between two samples at which no model is due, and
// before the learner goes on. Nothing where that doesn't come.
std::optional<RunningState> CompensationNode::running_state(Gyro& source) {
  std::string path;
  path.reserve(kRoomForPath);
  const auto give_up = std::chrono::steady_clock::now() + kQuiescentWithin;
  while (!requests_closed_ && std::chrono::steady_clock::now() < give_up) {
    std::uint64_t job = 0;
    RunningState state;
    path.clear();
    {
      const std::lock_guard lock(data_mutex_);
      if (!is_in_sync(source)) return std::nullopt;
      if (source.compensator().is_quiescent()) {
        core::StateArchive archive(path);
        source.compensator().carry(archive);
        job = source.compensator().newest_job();
        state.run = source.pipeline().run();
        state.sequence = source.pipeline().newest_sequence();
      }
    }
    if (!path.empty()) {
      const Learned now = learned(source);
      if (now.job == job) {
        state.bytes = checkpoint::encode_running({source.id, source.options}, *now.state, path,
                                                 prior_text(source));
        return state;
      }
    }
    std::this_thread::sleep_for(5ms);
  }
  return std::nullopt;
}

// ---------------------------------------- the taker, on its request thread

void CompensationNode::catch_up(Gyro& source, const RunningState& state) {
  // The prior that the other has adopted, or gone back to, goes with its state.
  compensation::CompensationOptions options = source.options;
  const std::string prior = checkpoint::prior_of_running(state.bytes);
  if (prior.empty()) {
    options.prior.reset();
  } else if (prior != prior_text(source)) {
    options.prior = config::prior_from_text(prior, "another instance's prior");
  }
  auto fresh = checkpoint::decode_running(state.bytes, {source.id, options});
  std::vector<core::CompensatedSample> answers;
  std::vector<Gyro::Pipeline::Input> log;
  std::size_t repeated = 0;
  const auto is_wanted = [&] {
    return !source.pipeline().sync().may_write() &&
           source.pipeline().continues(state.run, state.sequence);
  };
  // The most of the log before the samples have to wait for the rest of it.
  while (!requests_closed_) {
    {
      const std::lock_guard lock(data_mutex_);
      if (!is_wanted()) return;  // it is asked for again
      const auto& logged = source.pipeline().logged();
      log.assign(logged.begin() + static_cast<std::ptrdiff_t>(repeated), logged.end());
    }
    if (log.size() < kShortLog) break;
    for (const auto& input : log) Gyro::Pipeline::repeat(*fresh, input, state.sequence, answers);
    repeated += log.size();
  }
  {
    const std::lock_guard lock(data_mutex_);
    if (!is_wanted()) return;
    const auto& logged = source.pipeline().logged();
    for (; repeated < logged.size(); ++repeated)
      Gyro::Pipeline::repeat(*fresh, logged[repeated], state.sequence, answers);
    source.end_what_left(*fresh);
    learner_.replace(source.compensator(), fresh);
    source.pipeline().go_on_with(fresh, state.sequence, answers, service::monotonic_ns());
    source.events.go_on_from(source.compensator());
    source.options.prior = options.prior;
    source.change.reset();
    source.can_revert = false;
  }
  source.events.raise("caught_up", Severity::kInformation,
                      "instance " + std::to_string(options_.instance) +
                          " has another's state as of sample " + std::to_string(state.sequence) +
                          " and is in sync");
}

}  // namespace zerodrift::services
