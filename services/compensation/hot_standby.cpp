// SPDX-License-Identifier: Apache-2.0
// One of several instances: who answers, and how one that was away catches up. A standby asks for
// the active instance's state on the checkpoint topic, keeps a log of its inputs meanwhile, and
// goes on from the state through the log: to the bit, since equal inputs give equal samples.
#include <algorithm>
#include <exception>
#include <utility>

#include "common/checkpoint/checkpoint_bytes.h"
#include "common/dds/conversions.h"
#include "common/service/monotonic_clock.h"
#include "services/compensation/compensation_node.h"
#include "services/compensation/instances.h"

namespace zerodrift::services {

using service::HotStandby;
using service::Severity;

namespace {

using namespace std::chrono_literals;

constexpr auto kTakeoverCheck = 1ms;
constexpr auto kIdleCheck = 20ms;
constexpr std::int64_t kAskEveryNs = 3'000'000'000;
constexpr auto kSettlesWithin = 20s;  // a model is due for a fraction of the time
constexpr std::size_t kRoomForPath = 1U << 20U;
constexpr std::size_t kLargestPart = 32768;
constexpr std::uint32_t kMostParts = 4096;
constexpr std::uint32_t kPartsAtOnce = 16;  // a quarter of the topic's history
constexpr std::size_t kLongestLog = 1U << 18U;
constexpr std::size_t kUsualLog = 1U << 14U;  // 8 s at 2 kHz
// The learner hangs where a model is this late.
constexpr core::SensorTime kHangs{2'000'000'000};

}  // namespace

std::unique_ptr<dds::Writer<msg::CompensatedRate>> CompensationNode::make_writer(
    std::uint32_t strength) {
  dds::Partitions partitions;
  if (is_one_of_several()) partitions = {"", partition_of(options_.instance)};
  return std::make_unique<dds::Writer<msg::CompensatedRate>>(host_.participant(), host_.observer(),
                                                             strength, partitions);
}

// A standby that heard one as strong as itself gets a stronger writer.
void CompensationNode::renew_writer(Gyro& source) {
  std::uint32_t wanted = 0;
  {
    const std::lock_guard lock(data_mutex_);
    wanted = source.standby.wanted_strength();
  }
  auto writer = make_writer(wanted);
  const std::lock_guard lock(data_mutex_);
  source.writer.swap(writer);
  source.standby.set_strength(wanted);
}

std::vector<CompensationNode::Gyro*> CompensationNode::active_gyros() const {
  std::vector<Gyro*> active;
  for (const auto& source : gyros_) {
    if (source->standby.role() == HotStandby::Role::kActive) active.push_back(source.get());
  }
  return active;
}

void CompensationNode::on_peer(const msg::CompensatedRate& message) {
  const std::int64_t now = service::monotonic_ns();
  const std::lock_guard lock(data_mutex_);
  if (Gyro* source = known(message.gyro_id())) source->standby.hear(message, now);
}

void CompensationNode::take_over_until_stopped() {
  std::int64_t checked_ns = service::monotonic_ns();
  while (!stopping_takeovers_) {
    bool watching = false;
    {
      const std::lock_guard lock(data_mutex_);
      const std::int64_t now = service::monotonic_ns();
      const bool stood_still = now - checked_ns > HotStandby::kSilence.count();
      checked_ns = now;
      for (auto& source : gyros_) {
        if (stood_still) source->standby.woke(now);
        watching = watching || source->standby.role() == HotStandby::Role::kStandby;
        if (source->writer == nullptr || !source->standby.must_take_over(now)) continue;
        source->catch_up = {};
        source->standby.take_over(now, [&](msg::CompensatedRate& held) { write(*source, held); });
      }
    }
    std::this_thread::sleep_for(watching ? kTakeoverCheck : kIdleCheck);
  }
}

// Of the tick; data_mutex_ is held.
void CompensationNode::look_after_standby(Gyro& source) {
  const std::int64_t now = service::monotonic_ns();
  const bool hangs = source.compensator->model_late_by() > kHangs;
  source.standby.set_unwell(hangs, now);
  if (hangs && !source.told_hanging) {
    host_.raise({.code = "learner_hangs",
                 .severity = Severity::kError,
                 .text = "gyro " + std::to_string(source.id) +
                         ": a model is late by more than 2 s; samples go out with the one before",
                 .gyro_id = source.id,
                 .sensor_time_ns = source.newest.raw.time.count()});
  }
  source.told_hanging = hangs;
  tell_of_standby(source);
  CatchUp& catch_up = source.catch_up;
  if (catch_up.log.size() > kLongestLog) catch_up = {};
  if (!source.standby.needs_state() || now - catch_up.asked_ns < kAskEveryNs) return;
  if (!catch_up.logging) {  // asked for with the next tick: the log begins before the state does
    catch_up.log.reserve(kUsualLog);
    catch_up.logging = true;
    return;
  }
  catch_up.asked_ns = now;  // an answer to the question before is as good: the log goes on
  msg::CheckpointPart question;
  question.gyro_id(source.id);
  question.instance(options_.instance);
  checkpoint_writer_->write(question);
}

void CompensationNode::tell_of_standby(Gyro& source) {
  if (source.standby.is_alone()) return;
  const auto now = source.standby.counts();
  const auto tell = [&](const char* code, std::string text, std::uint64_t before,
                        std::uint64_t after) {
    if (after <= before) return;
    host_.raise_counted({.code = code,
                         .severity = Severity::kWarning,
                         .text = "gyro " + std::to_string(source.id) + ": instance " +
                                 std::to_string(options_.instance) + " " + std::move(text),
                         .gyro_id = source.id,
                         .sensor_time_ns = source.newest.raw.time.count()},
                        after - before);
  };
  tell("took_over", "heard no other instance in time; it is the active one now",
       source.told_standby.takeovers, now.takeovers);
  tell("stepped_back", "is a standby now: a stronger instance writes, or its own learner hangs",
       source.told_standby.step_backs, now.step_backs);
  tell("standby_differs", "answers otherwise than the active one", source.told_standby.differing,
       now.differing);
  tell("unheard_samples", "dropped answers that nobody wrote", source.told_standby.unheard,
       now.unheard);
  source.told_standby = now;
}

// ---------------------------------------- the checkpoint topic

void CompensationNode::on_checkpoint(const msg::CheckpointPart& part) {
  if (part.instance() == options_.instance) return;
  const std::lock_guard lock(data_mutex_);
  Gyro* const found = known(part.gyro_id());
  if (found == nullptr) return;
  Gyro& source = *found;
  if (part.parts() == 0) {
    if (source.standby.role() == HotStandby::Role::kActive)
      ask_request_thread([this, &source] { give_state(source); });
    return;
  }
  CatchUp& catch_up = source.catch_up;
  if (!catch_up.logging || part.parts() > kMostParts) return;
  if (part.part() == 0) {
    catch_up.instance = part.instance();
    catch_up.sequence = part.sequence_number();
    catch_up.parts = 0;
    catch_up.bytes.clear();
  }
  const bool follows = part.instance() == catch_up.instance &&
                       part.sequence_number() == catch_up.sequence && part.part() == catch_up.parts;
  if (!follows) return;
  catch_up.bytes.append(reinterpret_cast<const char*>(part.bytes().data()), part.bytes().size());
  if (++catch_up.parts < part.parts()) return;
  ask_request_thread(
      [this, &source, state = std::exchange(catch_up.bytes, {}), sequence = catch_up.sequence] {
        try {
          this->catch_up(source, state, sequence);
        } catch (const std::exception& error) {
          host_.raise({.code = "cannot_catch_up",
                       .severity = Severity::kError,
                       .text = "gyro " + std::to_string(source.id) +
                               ": the active instance's state can't be used: " + error.what(),
                       .gyro_id = source.id,
                       .sensor_time_ns = 0});
        }
      });
}

// ---------------------------------------- the active one, on its request thread

void CompensationNode::give_state(Gyro& source) {
  std::uint64_t sequence = 0;
  std::optional<std::string> state;
  try {
    state = running_state(source, sequence);
  } catch (const std::exception&) {
    return;  // a learner that hangs is told of; the standby asks again
  }
  if (!state) return;
  const auto parts = static_cast<std::uint32_t>((state->size() + kLargestPart - 1) / kLargestPart);
  msg::CheckpointPart message;
  message.gyro_id(source.id);
  message.instance(options_.instance);
  message.sequence_number(sequence);
  message.parts(parts);
  for (std::uint32_t part = 0; part < parts && !requests_closed_; ++part) {
    const std::string_view bytes =
        std::string_view(*state).substr(part * kLargestPart, kLargestPart);
    message.part(part);
    message.bytes().assign(bytes.begin(), bytes.end());
    checkpoint_writer_->write(message);
    if (part % kPartsAtOnce == kPartsAtOnce - 1) checkpoint_writer_->wait_until_received(1s);
  }
}

// Data path and learner at the same point: between two samples at which no model is due, and
// before the learner goes on. Nothing where that doesn't come.
std::optional<std::string> CompensationNode::running_state(Gyro& source, std::uint64_t& sequence) {
  std::string path;
  path.reserve(kRoomForPath);
  const auto give_up = std::chrono::steady_clock::now() + kSettlesWithin;
  while (!requests_closed_ && std::chrono::steady_clock::now() < give_up) {
    std::uint64_t job = 0;
    path.clear();
    {
      const std::lock_guard lock(data_mutex_);
      if (source.standby.role() != HotStandby::Role::kActive) return std::nullopt;
      if (source.compensator->is_settled()) {
        core::StateArchive archive(path);
        source.compensator->carry(archive);
        job = source.compensator->newest_job();
        sequence = source.newest_sequence;
      }
    }
    if (!path.empty()) {
      const Learned now = learned(source);
      if (now.job == job)
        return checkpoint::encode_running({source.id, source.options}, *now.state, path);
    }
    std::this_thread::sleep_for(5ms);
  }
  return std::nullopt;
}

// ---------------------------------------- the standby, on its request thread

namespace {

// Gives a compensator what was logged, and answers what there is as live: a model that is due is
// there in time.
template <typename Input>
void repeat(compensation::Compensator& compensator, const Input& input, std::uint64_t after,
            std::vector<compensation::CompensatedSample>& answers) {
  if (const auto* rate = std::get_if<core::AngularRateSample>(&input)) {
    if (rate->sequence > after) compensator.push(*rate);
  } else if (const auto* temperature = std::get_if<core::TemperatureSample>(&input)) {
    if (!compensator.has_heard(*temperature)) compensator.push(*temperature);
  } else if (const auto* reference = std::get_if<core::RateReferenceSample>(&input)) {
    if (!compensator.has_heard(*reference)) compensator.push(*reference);
  }
  using compensation::Readiness;
  for (;;) {
    while (compensator.learner().run_one()) {
    }
    const Readiness readiness = compensator.readiness();
    if (readiness == Readiness::kNothing) return;
    if (readiness != Readiness::kReady &&
        core::is_paced_by_consumers(compensator.waiting_clock())) {
      return;
    }
    answers.push_back(compensator.answer_next());
  }
}

}  // namespace

// The log holds all that the state does not, of the same run of the publisher.
bool CompensationNode::continues(Gyro& source, std::uint64_t sequence) {
  const std::lock_guard lock(data_mutex_);
  std::optional<std::uint64_t> first;
  std::uint64_t last = 0;
  for (const Input& input : source.catch_up.log) {
    const auto* rate = std::get_if<core::AngularRateSample>(&input);
    if (rate == nullptr) continue;
    if (!first) first = rate->sequence;
    last = std::max(last, rate->sequence);
  }
  return first && *first <= sequence && sequence <= last;
}

void CompensationNode::catch_up(Gyro& source, const std::string& state, std::uint64_t sequence) {
  auto fresh = checkpoint::decode_running(state, {source.id, source.options});
  std::vector<compensation::CompensatedSample> answers;
  std::vector<Input> log;
  std::size_t repeated = 0;
  if (!continues(source, sequence)) return;  // it is asked for again
  // The most of the log before the samples have to wait for the rest of it.
  while (!requests_closed_) {
    {
      const std::lock_guard lock(data_mutex_);
      if (!source.catch_up.logging) return;  // it took over meanwhile
      log.assign(source.catch_up.log.begin() + static_cast<std::ptrdiff_t>(repeated),
                 source.catch_up.log.end());
    }
    if (log.size() < 16) break;
    for (const Input& input : log) repeat(*fresh, input, sequence, answers);
    repeated += log.size();
  }
  {
    const std::lock_guard lock(data_mutex_);
    if (!source.catch_up.logging) return;
    for (; repeated < source.catch_up.log.size(); ++repeated)
      repeat(*fresh, source.catch_up.log[repeated], sequence, answers);
    relieve(*source.compensator, fresh);
    const std::int64_t now = service::monotonic_ns();
    source.compensator.swap(fresh);
    end_what_left(source);
    source.standby.caught_up(now);
    source.told = source.compensator->counts();
    source.change.reset();
    source.can_revert = false;
    source.catch_up = {.asked_ns = now};
    for (const auto& answer : answers) {
      dds::to_message(answer, source.id, options_.instance, message_);
      message_.run_id(dds::run_of(source.publisher));
      static_cast<void>(source.standby.take(message_, now));
      source.newest = answer;
    }
  }
  host_.raise({.code = "caught_up",
               .severity = Severity::kInformation,
               .text = "gyro " + std::to_string(source.id) + ": instance " +
                       std::to_string(options_.instance) +
                       " has the active one's state as of sample " + std::to_string(sequence) +
                       " and follows it",
               .gyro_id = source.id,
               .sensor_time_ns = 0});
}

// The learner's thread goes on with `after` instead. The data path of neither waits for a model
// meanwhile: data_mutex_ is held.
void CompensationNode::relieve(compensation::Compensator& before,
                               std::unique_ptr<compensation::Compensator>& after) {
  const auto exchange = [this](compensation::Compensator* out, compensation::Compensator* in) {
    return [this, out, in] { std::replace(roster_.begin(), roster_.end(), out, in); };
  };
  try {
    ask_learner(exchange(&before, after.get()));
  } catch (const std::exception&) {
    // It may still do so, and then goes back; until then it needs both.
    questions_.push(exchange(after.get(), &before));
    abandoned_.push_back(std::move(after));
    throw;
  }
}

}  // namespace zerodrift::services
