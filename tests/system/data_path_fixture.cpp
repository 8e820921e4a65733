// SPDX-License-Identifier: Apache-2.0
// A service that does what none may do: its data path takes memory, waits, and shares a lock with
// its learner. The audit must find all of it.
#include <linux/futex.h>
#include <pthread.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "common/dds/participant.h"
#include "common/service/host.h"

namespace zerodrift::system_test {
namespace {

// As std::atomic::wait does where looking again and again was in vain, which depends on how busy
// the machine is.
void wait_a_moment() {
  static std::uint32_t never_changes = 0;
  const timespec at_most{.tv_sec = 0, .tv_nsec = 1'000'000};
  ::syscall(SYS_futex, &never_changes, FUTEX_WAIT_PRIVATE, 0, &at_most, nullptr, 0);
}

void break_every_rule(const dds::NetworkOptions& network) {
  std::mutex shared;
  std::vector<std::unique_ptr<int>> kept;
  std::atomic<bool> stop{false};
  std::thread learner([&] {
    pthread_setname_np(pthread_self(), "learner");
    while (!stop) {
      { const std::lock_guard lock(shared); }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  {
    dds::Participant participant("data_path_fixture", network);
    dds::Writer<msg::CompensatedRate> writer(participant);
    msg::CompensatedRate answer;
    const dds::Reader<msg::AngularRate> reader(
        participant, [&](const msg::AngularRate& rate, const dds::SampleOrigin&) {
          wait_a_moment();
          const std::lock_guard lock(shared);
          kept.push_back(std::make_unique<int>(1));
          answer.sequence_number(rate.sequence_number());
          writer.write(answer);
        });
    while (!service::wait_for_stop(std::chrono::milliseconds(100))) {
    }
  }
  stop = true;
  learner.join();
}

}  // namespace
}  // namespace zerodrift::system_test

// --domain N
int main(int argc, char** argv) {
  if (argc != 3) return 2;
  zerodrift::service::take_signals();
  zerodrift::dds::NetworkOptions network;
  network.domain = static_cast<std::uint32_t>(std::atoi(argv[2]));
  zerodrift::system_test::break_every_rule(network);
  return 0;
}
