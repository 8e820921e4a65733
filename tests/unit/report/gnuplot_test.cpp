// SPDX-License-Identifier: Apache-2.0
#include "common/report/gnuplot.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cerrno>

#include "common/report/report_error.h"
#include "tests/support/scratch_folder.h"
#include "tests/unit/report/other_path.h"

namespace zerodrift::report {
namespace {

class Gnuplot : public ScratchFolder {
 protected:
  // PATH with only this shell script in gnuplot's place.
  [[nodiscard]] std::string only(const std::string& script) const {
    make_executable(write("gnuplot", "#!/bin/sh\n" + script));
    return path("").string();
  }

  static std::string error_of(std::chrono::milliseconds limit) {
    try {
      static_cast<void>(run_gnuplot("print 1\n", limit));
    } catch (const ReportError& error) {
      return error.what();
    }
    return "no error";
  }

  // No child is left behind, neither running nor dead.
  static void expect_no_children() {
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
    EXPECT_EQ(errno, ECHILD);
  }
};

TEST_F(Gnuplot, PrintsWhatTheScriptSays) {
  EXPECT_EQ(run_gnuplot("set print '-'\nprint 6*7\n"), "42\n");
  expect_no_children();
}

TEST_F(Gnuplot, NotInstalledNamesThePackage) {
  const OtherPath other{path("").string()};
  EXPECT_EQ(error_of(kGnuplotLimit),
            "pictures need gnuplot, which is not on the PATH; install the package gnuplot-nox");
}

TEST_F(Gnuplot, HangingIsKilledAndReaped) {
  const OtherPath other{only("trap '' TERM INT HUP\nwhile :; do :; done\n")};
  EXPECT_EQ(error_of(std::chrono::milliseconds{100}),
            "gnuplot did not finish a picture within 100 ms and was killed");
  expect_no_children();
}

// With pipes, the grandchild would hold the other end for as long as it lives.
TEST_F(Gnuplot, IsNotWaitedForOnceItHasEndedWhateverItLeftRunning) {
  const OtherPath other{only("echo done\nwhile :; do :; done &\n")};
  EXPECT_EQ(run_gnuplot("x"), "done\n");
}

TEST_F(Gnuplot, FailureIsOneLineOfWhatItSaid) {
  {
    const OtherPath other{only("echo >&2\necho '  line 3: no such thing' >&2\nexit 1\n")};
    EXPECT_EQ(error_of(kGnuplotLimit), "gnuplot failed: line 3: no such thing");
  }
  const OtherPath other{only("kill -9 $$\n")};
  EXPECT_EQ(error_of(kGnuplotLimit), "gnuplot failed: it says nothing");
  expect_no_children();
}

TEST_F(Gnuplot, PrintingNothingIsAFailure) {
  const OtherPath other{only("exit 0\n")};
  EXPECT_EQ(error_of(kGnuplotLimit), "gnuplot failed: it says nothing");
}

// More than a pipe holds, both ways, and a child that never reads.
TEST_F(Gnuplot, LongScriptsAndLongOutputDoNotBlockEachOther) {
  const std::string script(5'000'000, '#');
  {
    const OtherPath other{only("while read -r line; do :; done\necho read\n")};
    EXPECT_EQ(run_gnuplot("short\n"), "read\n");
  }
  const OtherPath other{only("echo unread\n")};
  EXPECT_EQ(run_gnuplot(script), "unread\n");
}

}  // namespace
}  // namespace zerodrift::report
