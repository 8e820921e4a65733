// SPDX-License-Identifier: Apache-2.0
// Each call by which a command makes its files fails once, and from then on for good: the command
// ends with its outputs whole, or with one line, and never with half a file under a name. The same
// for allocations.
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <sstream>
#include <vector>

#include "tests/cli/command_line.h"
#include "tests/cli/failing_calls.h"
#include "tests/support/sanitized.h"

namespace zerodrift::cli_test {
namespace {

constexpr const char* kAllocatesByItself = "a sanitizer replaces the functions that are to fail";

struct Case {
  std::string name;
  Arguments arguments;
};

std::ostream& operator<<(std::ostream& stream, const Case& one) {
  return stream << one.name;
}

std::vector<Case> commands() {
  const std::string model = std::string(ZERODRIFT_SOURCE_DIR) + "/config/models/paper_fog.yaml";
  const Arguments simulate{"simulate",      "--model", model, "--profile",
                           "@profile.yaml", "--rate",  "10",  "--out"};
  return {
      {"simulate", system_test::operator+(simulate, {"@out.csv"})},
      {"simulate_compressed", system_test::operator+(simulate, {"@out.csv.gz"})},
      {"compensate",
       {"compensate", "--record", "@record.csv", "--out", "@out.csv", "--save-checkpoint",
        "@out.ckpt"}},
      {"allan", {"allan", "--record", "@record.csv", "--json", "@out.json"}},
      {"info", {"info", "@record.csv", "--json", "@out.json"}},
      {"export_to_recording", {"export", "@record.csv", "--out", "@out.mcap"}},
      {"export_to_record", {"export", "@record.mcap", "--out", "@out.csv"}},
  };
}

struct Counts {
  std::uint64_t file_calls = 0;
  std::uint64_t allocations = 0;
  std::uint64_t threads = 0;
};

class FailingCommandLine : public CommandLine {
 protected:
  // Counts of what was called go to `counts`.
  Finished run_failing(const Arguments& arguments, const Environment& how,
                       Counts* counts = nullptr) {
    const std::filesystem::path told = path("..") / "counts";
    std::filesystem::remove(told);
    Environment environment{{"LD_PRELOAD", std::string(ZERODRIFT_BIN_DIR) + "/libfailing_calls.so"},
                            {"SOURCE_DATE_EPOCH", "951782400"},  // files are equal at midnight, too
                            {kFailFolder, path("").string()},
                            {kCounts, told.string()}};
    environment.insert(environment.end(), how.begin(), how.end());
    const Finished done = run(arguments, environment);
    if (counts != nullptr)
      std::istringstream(content(told)) >> counts->file_calls >> counts->allocations >>
          counts->threads;
    return done;
  }

  // Of a run in which none fails; `ends_well`: with exit code 0, or another one.
  std::uint64_t allocations_of(const Arguments& arguments, bool ends_well = true) {
    Counts counts;
    const Finished done = run_failing(arguments, {}, &counts);
    EXPECT_EQ(done.exit_code == 0, ends_well) << done.exit_code << '\n' << done.err;
    return counts.allocations;
  }

  Finished run_without_allocation(std::uint64_t n, const Arguments& arguments) {
    const Finished done = run_failing(arguments, {{kFailAllocation, std::to_string(n)}});
    EXPECT_TRUE(done.exit_code == 0 || done.exit_code == 1 || done.exit_code == 2)
        << done.exit_code << '\n'
        << done.err;
    EXPECT_EQ(done.err.find("bad_alloc"), std::string::npos) << done.err;
    return done;
  }
};

class FailingCalls : public FailingCommandLine, public testing::WithParamInterface<Case> {
 protected:
  void SetUp() override {
    make_record(30);
    ASSERT_EQ(run({"export", "@record.csv", "--out", "@record.mcap"}).exit_code, 0);
    inputs_ = files();
    EXPECT_EQ(run_failing(GetParam().arguments, {}, &whole_counts_).exit_code, 0);
    whole_ = files();
    ASSERT_GT(whole_.size(), inputs_.size());
    remove_outputs();
  }

  void expect_whole_or_nothing(const Finished& done) {
    const auto left = files();
    if (done.exit_code == 0) {
      EXPECT_TRUE(left == whole_) << left.size() << " files where there should be " << whole_.size()
                                  << ", or one is not whole\n"
                                  << done.err;
      return;
    }
    EXPECT_TRUE(done.exit_code == 1 || done.exit_code == 2) << done.exit_code << '\n' << done.err;
    EXPECT_GE(lines_of(done.err), 1U);
    EXPECT_EQ(done.err.find("terminate"), std::string::npos) << done.err;
    for (const auto& [name, text] : left)
      EXPECT_TRUE(whole_.contains(name) && whole_.at(name) == text) << name << '\n' << done.err;
  }

  void remove_outputs() {
    for (const auto& [name, text] : files()) {
      if (!inputs_.contains(name)) std::filesystem::remove(path(name));
    }
  }

  std::map<std::string, std::string> inputs_;
  std::map<std::string, std::string> whole_;
  Counts whole_counts_;
};

TEST_P(FailingCalls, OfTheDiskLeaveAWholeFileOrNone) {
  ASSERT_GE(whole_counts_.file_calls, 5U) << "open, write, fsync, close, rename";
  for (const char* for_good : {"", "yes"}) {
    for (std::uint64_t n = 1; n <= whole_counts_.file_calls && !HasFailure(); ++n) {
      SCOPED_TRACE("call " + std::to_string(n) + (*for_good ? " and all after it" : ""));
      Counts counts;
      const Finished done = run_failing(GetParam().arguments,
                                        {{kFailCall, std::to_string(n)},
                                         {kFailForGood, for_good},
                                         {kFailErrno, std::to_string(n % 2 ? ENOSPC : EIO)}},
                                        &counts);
      EXPECT_GE(counts.file_calls, n) << "it did not fail";
      EXPECT_LE(lines_of(done.err), 1U) << done.err;
      expect_whole_or_nothing(done);
      remove_outputs();
    }
  }
}

// A few of the thousands, everywhere in the run and more of them at its end, where results are made
// and written; each alone, as the C library itself ends a process that has no memory left for
// unwinding.
TEST_P(FailingCalls, ForMemoryLeaveAWholeFileOrNone) {
  if (kIsSanitized) GTEST_SKIP() << kAllocatesByItself;
  constexpr std::uint64_t kTried = 16;
  constexpr std::uint64_t kTriedAtTheEnd = 32;
  const std::uint64_t all = whole_counts_.allocations;
  const std::uint64_t end = all - all / 5;
  std::vector<std::uint64_t> tried;
  for (std::uint64_t i = 0; i < kTried; ++i) tried.push_back(1 + i * all / kTried);
  for (std::uint64_t i = 0; i < kTriedAtTheEnd; ++i)
    tried.push_back(end + i * (all - end) / kTriedAtTheEnd);
  for (const std::uint64_t n : tried) {
    if (HasFailure()) break;
    SCOPED_TRACE("allocation " + std::to_string(n));
    Counts counts;
    const Finished done =
        run_failing(GetParam().arguments, {{kFailAllocation, std::to_string(n)}}, &counts);
    // One that ends within a destructor counts no more.
    EXPECT_TRUE(counts.allocations >= n || done.exit_code != 0) << "it did not fail";
    expect_whole_or_nothing(done);
    remove_outputs();
  }
}

TEST_P(FailingCalls, ForAThreadLeaveAWholeFileOrNone) {
  if (kIsSanitized) GTEST_SKIP() << kAllocatesByItself;
  ASSERT_GE(whole_counts_.threads, 1U) << "who waits for signals";
  for (std::uint64_t n = 1; n <= whole_counts_.threads && !HasFailure(); ++n) {
    SCOPED_TRACE("thread " + std::to_string(n));
    const Finished done = run_failing(GetParam().arguments, {{kFailThread, std::to_string(n)}});
    expect_whole_or_nothing(done);
    EXPECT_TRUE(done.exit_code == 0 ||
                done.err.find("no further thread can be started") != std::string::npos)
        << done.err;
    EXPECT_NE(done.exit_code, 2) << "no fault of the input";
    remove_outputs();
  }
}

// Memory that ends anywhere between the end of a command's set-up and its own: a file is not called
// damaged or taken for another kind, no part of a library's state that was not made is used, and a
// file that was made is whole. By the ending of the file.
class MemoryThatEnds : public FailingCommandLine, public testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    if (kIsSanitized) GTEST_SKIP() << kAllocatesByItself;
    std::string text = "time_s,rate_x_deg_s\n";
    for (int i = 0; i < 100; ++i) text += std::to_string(i) + ",0.25\n";
    system_test::write(path("record.csv"), text);
    ASSERT_EQ(run({"export", "@record.csv", "--out", "@record.mcap"}).exit_code, 0);
  }

  // Calls `judge` with the outcome of each allocation behind the set-up.
  template <typename Judge>
  void with_each_allocation_failing(const Arguments& arguments, Judge judge) {
    const std::uint64_t set_up = allocations_of({"info", "@missing.csv"}, false);
    const std::uint64_t all = allocations_of(arguments);
    ASSERT_FALSE(HasFailure());
    ASSERT_GT(set_up, 40U);
    ASSERT_GT(all, set_up);
    // The refusal of what is missing takes memory too.
    for (std::uint64_t n = set_up - 40; n <= all && !HasFailure(); ++n) {
      SCOPED_TRACE("allocation " + std::to_string(n));
      const Finished done = run_without_allocation(n, arguments);
      EXPECT_EQ(done.err.find("corrupt"), std::string::npos) << done.err;
      judge(done);
    }
  }
};

using MemoryThatEndsWhileReading = MemoryThatEnds;

TEST_P(MemoryThatEndsWhileReading, IsNoFaultOfTheFile) {
  const std::string name = "record." + GetParam();
  if (GetParam() == "csv.zst") {
    const std::string text = content(path("record.csv"));
    std::string bytes(ZSTD_compressBound(text.size()), '\0');
    bytes.resize(ZSTD_compress(bytes.data(), bytes.size(), text.data(), text.size(), 1));
    system_test::write(path(name), bytes);
  }
  const std::string whole = run({"info", "@" + name}).out;
  with_each_allocation_failing({"info", "@" + name}, [&](const Finished& done) {
    EXPECT_TRUE(done.exit_code != 0 || done.out == whole) << done.out;
  });
}

std::string with_underscores(const testing::TestParamInfo<std::string>& info) {
  std::string name = info.param;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(OfAFile, MemoryThatEndsWhileReading, testing::Values("csv.zst", "mcap"),
                         with_underscores);

using MemoryThatEndsWhileCompressing = MemoryThatEnds;

TEST_P(MemoryThatEndsWhileCompressing, LeavesAWholeFileOrNone) {
  const std::string name = "out." + GetParam();
  const Arguments arguments{"export", "@record.mcap", "--out", "@" + name};
  ASSERT_EQ(run(arguments).exit_code, 0);
  const std::string whole = content(path(name));
  with_each_allocation_failing(arguments, [&](const Finished& done) {
    const bool is_there = std::filesystem::exists(path(name));
    EXPECT_TRUE(is_there || done.exit_code != 0);
    EXPECT_TRUE(!is_there || content(path(name)) == whole) << done.err;
    std::filesystem::remove(path(name));
  });
}
INSTANTIATE_TEST_SUITE_P(OfAFile, MemoryThatEndsWhileCompressing,
                         testing::Values("csv.gz", "csv.xz"), with_underscores);

// Before any command begins: all of them describe their options first. A library's function that
// may not throw, and takes memory, shows in some ten allocations in a row.
TEST_F(FailingCommandLine, IsSetUpOrRefusedWhereMemoryEnds) {
  if (kIsSanitized) GTEST_SKIP() << kAllocatesByItself;
  constexpr std::uint64_t kStep = 7;
  const std::uint64_t all = allocations_of({"--version"});
  EXPECT_GT(all, 500U) << "the options of all commands";
  for (std::uint64_t n = 0; n <= all && !HasFailure(); n += kStep) {  // 0: none
    SCOPED_TRACE("allocation " + std::to_string(n));
    const Finished done = run_without_allocation(n, {"--version"});
    EXPECT_EQ(lines_of(done.err), done.exit_code == 0 ? 0U : 1U) << done.err;
  }
}

std::string name_of(const testing::TestParamInfo<Case>& info) {
  return info.param.name;
}
INSTANTIATE_TEST_SUITE_P(OfEveryCommand, FailingCalls, testing::ValuesIn(commands()), name_of);

}  // namespace
}  // namespace zerodrift::cli_test
