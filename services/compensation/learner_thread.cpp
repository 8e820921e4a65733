// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/learner_thread.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <future>
#include <memory>
#include <thread>
#include <utility>

#include "common/service/realtime.h"
#include "services/compensation/command_files.h"

namespace zerodrift::services {
namespace {

using namespace std::chrono_literals;

constexpr auto kLockCheck = 50us;
constexpr auto kAnswersWithin = 2000ms;         // it answers between two labels
constexpr const char* kThreadName = "learner";  // for those who look at a running service

}  // namespace

LearnerThread::LearnerThread(std::size_t most_gyros, std::mutex& data_mutex, Task go_on)
    : data_mutex_(data_mutex),
      go_on_(std::move(go_on)),
      newcomers_(most_gyros),
      thread_([this] { learn_until_stopped(); }) {}

void LearnerThread::stop() {
  stopping_ = true;
  notify();
  if (thread_.joinable()) thread_.join();
}

void LearnerThread::notify() noexcept {
  ++notifications_;
  notifications_.notify_one();
}

void LearnerThread::learn_until_stopped() {
  pthread_setname_np(pthread_self(), kThreadName);
  service::leave_realtime();
  while (!stopping_) {
    const std::uint32_t seen = notifications_.load();
    for (auto** newcomer = newcomers_.front(); newcomer != nullptr; newcomer = newcomers_.front()) {
      roster_.push_back(*newcomer);
      newcomers_.pop();
    }
    for (auto* question = questions_.front(); question != nullptr; question = questions_.front()) {
      (*question)();
      questions_.pop();
    }
    bool learned = false;
    for (compensation::Compensator* compensator : roster_) {
      while (compensator->learner().run_one()) {
        learned = true;
        go_on_after_model();
      }
    }
    if (!learned && !stopping_) notifications_.wait(seen);
  }
}

// Whoever holds the lock may be waiting for an answer of this thread: then the tick goes on.
void LearnerThread::go_on_after_model() {
  if (!model_awaited_.exchange(false)) return;
  std::unique_lock lock(data_mutex_, std::try_to_lock);
  while (!lock.owns_lock()) {
    if (stopping_ || questions_.front() != nullptr) return;
    std::this_thread::sleep_for(kLockCheck);
    static_cast<void>(lock.try_lock());
  }
  go_on_();
}

void LearnerThread::ask(Task question) {
  auto asked = std::make_shared<std::packaged_task<void()>>(std::move(question));
  auto answered = asked->get_future();
  const bool free = questions_.push([asked] { (*asked)(); });
  notify();
  if (!free || answered.wait_for(kAnswersWithin) != std::future_status::ready) {
    throw CommandRefused("the learner doesn't answer: it is busy or hangs; try again");
  }
  answered.get();
}

void LearnerThread::replace(compensation::Compensator& before,
                            std::unique_ptr<compensation::Compensator>& after) {
  const auto exchange = [this](compensation::Compensator* out, compensation::Compensator* in) {
    return [this, out, in] { std::replace(roster_.begin(), roster_.end(), out, in); };
  };
  try {
    ask(exchange(&before, after.get()));
  } catch (const std::exception&) {
    // It may still do so, and then goes back; until then it needs both.
    questions_.push(exchange(after.get(), &before));
    abandoned_.push_back(std::move(after));
    throw;
  }
}

}  // namespace zerodrift::services
