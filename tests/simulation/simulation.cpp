// SPDX-License-Identifier: Apache-2.0
// Instances that stand by for each other, in one process on simulated time. A seed decides
// everything: how many instances and readers, delays, losses, partitions, standstills, crashes,
// restarts, second publishers and clocks. Of sixteen seeds one has a replay for a publisher, which
// begins as fast as its consumers follow: readers aren't cut off from it, since a link keeps more
// than a writer does, and no second publisher is there, whom nobody would wait for.
//
//   standby_simulation [--seeds COUNT] [--first SEED]     the seeds from SEED on
//   standby_simulation --seed SEED                        one, and what happens in it
//
// Links are as the middleware's reliable ones: each delivers in order, a loss delays what comes
// after it until it is repaired, a partition until it heals, a crash loses what was not delivered.
// What is held, of a seed:
// - Each sample that an instance could have written reaches every reader once; in order unless the
//   reader was cut off from somebody, or a crash took samples of the publisher's. Not owed, and
//   counted, is an answer that nobody else has: its only writer died while the reader was cut off
//   from it, or all that were given its sample died while their answers were on their way.
// - Where no input differs, answers never do: not after a state was taken over either.
// - In the end all instances are in sync, answer the same bits, and exactly one of them leads.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "common/core/first_come.h"
#include "common/service/gyro_pipeline.h"
#include "tests/simulation/hash_engine.h"

namespace zerodrift::simulation {
namespace {

using service::AnswerMark;
using Pipeline = service::GyroPipeline<HashEngine>;
using Time = std::int64_t;  // ns

constexpr Time kMs = 1'000'000;
constexpr Time kSecond = 1000 * kMs;

struct Random {
  explicit Random(std::uint64_t seed) : state(mixed(seed, 0x5eed)) {}
  std::uint64_t next() { return state = mixed(state, ++count); }
  Time between(Time least, Time most) {
    return least + static_cast<Time>(next() % static_cast<std::uint64_t>(most - least + 1));
  }
  bool happens(int percent) { return static_cast<int>(next() % 100) < percent; }
  std::uint64_t state;
  std::uint64_t count = 0;
};

struct State {
  HashEngine engine;
  std::uint64_t run = 0;
  std::uint64_t sequence = 0;
};
struct Question {
  int asker = 0;
  std::uint32_t giver = 0;
};
struct Rate {
  std::uint64_t run = 0;
  core::AngularRateSample sample{};
};
using Message =
    std::variant<Rate, core::TemperatureSample, AnswerMark, Question, std::shared_ptr<State>>;

class World;

// Somebody that messages are delivered to. One that stands still takes them when it goes on.
class Node {
 public:
  explicit Node(World& world) : world_(world) {}
  virtual ~Node() = default;
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  virtual void take(int from, const Message& message) = 0;
  Time stopped_until = 0;
  std::deque<std::function<void()>> inbox{};  // of one that stands still
  int incarnation = 0;
  bool lives = true;

 protected:
  World& world_;
};

class World {
 public:
  explicit World(std::uint64_t seed, bool traces);
  // What is wrong, or nothing.
  std::optional<std::string> run();

  Random random;
  const bool traces;
  Time now = 0;
  void at(Time when, std::function<void()> action) {
    events_.push_back({when, ++count_, std::move(action)});
    std::push_heap(events_.begin(), events_.end());
  }
  void send(int from, int to, Message message);
  // Whether all that was sent over the link until `when` has arrived.
  [[nodiscard]] Time last_arrival(int from, int to) const;
  // Answers that readers lack and that nobody had when their writer died.
  std::uint64_t lost_with_their_writer = 0;
  void trace(const std::string& what) const {
    if (traces) std::printf("%10.4f  %s\n", static_cast<double>(now) * 1e-9, what.c_str());
  }

 private:
  friend class Instance;
  friend class Reader;
  struct Event {
    Time when;
    std::uint64_t number;
    std::function<void()> action;
    bool operator<(const Event& other) const {
      return when != other.when ? when > other.when : number > other.number;
    }
  };
  struct Link {
    Time last_arrival = 0;
    Time cut_until = 0;
  };
  using Life = std::pair<int, int>;  // of an instance: its number and incarnation
  struct Run {
    std::uint64_t published = 0;
    std::optional<std::uint64_t> owed_to{};  // where its publisher crashed: what all instances got
    std::map<std::uint64_t, std::set<Life>> given_to{};  // by sequence number
    int publisher = 0;
    // No other publisher began or lived until all of it had arrived: who is cut off from the one
    // that it follows takes another after a second, and refuses what comes late of the first.
    bool alone = true;
    Time arrives = 0;  // the last of what was sent
    Time begun = 0;
    // From where on all instances follow it that lived when it began: one that believes in the
    // publisher before passes over its samples until that one has been silent for a second.
    std::uint64_t owed_from = 0;
  };

  void publish(int publisher, std::uint64_t run);
  [[nodiscard]] bool is_awaited(std::uint64_t run) const;
  void begin_run(int publisher);
  void end_run(int publisher, bool crash);
  void disturb();
  void tick(int instance);
  bool is_sound_without(int instance);
  void cut(int a, int b, Time until);
  void stop(int instance, Time until);
  std::optional<std::string> compare_newest();
  std::optional<std::string> judge();

  std::vector<Event> events_{};  // a heap, the earliest first; no queue, whose first is copied out
  std::uint64_t count_ = 0;
  std::map<std::pair<int, int>, Link> links_{};
  std::map<int, std::unique_ptr<Node>> nodes_{};
  std::vector<class Instance*> instances_{};
  std::vector<class Reader*> readers_{};
  std::map<std::uint64_t, Run> runs_{};
  std::map<int, std::uint64_t> running_{};                        // publisher to run
  std::map<std::pair<std::uint64_t, int>, std::uint64_t> got_{};  // run, instance: newest delivered
  struct Progress {
    std::uint64_t taken = 0;
    Time when = 0;
  };
  std::map<std::pair<std::uint64_t, int>, Progress> progress_{};  // likewise: as it reported
  std::uint64_t runs_begun_ = 0;
  std::uint64_t temperatures_ = 0;

  int instance_count_ = 2;
  Time period_ = 20 * kMs;
  Time delay_ = 0;
  Time jitter_ = 0;
  int loss_percent_ = 0;
  bool with_temperatures_ = false;
  bool with_partitions_ = false;
  bool with_second_publisher_ = false;
  bool with_clock_steps_ = false;
  bool is_replay_ = false;
  Time quiet_from_ = 0;
  Time end_ = 0;
  bool crashed_publisher_ = false;
  bool cut_anybody_ = false;

 public:
  // One heard nobody and began without a state: the others were away, and may come late.
  bool began_anew = false;
};

// Of a replay: samples ahead of the slowest consumer, and how long one that is silent is waited
// for; it begins with more samples than an instance holds back, and fast.
constexpr std::uint64_t kAhead = 256;
constexpr Time kLeftBehind = 5 * kSecond;
constexpr std::uint64_t kFastSamples = 10000;
constexpr Time kFastPeriod = kMs / 5;

constexpr int kFirstReader = 100;
constexpr int kFirstPublisher = 200;

class Reader final : public Node {
 public:
  using Node::Node;
  struct Taken {
    std::vector<std::uint64_t> sequences{};
    std::uint64_t newest = 0;
    bool in_order = true;
  };
  void take(int from, const Message& message) override {
    const auto* mark = std::get_if<AnswerMark>(&message);
    if (mark == nullptr || !filter_.takes(mark->run, mark->sequence, from)) return;
    Taken& taken = runs[mark->run];
    taken.in_order = taken.in_order && (taken.newest == 0 || mark->sequence == taken.newest + 1);
    taken.newest = std::max(taken.newest, mark->sequence);
    taken.sequences.push_back(mark->sequence);
  }
  // An answer that was on its way when its writer died.
  struct Lost {
    bool over_a_cut_link = false;
    std::set<std::pair<int, int>> writers{};
  };
  void note_lost(const AnswerMark& mark, std::pair<int, int> writer, bool is_cut) {
    Lost& lost = lost_[{mark.run, mark.sequence}];
    lost.over_a_cut_link |= is_cut;
    lost.writers.insert(writer);
  }
  [[nodiscard]] bool is_lost(std::uint64_t run, std::uint64_t sequence,
                             const std::set<std::pair<int, int>>& given_to) const {
    const auto lost = lost_.find({run, sequence});
    return lost != lost_.end() &&
           (lost->second.over_a_cut_link || lost->second.writers == given_to);
  }
  std::map<std::uint64_t, Taken> runs{};

 private:
  std::map<std::pair<std::uint64_t, std::uint64_t>, Lost> lost_{};  // by run and sequence number
  core::FirstCome<int> filter_;
};

class Instance final : public Node, private Pipeline::Port {
 public:
  Instance(World& world, int number, int of)
      : Node(world),
        number_(number),
        born_(world.now),
        skew_(1.0 + 1e-6 * static_cast<double>(world.random.between(-200, 200))),
        offset_(world.random.between(-1000 * kSecond, 1000 * kSecond)),
        pipeline_(std::make_unique<HashEngine>(),
                  of == 1 ? service::InstanceSync()
                          : service::InstanceSync(static_cast<std::uint32_t>(number)),
                  *this) {}

  void take(int from, const Message& message) override {
    if (const auto* rate = std::get_if<Rate>(&message)) {
      pipeline_.push(rate->sample, rate->run, 0, clock());
    } else if (const auto* temperature = std::get_if<core::TemperatureSample>(&message)) {
      pipeline_.push(*temperature, clock());
    } else if (const auto* mark = std::get_if<AnswerMark>(&message)) {
      pipeline_.receive(*mark);
    } else if (const auto* question = std::get_if<Question>(&message)) {
      if (question->giver == static_cast<std::uint32_t>(number_)) give_state(question->asker);
    } else if (const auto* state = std::get_if<std::shared_ptr<State>>(&message)) {
      go_on_from(from, **state);
    }
  }
  void tick() {
    pipeline_.drain(clock());
    pipeline_.tick(clock());
    if (world_.is_replay_) pipeline_.report_progress();
    const auto giver = pipeline_.state_to_ask_for(clock());
    if (giver) world_.send(number_, static_cast<int>(*giver), Question{number_, *giver});
    note_sync();
  }
  void publisher_gone(std::uint64_t run) { pipeline_.publisher_gone(run, clock()); }
  void step_clock(Time by) { offset_ += by; }
  [[nodiscard]] const service::InstanceSync& sync() const { return pipeline_.sync(); }
  [[nodiscard]] const Pipeline& pipeline() const { return pipeline_; }
  [[nodiscard]] const std::deque<AnswerMark>& last() const { return last_; }

 private:
  [[nodiscard]] Time clock() const {
    return offset_ + static_cast<Time>(skew_ * static_cast<double>(world_.now));
  }
  // Port
  AnswerMark prepare(const HashAnswer& answer, std::uint64_t run,
                     std::uint32_t answered) noexcept override {
    prepared_ = {static_cast<std::uint32_t>(number_), answered, run, answer.raw.sequence,
                 answer.digest};
    if (run != answered_run_) {
      World::Run& begun = world_.runs_[run];
      if (born_ < begun.begun) begun.owed_from = std::max(begun.owed_from, answer.raw.sequence);
      answered_run_ = run;
    }
    return prepared_;
  }
  void write_prepared(bool) noexcept override {
    note_sync();  // it may be in sync between two ticks only
    for (const Reader* reader : world_.readers_) {
      const auto r = std::find(world_.readers_.begin(), world_.readers_.end(), reader);
      world_.send(number_, kFirstReader + static_cast<int>(r - world_.readers_.begin()), prepared_);
    }
    for (int other = 0; other < world_.instance_count_; ++other) {
      if (other != number_) world_.send(number_, other, prepared_);
    }
    last_.push_back(prepared_);
    if (last_.size() > 50) last_.pop_front();
  }
  void write_prepared_alone() noexcept override {}
  [[nodiscard]] bool has_output_of_one() const noexcept override { return true; }
  [[nodiscard]] bool can_write() const noexcept override { return true; }
  bool is_open() override { return true; }
  void begin_run() override {}
  bool await_model() override { return false; }
  void report_progress(std::uint64_t newest, core::SensorTime) override {
    world_.progress_[{pipeline_.run(), number_}] = {newest, world_.now};
  }
  void notify_learner() override {}

  // The state goes out when every reader has all that was written before it, or a second later.
  void give_state(int asker) {
    if (pipeline_.sync().health() != service::InstanceSync::Health::kInSync) return;
    auto state = std::make_shared<State>(
        State{pipeline_.engine(), pipeline_.run(), pipeline_.newest_sequence()});
    Time ready = world_.now + world_.random.between(5 * kMs, 60 * kMs);
    for (std::size_t r = 0; r < world_.readers_.size(); ++r)
      ready = std::max(ready, world_.last_arrival(number_, kFirstReader + static_cast<int>(r)));
    ready = std::min(ready, world_.now + kSecond);
    const int life = incarnation;
    world_.at(ready, [this, asker, state, life] {
      if (lives && incarnation == life) world_.send(number_, asker, state);
    });
  }
  void go_on_from(int from, const State& state) {
    if (pipeline_.sync().may_write() || !pipeline_.continues(state.run, state.sequence)) return;
    auto fresh = std::make_unique<HashEngine>(state.engine);
    std::vector<HashAnswer> answers;
    for (const auto& input : pipeline_.logged())
      Pipeline::repeat(*fresh, input, state.sequence, answers);
    note_sync();
    has_state_ = true;
    world_.trace(std::to_string(number_) + " has the state of " + std::to_string(from) +
                 " as of sample " + std::to_string(state.sequence));
    pipeline_.go_on_with(fresh, state.sequence, answers, clock());
  }
  void note_sync() {
    const bool in_sync = pipeline_.sync().may_write();
    if (in_sync == reported_in_sync_) return;
    reported_in_sync_ = in_sync;
    world_.trace(std::to_string(number_) + (in_sync ? " is in sync" : " is behind"));
    if (in_sync && !has_state_ && world_.now > 8 * kSecond) world_.began_anew = true;
    has_state_ = has_state_ && in_sync;
  }

  int number_;
  Time born_;
  double skew_;
  Time offset_;
  Pipeline pipeline_;
  AnswerMark prepared_{};
  std::uint64_t answered_run_ = 0;
  std::deque<AnswerMark> last_{};
  bool reported_in_sync_ = false;
  bool has_state_ = false;  // from another
};

// ---------------------------------------- the world

World::World(std::uint64_t seed, bool is_traced) : random(seed), traces(is_traced) {
  instance_count_ = random.happens(70) ? 2 : 3;
  period_ = random.happens(10) ? 5 * kMs : 20 * kMs;
  delay_ = random.happens(50) ? random.between(0, kMs) : random.between(0, 30 * kMs);
  jitter_ = random.happens(50) ? 0 : random.between(0, 20 * kMs);
  loss_percent_ = random.happens(50) ? 0 : static_cast<int>(random.between(1, 10));
  with_temperatures_ = random.happens(40);
  with_partitions_ = random.happens(50);
  with_second_publisher_ = random.happens(15);
  with_clock_steps_ = random.happens(30);
  is_replay_ = seed % 16 == 0;
  quiet_from_ = 30 * kSecond;
  end_ = quiet_from_ + 30 * kSecond;
}

Time World::last_arrival(int from, int to) const {
  const auto link = links_.find({from, to});
  return link == links_.end() ? 0 : std::max(link->second.last_arrival, link->second.cut_until);
}

void World::send(int from, int to, Message message) {
  Link& link = links_[{from, to}];
  Time arrival = now + delay_ + (jitter_ > 0 ? random.between(0, jitter_) : 0);
  while (loss_percent_ > 0 && random.happens(loss_percent_))
    arrival += random.between(5 * kMs, 15 * kMs) + 2 * delay_;
  const bool is_cut = now < link.cut_until;
  if (is_cut) arrival = std::max(arrival, link.cut_until + random.between(0, 20 * kMs));
  arrival = std::max(arrival, link.last_arrival);
  link.last_arrival = arrival;
  Node& target = *nodes_.at(to);
  const int life = target.incarnation;
  const int sender_life = nodes_.contains(from) ? nodes_.at(from)->incarnation : 0;
  const std::uint64_t run = from >= kFirstPublisher ? running_[from] : 0;
  at(arrival, [this, from, to, life, sender_life, run, is_cut,
               message = std::move(message)]() mutable {
    Node& node = *nodes_.at(to);
    if (!node.lives || node.incarnation != life) return;
    if (from < kFirstReader && nodes_.at(from)->incarnation != sender_life) {  // it died
      if (to >= kFirstReader)
        readers_[static_cast<std::size_t>(to - kFirstReader)]->note_lost(
            std::get<AnswerMark>(message), {from, sender_life}, is_cut);
      return;
    }
    if (from >= kFirstPublisher && running_[from] != run && runs_[run].owed_to) return;
    auto deliver = [this, from, to, message = std::move(message)] {
      if (const auto* rate = std::get_if<Rate>(&message)) {
        got_[{rate->run, to}] = rate->sample.sequence;
        runs_[rate->run].given_to[rate->sample.sequence].insert({to, nodes_.at(to)->incarnation});
      }
      nodes_.at(to)->take(from, message);
    };
    if (node.stopped_until > now) {
      node.inbox.push_back(std::move(deliver));
    } else {
      deliver();
    }
  });
}

void World::stop(int instance, Time until) {
  Node& node = *nodes_.at(instance);
  node.stopped_until = std::max(node.stopped_until, until);
  at(node.stopped_until, [this, instance, life = node.incarnation] {
    Node& awake = *nodes_.at(instance);
    if (awake.incarnation != life || awake.stopped_until > now) return;
    for (; !awake.inbox.empty(); awake.inbox.pop_front()) awake.inbox.front()();
  });
}

void World::begin_run(int publisher) {
  const std::uint64_t run = ++runs_begun_;
  running_[publisher] = run;
  runs_[run] = {.publisher = publisher, .begun = now};
  for (auto& [other, its] : runs_) {
    if (its.publisher == publisher) continue;
    const bool lives = running_[its.publisher] == other;
    if (lives || its.arrives > now) its.alone = false;
    if (lives) runs_[run].alone = false;
  }
  trace("publisher " + std::to_string(publisher) + " begins run " + std::to_string(run));
  publish(publisher, run);
}

// A replay is so far ahead of a consumer that lives and reports.
bool World::is_awaited(std::uint64_t run) const {
  for (int i = 0; i < instance_count_; ++i) {
    if (!nodes_.at(i)->lives) continue;
    const auto known = progress_.find({run, i});
    const Progress its = known == progress_.end() ? Progress{} : known->second;
    const bool reports = now - std::max(its.when, runs_.at(run).begun) < kLeftBehind;
    if (reports && runs_.at(run).published >= its.taken + kAhead) return true;
  }
  return false;
}

void World::publish(int publisher, std::uint64_t run) {
  if (running_[publisher] != run) return;
  const bool is_fast = is_replay_ && runs_[run].published < kFastSamples;
  const Time period = is_fast ? kFastPeriod : period_;
  if (is_replay_ && is_awaited(run)) {
    at(now + period, [this, publisher, run] { publish(publisher, run); });
    return;
  }
  const std::uint64_t sequence = ++runs_[run].published;
  core::AngularRateSample sample;
  sample.sequence = sequence;
  sample.time = core::SensorTime{now};
  sample.clock = is_replay_ ? core::ClockSource::kReplay : core::ClockSource::kHardware;
  for (int i = 0; i < instance_count_; ++i) {
    if (!nodes_.at(i)->lives) continue;
    send(publisher, i, Rate{run, sample});
    runs_[run].arrives = std::max(runs_[run].arrives, links_[{publisher, i}].last_arrival);
  }
  if (with_temperatures_ && sequence % 5 == 0) {
    core::TemperatureSample temperature;
    temperature.sequence = ++temperatures_;
    temperature.time = core::SensorTime{now};
    for (int i = 0; i < instance_count_; ++i) {
      if (nodes_.at(i)->lives) send(kFirstPublisher + 50, i, temperature);
    }
  }
  at(now + period, [this, publisher, run] { publish(publisher, run); });
}

// A crash loses what was not delivered; an end doesn't, and is told to all.
void World::end_run(int publisher, bool crash) {
  const std::uint64_t run = running_[publisher];
  if (run == 0) return;
  trace("run " + std::to_string(run) + (crash ? " crashes" : " ends") + " at sample " +
        std::to_string(runs_[run].published));
  if (crash) {
    crashed_publisher_ = true;
    std::uint64_t least = runs_[run].published;
    for (int i = 0; i < instance_count_; ++i) least = std::min(least, got_[{run, i}]);
    runs_[run].owed_to = least;
  }
  running_[publisher] = 0;
  if (crash) return;
  Time received = now;
  for (int i = 0; i < instance_count_; ++i)
    received = std::max(received, last_arrival(publisher, i));
  at(received + kMs, [this, run] {
    for (Instance* instance : instances_) {
      const auto learn = [instance, run] { instance->publisher_gone(run); };
      if (instance->stopped_until > now)
        instance->inbox.emplace_back(learn);
      else if (instance->lives)
        learn();
    }
  });
}

void World::cut(int a, int b, Time until) {
  cut_anybody_ = true;
  links_[{a, b}].cut_until = std::max(links_[{a, b}].cut_until, until);
}

// Somebody else is in sync, and will answer what this one has not.
bool World::is_sound_without(int without) {
  for (int i = 0; i < instance_count_; ++i) {
    const Instance& other = *instances_[static_cast<std::size_t>(i)];
    if (i != without && other.lives && other.stopped_until <= now &&
        other.sync().health() == service::InstanceSync::Health::kInSync &&
        other.pipeline().run() == instances_[static_cast<std::size_t>(without)]->pipeline().run())
      return true;
  }
  return false;
}

void World::disturb() {
  if (now >= quiet_from_) return;
  at(now + random.between(100 * kMs, 4 * kSecond), [this] { disturb(); });
  const auto i = static_cast<int>(random.next() % static_cast<std::uint64_t>(instance_count_));
  Instance& instance = *instances_[static_cast<std::size_t>(i)];
  switch (random.next() % 7) {
    case 0:
    case 1: {
      if (!instance.lives || !is_sound_without(i)) return;
      trace("instance " + std::to_string(i) + " is killed");
      instance.lives = false;
      ++instance.incarnation;
      std::erase_if(progress_, [i](const auto& known) { return known.first.second == i; });
      at(now + random.between(50 * kMs, 3 * kSecond), [this, i] {
        trace("instance " + std::to_string(i) + " starts");
        const int life = nodes_.at(i)->incarnation;
        for (auto& [ends, link] : links_) {
          if (ends.first == i || ends.second == i) link.last_arrival = now;
        }
        nodes_.at(i)->inbox.clear();
        auto anew = std::make_unique<Instance>(*this, i, instance_count_);
        anew->incarnation = life + 1;
        instances_[static_cast<std::size_t>(i)] = anew.get();
        nodes_[i] = std::move(anew);
      });
      return;
    }
    case 2:
      stop(i, now + random.between(50 * kMs, 3 * kSecond));
      trace("instance " + std::to_string(i) + " stands still");
      return;
    case 3: {
      if (!with_partitions_) return;
      const Time until = now + random.between(100 * kMs, 3 * kSecond);
      const int other =
          random.happens(50)
              ? kFirstReader + static_cast<int>(random.next() % readers_.size())
              : static_cast<int>(random.next() % static_cast<std::uint64_t>(instance_count_));
      const int from = random.happens(50) ? i : kFirstPublisher;
      if (is_replay_ && other >= kFirstReader) return;
      trace("cut: " + std::to_string(from) + " to " + std::to_string(other));
      cut(from, other, until);
      if (random.happens(50)) cut(other, from, until);
      return;
    }
    case 4:
      if (with_clock_steps_) instance.step_clock(random.between(-3600 * kSecond, 3600 * kSecond));
      return;
    case 5: {
      if (random.happens(50) || running_[kFirstPublisher] == 0) return;
      end_run(kFirstPublisher, random.happens(30));
      at(now + random.between(50 * kMs, 3 * kSecond), [this] { begin_run(kFirstPublisher); });
      return;
    }
    default:
      if (!with_second_publisher_ || is_replay_) return;
      if (running_[kFirstPublisher + 1] == 0)
        begin_run(kFirstPublisher + 1);
      else if (random.happens(30))
        end_run(kFirstPublisher + 1, true);
  }
}

void World::tick(int i) {
  Instance& instance = *instances_[static_cast<std::size_t>(i)];
  if (instance.lives && instance.stopped_until <= now) instance.tick();
  at(now + 250 * kMs, [this, i] { tick(i); });
}

std::optional<std::string> World::run() {
  for (int i = 0; i < instance_count_; ++i) {
    auto instance = std::make_unique<Instance>(*this, i, instance_count_);
    instances_.push_back(instance.get());
    nodes_[i] = std::move(instance);
  }
  for (int r = 0; r < 2; ++r) {
    auto reader = std::make_unique<Reader>(*this);
    readers_.push_back(reader.get());
    nodes_[kFirstReader + r] = std::move(reader);
  }
  for (int i = 0; i < instance_count_; ++i) {
    at(random.between(0, 250 * kMs), [this, i] { tick(i); });
  }
  begin_run(kFirstPublisher);
  at(8 * kSecond, [this] { disturb(); });
  at(quiet_from_, [this] { loss_percent_ = 0; });
  std::optional<std::string> wrong;
  at(end_ - 2 * kSecond, [this, &wrong] {
    wrong = compare_newest();
    for (const auto& [publisher, run] : running_) {
      if (run != 0) end_run(publisher, false);
    }
  });
  while (!events_.empty() && events_.front().when < end_) {
    std::pop_heap(events_.begin(), events_.end());
    const Event event = std::move(events_.back());
    events_.pop_back();
    now = event.when;
    event.action();
  }
  return wrong ? wrong : judge();
}

std::optional<std::string> World::compare_newest() {
  int leaders = 0;
  for (const Instance* instance : instances_) {
    if (instance->sync().health() != service::InstanceSync::Health::kInSync)
      return "an instance is not in sync in the end";
    leaders += instance->sync().leads() ? 1 : 0;
    bool is_same = false;
    for (const AnswerMark& mine : instance->last()) {
      for (const AnswerMark& first : instances_[0]->last()) {
        if (mine.run != first.run || mine.sequence != first.sequence) continue;
        is_same = mine.digest == first.digest;
      }
    }
    if (!is_same) return "instances differ in the end";
  }
  if (leaders != 1) return std::to_string(leaders) + " lead in the end";
  return std::nullopt;
}

std::optional<std::string> World::judge() {
  const auto named = [](const char* what, std::uint64_t a, std::uint64_t b) {
    return std::string(what) + " (" + std::to_string(a) + ", " + std::to_string(b) + ")";
  };
  for (std::size_t r = 0; r < readers_.size(); ++r) {
    for (const auto& [run, taken] : readers_[r]->runs) {
      const Run& published = runs_.at(run);
      const std::set<std::uint64_t> once(taken.sequences.begin(), taken.sequences.end());
      if (once.size() != taken.sequences.size())
        return named("a sample was taken twice: reader, run", r, run);
      if (!published.alone) continue;  // only one of the two is heard, from some sample on
      const std::uint64_t last = published.owed_to.value_or(published.published);
      std::uint64_t missing = 0;
      const std::uint64_t first = is_replay_ && run == 1 ? 1 : *once.begin();
      for (std::uint64_t k = std::max(published.owed_from, first); k <= last; ++k) {
        const auto given_to = published.given_to.find(k);
        if (once.contains(k) || given_to == published.given_to.end()) continue;
        if (readers_[r]->is_lost(run, k, given_to->second)) {
          ++lost_with_their_writer;
        } else {
          if (missing == 0)
            trace("reader " + std::to_string(r) + " lacks sample " + std::to_string(k));
          ++missing;
        }
      }
      if (missing > 0) return named("samples are missing: run, how many", run, missing);
      if (!taken.in_order && !cut_anybody_ && !crashed_publisher_ && !began_anew)
        return named("out of order: reader, run", r, run);
    }
  }
  return std::nullopt;
}

}  // namespace
}  // namespace zerodrift::simulation

int main(int argc, char** argv) {
  using zerodrift::simulation::World;
  std::uint64_t first = 1;
  std::uint64_t seeds = 1000;
  std::optional<std::uint64_t> one;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::uint64_t value = std::strtoull(argv[i + 1], nullptr, 10);
    if (std::strcmp(argv[i], "--seed") == 0) one = value;
    if (std::strcmp(argv[i], "--seeds") == 0) seeds = value;
    if (std::strcmp(argv[i], "--first") == 0) first = value;
  }
  if (one) {
    const auto wrong = World(*one, true).run();
    std::printf("seed %llu: %s\n", static_cast<unsigned long long>(*one),
                wrong ? wrong->c_str() : "all is well");
    return wrong ? 1 : 0;
  }
  std::uint64_t bad = 0;
  std::uint64_t lost = 0;
  std::uint64_t with_losses = 0;
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    World world(seed, false);
    const auto wrong = world.run();
    lost += world.lost_with_their_writer;
    with_losses += world.lost_with_their_writer > 0 ? 1U : 0U;
    if (wrong) {
      ++bad;
      if (bad <= 20)
        std::printf("seed %llu: %s\n", static_cast<unsigned long long>(seed), wrong->c_str());
    }
  }
  std::printf(
      "%llu seeds, %llu failed; of %llu seeds %llu answers died with the only instance that had "
      "them, from which their reader was cut off\n",
      static_cast<unsigned long long>(seeds), static_cast<unsigned long long>(bad),
      static_cast<unsigned long long>(with_losses), static_cast<unsigned long long>(lost));
  return bad == 0 ? 0 : 1;
}
