// SPDX-License-Identifier: Apache-2.0
// Several publishers of one ROS 2 topic. Rule: they are never mixed, and a successor is taken over
// from the first message on that its predecessor didn't send.
#include "common/replay/ros2_source.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/service/stop_signals.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::replay {
namespace {

using dds::eventually;

constexpr std::uint32_t kGyro = 3;

// Before any thread of this process, as a service does.
class StopSignals : public testing::Environment {
 public:
  void SetUp() override { service::take_signals(); }
};
const testing::Environment* const kStopSignals = testing::AddGlobalTestEnvironment(new StopSignals);

struct OfImu {
  using Message = sensor_msgs::msg::dds_::Imu_;
  using Source = RosRateSource;
  static constexpr dds::TopicSpec kSpec = dds::kRos2ImuInput;
  static core::RosRates counter() { return core::RosRates(core::ClockSource::kHardware); }
  static void set(Message& message, double value) { message.angular_velocity_().x_(value); }
  static double value(const core::AngularRateSample& sample) { return sample.rate_radps[0]; }
};
struct OfTemperature {
  using Message = sensor_msgs::msg::dds_::Temperature_;
  using Source = RosTemperatureSource;
  static constexpr dds::TopicSpec kSpec = dds::kRos2TemperatureInput;
  static core::RosTemperatures counter() { return {"coil", core::ClockSource::kHardware}; }
  static void set(Message& message, double value) { message.temperature_(value); }
  static double value(const core::TemperatureSample& sample) { return sample.temperature_degc; }
};

// A node that publishes the topic, and whose messages say that they are its own.
template <typename Of>
class Node {
 public:
  Node(const dds::NetworkOptions& network, double value)
      : value_(value),
        participant_("node", network),
        writer_(
            std::make_unique<dds::Writer<typename Of::Message>>(participant_, spec(), observer_)) {}

  // 100 Hz, by its stamps.
  bool send(bool has_stamp) {
    typename Of::Message message;
    if (has_stamp) {
      message.header_().stamp_().sec_(1'700'000'000 + sent_ / 100);
      message.header_().stamp_().nanosec_(10'000'000U * static_cast<std::uint32_t>(sent_ % 100));
    }
    ++sent_;
    Of::set(message, value_);
    return writer_->write(message);
  }
  [[nodiscard]] bool is_matched() const { return writer_->matched() > 0; }
  void leave() { writer_.reset(); }

 private:
  static const dds::TopicSpec& spec() {
    static const dds::TopicSpec kSpec = [] {
      dds::TopicSpec spec = Of::kSpec;
      spec.name = "rt/imu";
      return spec;
    }();
    return kSpec;
  }

  double value_;
  int sent_ = 0;
  dds::Participant participant_;
  dds::EndpointObserver observer_{};
  std::unique_ptr<dds::Writer<typename Of::Message>> writer_;
};

template <typename Of>
class RosPublishers : public ::testing::Test {
 protected:
  // Best effort: both ends know each other before anything is sent, and each message is received
  // before the next one is sent.
  void join(const Node<Of>& first, const Node<Of>& second) {
    ASSERT_TRUE(eventually(
        [&] { return first.is_matched() && second.is_matched() && source_.matched() == 2; }));
  }
  void send(Node<Of>& node, bool has_stamp = true) {
    const std::uint64_t before = source_.watch().received();
    ASSERT_TRUE(node.send(has_stamp));
    ASSERT_TRUE(eventually([&] { return source_.watch().received() > before; }));
  }
  // Who sent what was used since the last call.
  std::vector<double> used() {
    const std::lock_guard lock(mutex_);
    std::vector<double> values;
    for (const auto& sample : std::exchange(used_, {})) {
      EXPECT_EQ(sample.sequence, next_sequence_++) << "none is missing";
      values.push_back(Of::value(sample));
    }
    return values;
  }
  // Runs the host until it has published what is due.
  void run_once() {
    host_.run([] { return service::Status{}; },
              [this] {
                source_.report(0.0);
                service::request_stop();
              });
  }
  // What was said under this code, and how often.
  std::map<std::string, std::uint64_t> events(const std::string& code) {
    const std::lock_guard lock(mutex_);
    std::map<std::string, std::uint64_t> found;
    for (const msg::Event& event : events_) {
      if (event.code().c_str() == code && event.gyro_id() == kGyro)
        found[event.text().c_str()] += event.count();
    }
    return found;
  }

  static constexpr double kFirst = 1.0;
  static constexpr double kSecond = 2.0;

  dds::TestDomain domain_{117};
  service::Host host_{"ros2_source_test", domain_.network()};
  std::atomic<std::int64_t> now_ns_{1'000'000'000};
  std::mutex mutex_;
  std::vector<msg::Event> events_;
  std::vector<typename Of::Source::Sample> used_;
  std::uint64_t next_sequence_ = 0;
  dds::Participant listener_{"listener", domain_.network()};
  dds::Reader<msg::Event> event_reader_{listener_,
                                        [this](const msg::Event& event, const dds::SampleOrigin&) {
                                          const std::lock_guard lock(mutex_);
                                          events_.push_back(event);
                                        }};
  RosOptions options_{.topic = "/imu"};
  RosParticipant participant_{host_, domain_.network(), options_};
  typename Of::Source source_{host_,
                              kGyro,
                              participant_,
                              "/imu",
                              Of::counter(),
                              [this](const typename Of::Source::Sample& sample) {
                                const std::lock_guard lock(mutex_);
                                used_.push_back(sample);
                              },
                              [this] { return now_ns_.load(); }};
};

using BothTypes = ::testing::Types<OfImu, OfTemperature>;
TYPED_TEST_SUITE(RosPublishers, BothTypes);

// Before: both went on, and the drift of a gyro was the mean of two sensors'.
TYPED_TEST(RosPublishers, OfTwoTheFirstIsUsedUntilItLeavesAndTheOtherIsRefusedAndTold) {
  Node<TypeParam> first(this->domain_.network(), this->kFirst);
  Node<TypeParam> second(this->domain_.network(), this->kSecond);
  this->join(first, second);
  for (int n = 0; n < 10; ++n) {
    this->send(first);
    this->send(second);
  }
  EXPECT_EQ(this->used(), std::vector<double>(10, this->kFirst));
  this->run_once();
  ASSERT_TRUE(eventually([&] { return !this->events("duplicate_publisher").empty(); }));
  const std::map<std::string, std::uint64_t> told{
      {"rt/imu: a second publisher sends on this topic; only the first is used, until it is gone "
       "or silent",
       9}};
  EXPECT_EQ(this->events("duplicate_publisher"), told) << "the last one waits";
  first.leave();
  std::vector<double> next;
  ASSERT_TRUE(eventually([&] {
    this->source_.report(0.0);
    next = this->used();
    return !next.empty();
  }));
  EXPECT_EQ(next, std::vector{this->kSecond}) << "what waited";
  this->send(second);
  EXPECT_EQ(this->used(), std::vector{this->kSecond});
  EXPECT_EQ(this->source_.watch().missing(), 0U);
}

TYPED_TEST(RosPublishers, OneThatFallsSilentIsReplacedAndNothingOfItsSuccessorIsMissing) {
  Node<TypeParam> first(this->domain_.network(), this->kFirst);
  Node<TypeParam> second(this->domain_.network(), this->kSecond);
  this->join(first, second);
  this->send(first);
  this->send(first);
  this->send(second);
  this->now_ns_ += service::kSilentPublisherNs;
  this->source_.report(0.0);
  EXPECT_EQ(this->used(), (std::vector{this->kFirst, this->kFirst})) << "not longer";
  ++this->now_ns_;
  this->source_.report(0.0);
  EXPECT_EQ(this->used(), std::vector{this->kSecond}) << "though it says nothing more itself";
}

TYPED_TEST(RosPublishers, OneWithoutStampsKeepsNobodyOutAndItsMessagesAreCounted) {
  Node<TypeParam> first(this->domain_.network(), this->kFirst);
  Node<TypeParam> second(this->domain_.network(), this->kSecond);
  this->join(first, second);
  this->send(first, false);
  this->send(second);
  this->send(first, false);
  this->send(second);
  EXPECT_EQ(this->used(), (std::vector{this->kSecond, this->kSecond}));
  EXPECT_EQ(this->source_.watch().unstamped(), 2U);
}

}  // namespace
}  // namespace zerodrift::replay
