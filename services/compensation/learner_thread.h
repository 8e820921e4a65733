// SPDX-License-Identifier: Apache-2.0
// The thread on which all gyros' learners run, one label after the other.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/core/spsc_queue.h"

namespace zerodrift::services {

class LearnerThread {
 public:
  using Task = std::function<void()>;

  // `go_on` answers the samples of records and simulations that waited for a model; it is called
  // with `data_mutex` held, and no gyro in real time makes it be called.
  LearnerThread(std::size_t most_gyros, std::mutex& data_mutex, Task go_on);
  ~LearnerThread() { stop(); }
  LearnerThread(const LearnerThread&) = delete;
  LearnerThread& operator=(const LearnerThread&) = delete;
  void stop();

  // ---- of the data path; the data mutex is held
  void add(compensation::Compensator& newcomer) { newcomers_.push(&newcomer); }
  void notify() noexcept;
  // Samples wait for a model: they go on when it is there.
  void await_model() noexcept { model_awaited_ = true; }

  // ---- of the request thread
  // Has it run between two labels, and waits for that. Throws CommandRefused where it doesn't in
  // time: so the task holds on to nothing of its caller's, it may still be run.
  void ask(Task question);
  // Goes on with `after` instead. The data path of neither waits for a model meanwhile: the data
  // mutex is held. As ask(), and where it throws, `after` is kept for as long as it is needed.
  void replace(compensation::Compensator& before,
               std::unique_ptr<compensation::Compensator>& after);

 private:
  void learn_until_stopped();
  void go_on_after_model();

  std::mutex& data_mutex_;
  Task go_on_;
  core::SpscQueue<compensation::Compensator*> newcomers_;  // not seen yet
  core::SpscQueue<Task> questions_{4};                     // to be answered between two labels
  std::vector<compensation::Compensator*> roster_;         // the thread's own
  std::vector<std::unique_ptr<compensation::Compensator>> abandoned_;
  std::atomic<std::uint32_t> notifications_{0};
  std::atomic<bool> model_awaited_{false};  // by samples of a record or simulation
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace zerodrift::services
