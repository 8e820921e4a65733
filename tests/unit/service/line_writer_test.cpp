// SPDX-License-Identifier: Apache-2.0
#include "common/service/line_writer.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

namespace zerodrift::service {
namespace {

using namespace std::chrono_literals;

// SIGUSR1 for the newest thread of this process that has the name.
void stop_thread_named(const std::string& name) {
  pid_t newest = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string its;
    std::getline(std::ifstream(task.path() / "comm") >> std::ws, its);
    if (its == name) newest = std::max(newest, std::stoi(task.path().filename().string()));
  }
  ASSERT_NE(newest, 0);
  ::syscall(SYS_tgkill, ::getpid(), newest, SIGUSR1);
}

// The smallest a pipe can be made: one page.
class LinesIntoAPipe : public testing::Test {
 protected:
  LinesIntoAPipe() {
    signal(SIGPIPE, SIG_IGN);  // as take_signals() does
    if (::pipe2(ends_.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    ::fcntl(ends_[1], F_SETPIPE_SZ, 4096);
  }
  ~LinesIntoAPipe() override {
    close_reader();
    ::close(ends_[1]);
  }
  void close_reader() {
    if (ends_[0] >= 0) ::close(ends_[0]);
    ends_[0] = -1;
  }
  // Until `part` was read.
  std::string read_until(const std::string& part) {
    std::string all;
    std::array<char, 4096> block{};
    while (all.find(part) == std::string::npos) {
      const ssize_t got = ::read(ends_[0], block.data(), block.size());
      if (got <= 0) break;
      all.append(block.data(), static_cast<std::size_t>(got));
    }
    return all;
  }

  std::array<int, 2> ends_{-1, -1};
};

TEST_F(LinesIntoAPipe, ComeInOrderAndClean) {
  LineWriter lines(ends_[1]);
  lines.write("first");
  lines.write("forged\n2026-01-01 compensation error: \x1b[31m");
  EXPECT_TRUE(lines.wait_until_written(10s));
  EXPECT_EQ(read_until("31m\n"), "first\nforged 2026-01-01 compensation error: ?[31m\n");
}

// What a processor that is taken delays is no reader's fault: the last line of a process is read.
TEST_F(LinesIntoAPipe, AThreadThatDoesNotRunIsWaitedForWhileTheReaderCouldTakeALine) {
  static std::atomic<bool> stands{false};
  static std::atomic<bool> goes_on{false};
  LineWriter lines(ends_[1]);
  lines.write("first");
  EXPECT_EQ(read_until("first\n"), "first\n");
  // The thread waits for lines from then on, and holds no lock that this test needs.
  ASSERT_TRUE(lines.wait_until_written(10s));
  signal(SIGUSR1, [](int) {
    stands = true;
    while (!goes_on) usleep(1000);
  });
  stop_thread_named("lines");
  while (!stands) usleep(1000);
  lines.write("last");
  std::thread later([] {
    usleep(100'000);
    goes_on = true;
  });
  EXPECT_TRUE(lines.wait_until_written(1ms));
  later.join();
  signal(SIGUSR1, SIG_DFL);
  EXPECT_EQ(read_until("last\n"), "last\n");
}

TEST_F(LinesIntoAPipe, ALineOfAnyLengthIsWrittenAtOnce) {
  LineWriter lines(ends_[1]);
  lines.write(std::string(100000, 'x'));
  EXPECT_TRUE(lines.wait_until_written(10s));
  EXPECT_EQ(read_until("\n"), std::string(LineWriter::kLongest, 'x') + '\n');
}

// The fault: a stalled reader of the log stopped the main loop.
TEST_F(LinesIntoAPipe, NobodyWaitsForAReaderThatStalls) {
  LineWriter lines(ends_[1]);
  const std::string text(1000, 'x');
  for (std::size_t k = 0; k < 3 * LineWriter::kMostWaiting; ++k) lines.write(text);
  EXPECT_FALSE(lines.wait_until_written(1ms));
  std::string all;
  // Half of the queue has room again when so much was read.
  while (all.size() < (LineWriter::kMostWaiting / 2 + 8) * (text.size() + 1))
    all += read_until("x\n");
  lines.write("the last");
  all += read_until("the last\n");
  EXPECT_NE(all.find(" lines were dropped here: nobody read them\nthe last\n"), std::string::npos);
}

// The fault: a log whose reader had gone ended the service.
TEST_F(LinesIntoAPipe, AReaderThatIsGoneCostsItsLinesOnly) {
  LineWriter lines(ends_[1]);
  close_reader();
  for (int k = 0; k < 10; ++k) lines.write("to nobody");
  EXPECT_TRUE(lines.wait_until_written(10s));
}

TEST_F(LinesIntoAPipe, ADescriptorThatDoesNotBlockLosesNothing) {
  ::fcntl(ends_[1], F_SETFL, O_NONBLOCK);
  LineWriter lines(ends_[1]);
  const std::string text(1000, 'x');
  for (int k = 0; k < 20; ++k) lines.write(text);
  lines.write("end");
  const std::string all = read_until("end\n");
  EXPECT_EQ(all.size(), 20U * 1001U + 4U);
}

// Its thread ends when the pipe's reader is gone, maybe after this test: it has a descriptor of its
// own, which is nobody else's as long as it may write.
TEST_F(LinesIntoAPipe, AWriterEndsWhileItsThreadIsBlocked) {
  LineWriter lines(::dup(ends_[1]));
  for (int k = 0; k < 100; ++k) lines.write(std::string(1000, 'x'));
  EXPECT_FALSE(lines.wait_until_written(1ms));
}

}  // namespace
}  // namespace zerodrift::service
