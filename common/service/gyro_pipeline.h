// SPDX-License-Identifier: Apache-2.0
// The way of one gyro's samples through one instance: whom it follows, what waits for what, what
// is answered, and whether the answer is written (instance_sync.h). One that is behind keeps a log
// of its inputs from before it asks for a state, and goes on from the state through the log: to the
// bit, since equal inputs give equal answers.
//
// `Engine` answers samples: compensation::Compensator, or another of its form. Time is an argument,
// nanoseconds of the host's monotonic clock. One thread at a time. The data path allocates nothing,
// but for the log.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/core/ring_buffer.h"
#include "common/core/samples.h"
#include "common/service/followed_writer.h"
#include "common/service/instance_sync.h"

namespace zerodrift::service {

template <typename Engine>
class GyroPipeline {
 public:
  using Answer = decltype(std::declval<Engine&>().answer_next());
  struct Rate {
    core::AngularRateSample sample{};
    std::int64_t publish_time_ns = 0;
    std::int64_t ingress_time_ns = 0;
  };
  using Input = std::variant<Rate, core::TemperatureSample, core::RateReferenceSample>;

  // The world around it.
  class Port {
   public:
    // Makes an answer of a run ready to be written, of a line that is `answered` long; what other
    // instances compare of it.
    virtual AnswerMark prepare(const Answer& answer, std::uint64_t run,
                               std::uint32_t answered) noexcept = 0;
    // Writes what was prepared last, and where `leads`, what only one instance writes.
    virtual void write_prepared(bool leads) noexcept = 0;
    // Writes what was prepared last where only one instance writes.
    virtual void write_prepared_alone() noexcept = 0;
    [[nodiscard]] virtual bool has_output_of_one() const noexcept = 0;
    // Whether answers can be written at all, and to all who are waited for.
    [[nodiscard]] virtual bool can_write() const noexcept = 0;
    virtual bool is_open() = 0;
    // Another publisher is followed from now on.
    virtual void begin_run() = 0;
    // drain() is to be called when the learner has delivered; true: it has already.
    virtual bool await_model() = 0;
    virtual void report_progress(std::uint64_t newest, core::SensorTime needed) = 0;
    // The learner may have something to do: there is a label more, or room for a model more.
    virtual void notify_learner() = 0;

   protected:
    Port() = default;
    ~Port() = default;
    Port(const Port&) = default;
    Port& operator=(const Port&) = default;
  };

  GyroPipeline(std::unique_ptr<Engine> engine, const InstanceSync& sync, Port& port)
      : engine_(std::move(engine)), sync_(sync), port_(port), held_(sync.is_alone() ? 1 : kHeld) {
    if (port.has_output_of_one() && !sync.is_alone()) unled_.emplace(kUnled);
  }

  // ---- inputs. `run` is the publisher's.
  // One publisher a gyro, so that two streams are never mixed: the first is followed until it is
  // gone or silent, or until the instances that are in sync follow another. What another one sends
  // waits meanwhile: it is refused when the one that is followed goes on, and when that one is over
  // it is answered from its first sample on, so that all instances begin a run alike.
  void push(const core::AngularRateSample& sample, std::uint64_t run, std::int64_t publish_time_ns,
            std::int64_t now_ns) {
    const Rate rate{sample, publish_time_ns, now_ns};
    if (run_ == 0) run_ = run;
    if (run == run_) {
      rejected_ += waiting_.size();
      waiting_.clear();
      return take(rate, now_ns);
    }
    if (waiting_.full()) ++rejected_;
    waiting_.push_overwriting({rate, run, false});
    follow_who_waits(now_ns);
  }
  void push(const core::TemperatureSample& sample, std::int64_t now_ns) {
    log(sample);
    engine_->push(sample);
    drain(now_ns);
  }
  void push(const core::RateReferenceSample& sample, std::int64_t now_ns) {
    log(sample);
    engine_->push(sample);
    drain(now_ns);
  }
  // The publisher is gone for good: another one is followed at once.
  void publisher_gone(std::uint64_t run, std::int64_t now_ns) {
    publisher_gone_ |= run_ == run;
    for (std::size_t i = 0; i < waiting_.size(); ++i) waiting_[i].is_gone |= waiting_[i].run == run;
    follow_who_waits(now_ns);
  }
  void receive(const AnswerMark& other) noexcept { sync_.receive(other); }
  // The leader was given a command that changes its model.
  void expect_change() noexcept { sync_.expect_change(); }

  // Answers what can be answered. Real sensors are answered at once, with what is there. A record
  // or simulation waits for its consumers, so its samples wait here for what belongs to them, and
  // until it is known who writes: the result does not depend on who came first.
  void drain(std::int64_t now_ns) {
    if (!port_.is_open()) return;
    using compensation::Readiness;
    for (;;) {
      const Readiness readiness = engine_->readiness();
      if (readiness == Readiness::kNothing) return;
      const bool is_paced = core::is_paced_by_consumers(engine_->waiting_clock());
      if (is_paced && awaits_who_writes()) return;
      if (readiness == Readiness::kReady || !is_paced) {
        answer(now_ns);
        continue;
      }
      if (readiness == Readiness::kAwaitsModel) {
        if (!port_.await_model()) return;
        continue;
      }
      if (waiting_since_ns_ == 0) waiting_since_ns_ = now_ns;
      if (reported_needed_ != engine_->needed_time()) report_progress();
      return;
    }
  }
  // Since when a record or simulation waits for another stream; 0 where it doesn't.
  [[nodiscard]] std::int64_t waiting_since_ns() const noexcept { return waiting_since_ns_; }
  void report_progress() {
    answered_since_report_ = 0;
    reported_needed_ = engine_->needed_time();
    port_.report_progress(reached_.taken, reported_needed_);
  }

  // ---- catching up
  // Whom to ask for its state now. The log begins one call before, and so before the state.
  [[nodiscard]] std::optional<std::uint32_t> state_to_ask_for(std::int64_t now_ns) {
    if (log_.size() > kLongestLog) drop_log();
    const auto giver = sync_.giver();
    if (!giver || (asked_ns_ && is_within(kAskEveryNs, *asked_ns_, now_ns))) return std::nullopt;
    if (!logging_) {
      log_.reserve(kUsualLog);
      logging_ = true;
      return std::nullopt;
    }
    asked_ns_ = now_ns;  // an answer to the question before is as good: the log goes on
    return giver;
  }
  // The log holds all that a state as of `sequence` does not, of the same run.
  [[nodiscard]] bool continues(std::uint64_t run, std::uint64_t sequence) const noexcept {
    if (!logging_ || run_ != run) return false;
    std::optional<std::uint64_t> first;
    std::uint64_t last = 0;
    for (const Input& input : log_) {
      const auto* rate = std::get_if<Rate>(&input);
      if (rate == nullptr) continue;
      if (!first) first = rate->sample.sequence;
      last = std::max(last, rate->sample.sequence);
    }
    return first && *first <= sequence + 1 && sequence <= last;
  }
  [[nodiscard]] bool is_logging() const noexcept { return logging_; }
  [[nodiscard]] const std::vector<Input>& logged() const noexcept { return log_; }
  // What was logged, given to an engine that has a state as of `after`; its answers go behind
  // `answers`. A model that is due is there in time, as live.
  static void repeat(Engine& engine, const Input& input, std::uint64_t after,
                     std::vector<Answer>& answers) {
    if (const auto* rate = std::get_if<Rate>(&input)) {
      if (rate->sample.sequence > after)
        engine.push(rate->sample, rate->publish_time_ns, rate->ingress_time_ns);
    } else if (const auto* temperature = std::get_if<core::TemperatureSample>(&input)) {
      if (!engine.has_received(*temperature)) engine.push(*temperature);
    } else if (const auto* reference = std::get_if<core::RateReferenceSample>(&input)) {
      if (!engine.has_received(*reference)) engine.push(*reference);
    }
    using compensation::Readiness;
    for (;;) {
      while (engine.learner().run_one()) {
      }
      const Readiness readiness = engine.readiness();
      if (readiness == Readiness::kNothing) return;
      if (readiness != Readiness::kReady && core::is_paced_by_consumers(engine.waiting_clock()))
        return;
      answers.push_back(engine.answer_next());
    }
  }
  // `fresh`, of a state as of `after`, has been given the whole log, and goes on instead of the
  // engine, which it becomes. `answers` are those to the log: all are written, so that they reach
  // back behind what any reader may be waiting for. What this engine alone has answered of the run
  // is written before, since the other line may have begun after it. So is what it has answered of
  // a run before of which it has written some; any other run's publisher may be one that nobody
  // follows.
  void go_on_with(std::unique_ptr<Engine>& fresh, std::uint64_t after,
                  const std::vector<Answer>& answers, std::int64_t now_ns) {
    write_held_unless([&](const Kept& kept) {
      const std::uint64_t sequence = kept.answer.raw.sequence;
      const bool is_answered_anew = !answers.empty() && sequence >= answers.front().raw.sequence;
      if (kept.run != run_) return kept.run != written_run_;
      return is_answered_anew || sync_.was_received(kept.run, sequence);
    });
    engine_.swap(fresh);
    reached_.note(after, false);
    drop_log();
    asked_ns_ = now_ns;
    sync_.caught_up();
    for (const Answer& repeated : answers) pass_on(repeated, now_ns);
  }
  void drop_log() noexcept {
    logging_ = false;
    log_.clear();
    log_.shrink_to_fit();
    asked_ns_.reset();
  }

  void set_hangs(bool hangs) noexcept { sync_.set_hangs(hangs); }
  // From time to time.
  void tick(std::int64_t now_ns) {
    follow_who_waits(now_ns);
    const bool led = sync_.leads();
    sync_.tick(now_ns);
    if (sync_.may_write() && (!held_.empty() || (sync_.leads() && !led)) && port_.is_open())
      write_held();
  }

  [[nodiscard]] Engine& engine() noexcept { return *engine_; }
  [[nodiscard]] const Engine& engine() const noexcept { return *engine_; }
  [[nodiscard]] const InstanceSync& sync() const noexcept { return sync_; }
  [[nodiscard]] const Answer& newest() const noexcept { return newest_; }
  // A number that is doubted, far ahead of the others, is none of these: others would take a state
  // as of it for one that they can't go on from.
  [[nodiscard]] std::uint64_t newest_sequence() const noexcept { return reached_.sequence; }
  [[nodiscard]] std::uint64_t run() const noexcept { return run_; }
  [[nodiscard]] bool follows(std::uint64_t run) const noexcept { return run_ == 0 || run_ == run; }
  [[nodiscard]] std::uint64_t rejected() const noexcept { return rejected_; }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  static constexpr std::uint64_t kReportEvery = 32;  // samples between two progress reports
  static constexpr std::int64_t kAskEveryNs = 3'000'000'000;
  static constexpr std::size_t kLongestLog = 1U << 18U;
  static constexpr std::size_t kUsualLog = 1U << 14U;  // 8 s at 2 kHz
  static constexpr std::size_t kHeld = 4096;           // 2 s at 2 kHz
  // As far as it is ahead of its consumers; few, since all are written at once in the end, and a
  // writer keeps 2000.
  static constexpr std::size_t kHeldOfReplay = 256;
  static constexpr std::size_t kUnled = 512;
  static constexpr std::size_t kWaiting = 2048;  // kSilentPublisherNs at 2 kHz
  // Received from one that died, but perhaps not by everybody: written again.
  static constexpr std::uint64_t kOverlap = 64;

  static constexpr bool is_within(std::int64_t span_ns, std::int64_t since_ns,
                                  std::int64_t now_ns) noexcept {
    return now_ns >= since_ns && now_ns - since_ns < span_ns;
  }

  // The newest numbers answered in a run.
  struct Reached {
    std::uint64_t sequence = 0;  // that is not doubted
    std::uint64_t taken = 0;     // of any: a replay waits for all that it sent

    void note(std::uint64_t answered, bool is_late) noexcept {
      taken = std::max(taken, answered);
      const bool is_doubted = is_late && answered > sequence + 1;
      if (!is_doubted) sequence = std::max(sequence, answered);
    }
  };
  struct Waiting {
    Rate rate{};
    std::uint64_t run = 0;
    bool is_gone = false;  // its publisher is
  };
  void take(const Rate& rate, std::int64_t now_ns) {
    received_ns_ = rate.ingress_time_ns;
    log(rate);
    const auto push = [&] {
      return engine_->push(rate.sample, rate.publish_time_ns, rate.ingress_time_ns);
    };
    if (push() == compensation::Admission::kQueueFull && port_.can_write()) {
      answer(now_ns);  // never lose a raw sample: the oldest goes out with what is there
      push();
    }
    drain(now_ns);
  }

  // Of whom all that waits is taken now: whom those in sync follow, or where the one that is
  // followed is over, the first.
  [[nodiscard]] std::optional<std::uint64_t> next_run(std::int64_t now_ns) const {
    if (waiting_.empty()) return std::nullopt;
    if (const auto wanted = sync_.wanted_run()) {
      for (std::size_t i = 0; i < waiting_.size(); ++i) {
        if (waiting_[i].run == *wanted) return wanted;
      }
    }
    if (publisher_gone_ || !is_within(kSilentPublisherNs, received_ns_, now_ns))
      return waiting_.front().run;
    return std::nullopt;
  }
  void follow_who_waits(std::int64_t now_ns) {
    while (const auto run = next_run(now_ns)) {
      begin_run(now_ns);
      run_ = *run;
      publisher_gone_ = false;
      std::size_t left = waiting_.size();
      while (waiting_[left - 1].run != run_) --left;  // what came after its newest waits on
      for (; left > 0; --left) {
        const Waiting first = waiting_.front();
        waiting_.pop();
        if (first.run == run_) {
          publisher_gone_ |= first.is_gone;
          take(first.rate, now_ns);
        } else {
          ++rejected_;
        }
      }
    }
  }
  void begin_run(std::int64_t now_ns) {
    while (port_.can_write() && engine_->readiness() != compensation::Readiness::kNothing)
      answer(now_ns);
    engine_->restart_stream();
    reached_ = {};
    drop_log();
    port_.begin_run();
  }

  template <typename Arrived>
  void log(const Arrived& arrived) {
    if (logging_) log_.emplace_back(arrived);
  }

  void answer(std::int64_t now_ns) {
    const std::uint64_t labels = engine_->counts().labels;
    const std::uint64_t epoch = newest_.model_epoch;
    waiting_since_ns_ = 0;
    pass_on(engine_->answer_next(), now_ns);
    // A model that comes into force gives its predecessor's place to one that had none.
    if (engine_->counts().labels != labels || newest_.model_epoch != epoch) port_.notify_learner();
    if (core::is_paced_by_consumers(newest_.raw.clock) && ++answered_since_report_ >= kReportEvery)
      report_progress();
  }

  // To readers, or to those that are held back.
  void pass_on(const Answer& answer, std::int64_t now_ns) {
    newest_ = answer;
    reached_.note(answer.raw.sequence, answer.late);
    const bool led = sync_.leads();
    if (!sync_.note(prepare({answer, run_}), now_ns)) return hold({answer, run_});
    written_run_ = run_;
    const bool leads = sync_.leads();
    if (!held_.empty() || (leads && !led)) {
      write_held();
      prepare({answer, run_});
    }
    port_.write_prepared(leads);
    if (unled_ && !leads) unled_->push_overwriting({answer, run_});
  }
  struct Kept {
    Answer answer{};
    std::uint64_t run = 0;
  };
  AnswerMark prepare(const Kept& kept) noexcept {
    return port_.prepare(kept.answer, kept.run,
                         sync_.stated_answered(engine_->counts().samples_out));
  }
  // It holds back what nobody may have written: nobody in sync is received.
  [[nodiscard]] bool awaits_who_writes() const noexcept {
    return held_.size() >= kHeldOfReplay && !sync_.may_write() && !sync_.giver();
  }
  void hold(const Kept& kept) noexcept {
    if (held_.full() && !sync_.was_received(held_.front().run, held_.front().answer.raw.sequence))
      ++dropped_;
    held_.push_overwriting(kept);
  }
  template <typename Predicate>
  void write_held_unless(const Predicate& is_needless) {
    for (; !held_.empty(); held_.pop()) {
      const Kept& kept = held_.front();
      if (is_needless(kept)) continue;
      prepare(kept);
      port_.write_prepared(sync_.leads());
    }
  }
  // What was received from nobody, and a little more.
  void write_held() {
    write_held_unless([this](const Kept& kept) {
      const std::uint64_t sequence = kept.answer.raw.sequence;
      return sync_.was_received(kept.run, sequence) &&
             sync_.was_received(kept.run, sequence + kOverlap);
    });
    if (!unled_ || !sync_.leads()) return;
    for (; !unled_->empty(); unled_->pop()) {
      const Kept& kept = unled_->front();
      if (sync_.was_received(kept.run, kept.answer.raw.sequence)) continue;
      prepare(kept);
      port_.write_prepared_alone();
    }
  }

  std::unique_ptr<Engine> engine_;
  InstanceSync sync_;
  Port& port_;
  core::RingBuffer<Kept> held_;                    // not written: it is behind
  std::optional<core::RingBuffer<Kept>> unled_{};  // written, but not where one writes
  bool logging_ = false;
  std::vector<Input> log_{};  // in order of arrival
  std::optional<std::int64_t> asked_ns_{};
  core::RingBuffer<Waiting> waiting_{kWaiting};  // since the newest of the run that is followed
  std::uint64_t run_ = 0;                        // whose samples are taken; 0: nobody's yet
  std::uint64_t written_run_ = 0;                // of which it wrote an answer last
  bool publisher_gone_ = false;
  std::int64_t received_ns_ = 0;
  std::uint64_t rejected_ = 0;  // samples of a second publisher of the same id
  std::uint64_t dropped_ = 0;   // held back, and too many
  std::int64_t waiting_since_ns_ = 0;
  std::uint64_t answered_since_report_ = 0;
  core::SensorTime reported_needed_{core::kNever};
  Reached reached_{};
  Answer newest_{};
};

}  // namespace zerodrift::service
