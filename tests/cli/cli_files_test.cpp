// SPDX-License-Identifier: Apache-2.0
// What a command writes never takes the place of what it reads, nor of a device; what it reads
// ends.
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <algorithm>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

struct Case {
  std::string name;
  Arguments arguments;  // OUT stands for what is written
};

std::ostream& operator<<(std::ostream& stream, const Case& one) {
  return stream << one.name;
}

// Every option of every command that writes a file.
std::vector<Case> outputs() {
  const std::string model = std::string(ZERODRIFT_SOURCE_DIR) + "/config/models/paper_fog.yaml";
  const Arguments diagnose{"diagnose", "--model", model, "--record", "@record.csv"};
  const Arguments calibrate{"calibrate", "--record", "@record.csv", "--effects", "bias"};
  const Arguments navigate{"navigate", "--record", "@record.csv", "--latitude", "48"};
  return {
      {"simulate_out", {"simulate", "--model", model, "--profile", "@record.csv", "--out", "OUT"}},
      {"compensate_out", {"compensate", "--record", "@record.csv", "--out", "OUT"}},
      {"compensate_save_checkpoint",
       {"compensate", "--record", "@record.csv", "--save-checkpoint", "OUT"}},
      {"compare_json", {"compare", "--record", "@record.csv", "--json", "OUT"}},
      {"compare_html", {"compare", "--record", "@record.csv", "--html", "OUT"}},
      {"allan_json", {"allan", "--record", "@record.csv", "--json", "OUT"}},
      {"allan_html", {"allan", "--record", "@record.csv", "--html", "OUT"}},
      {"navigate_json", system_test::operator+(navigate, {"--json", "OUT"})},
      {"navigate_html", system_test::operator+(navigate, {"--html", "OUT"})},
      {"diagnose_json", system_test::operator+(diagnose, {"--json", "OUT"})},
      {"diagnose_html", system_test::operator+(diagnose, {"--html", "OUT"})},
      {"diagnose_out_model", system_test::operator+(diagnose, {"--out-model", "OUT"})},
      {"calibrate_out_model", system_test::operator+(calibrate, {"--out-model", "OUT"})},
      {"calibrate_json",
       system_test::operator+(calibrate, {"--out-model", "@model.yaml", "--json", "OUT"})},
      {"design_out",
       {"design", "--model", model, "--diagnosis", "@record.csv", "--limits", "@limits.yaml",
        "--out", "OUT"}},
      {"design_json",
       {"design", "--model", model, "--diagnosis", "@record.csv", "--limits", "@limits.yaml",
        "--out", "@profile.yaml", "--json", "OUT"}},
      {"history_json", {"history", "--model", "@record.csv", "--json", "OUT"}},
      {"export_out", {"export", "@record.csv", "--out", "OUT"}},
      {"info_json", {"info", "@record.csv", "--json", "OUT"}},
      {"record_out", {"record", "--attach", "@record.csv", "--out", "OUT"}},
  };
}

class EveryOutput : public CommandLine, public testing::WithParamInterface<Case> {
 protected:
  [[nodiscard]] Arguments writing_to(const std::string& out) const {
    Arguments arguments = GetParam().arguments;
    std::replace(arguments.begin(), arguments.end(), std::string("OUT"), out);
    return arguments;
  }
};

TEST_P(EveryOutput, ThatIsAnInputIsRefusedInOneLine) {
  system_test::write(path("record.csv"), "time_s,rate_x_rad_s\n0,0\n1,0\n2,0\n");
  const std::string before = content(path("record.csv"));
  std::filesystem::create_symlink("record.csv", path("link.csv"));
  std::filesystem::create_hard_link(path("record.csv"), path("hard.csv"));
  for (const std::string out : {"@record.csv", "@../folder/record.csv", "@link.csv", "@hard.csv"}) {
    const Finished done = run(writing_to(out));
    EXPECT_EQ(done.exit_code, 2) << done.out << done.err;
    EXPECT_EQ(lines_of(done.err), 1U) << done.err;
    EXPECT_NE(done.err.find("which is also --"), std::string::npos) << done.err;
    EXPECT_EQ(files().size(), 3U);
    EXPECT_EQ(content(path("record.csv")), before);
  }
}

std::string name_of(const testing::TestParamInfo<Case>& info) {
  return info.param.name;
}
INSTANTIATE_TEST_SUITE_P(OfEveryCommand, EveryOutput, testing::ValuesIn(outputs()), name_of);

class SpecialFiles : public CommandLine {};

// A device of the test's own: a rename would destroy the computer's.
TEST_F(SpecialFiles, ADeviceThatIsWrittenStaysADevice) {
  if (::mknod(path("full").c_str(), S_IFCHR | 0600, makedev(1, 7)) != 0)
    GTEST_SKIP() << "only root makes devices, and only root could replace one";
  make_record(20);
  ASSERT_EQ(run({"export", "@record.csv", "--out", "@record.mcap"}).exit_code, 0);
  const std::string model = std::string(ZERODRIFT_SOURCE_DIR) + "/config/models/paper_fog.yaml";
  for (const Arguments& arguments : std::vector<Arguments>{
           {"simulate", "--model", model, "--profile", "@profile.yaml", "--out", "@full"},
           {"compensate", "--record", "@record.csv", "--out", "@full"},
           {"compensate", "--record", "@record.csv", "--save-checkpoint", "@full"},
           {"allan", "--record", "@record.csv", "--json", "@full"},
           {"info", "@record.mcap", "--json", "@full"},
           {"export", "@record.mcap", "--out", "@full"},
           {"export", "@record.mcap", "--attachment", "idl/angular_rate.idl", "--out", "@full"}}) {
    const Finished done = run(arguments);
    EXPECT_EQ(done.exit_code, 2) << done.out << done.err;
    EXPECT_NE(done.err.find("full: writing fails: No space left on device"), std::string::npos)
        << done.err;
    EXPECT_TRUE(std::filesystem::is_character_file(path("full"))) << arguments[0];
  }
}

// Records are read more than once, and a pipe that nobody writes would be waited for.
TEST_F(SpecialFiles, APipeOrADeviceAsInputIsRefusedInOneLine) {
  make_record(20);
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  for (const std::string special : {"@pipe", "/dev/zero", "/dev/stdin"}) {
    for (const Arguments& arguments : std::vector<Arguments>{
             {"compensate", "--record", special},
             {"compensate", "--record", "@record.csv", "--config", special},
             {"compensate", "--record", "@record.csv", "--checkpoint", special},
             {"allan", "--record", special},
             {"info", special},
             {"replay", special},
             {"export", special, "--out", "@out.csv"},
             {"simulate", "--model", special, "--profile", "@profile.yaml", "--out", "@out.csv"},
             {"record", "--out", "@out.mcap", "--attach", special}}) {
      SCOPED_TRACE(arguments[0] + ' ' + special);
      const Finished done = run(arguments);
      EXPECT_EQ(done.exit_code, 2) << done.out << done.err;
      EXPECT_EQ(lines_of(done.err), 1U) << done.err;
    }
  }
  EXPECT_EQ(files().size(), 3U);
}

TEST_F(SpecialFiles, ARecordGoesIntoAPipeAsIntoAFile) {
  make_record(20);
  const std::string model = std::string(ZERODRIFT_SOURCE_DIR) + "/config/models/paper_fog.yaml";
  const Finished done = shell("$zerodrift simulate --model '" + model +
                              "' --profile profile.yaml --rate 10 --reference --out /dev/stdout "
                              "| cat > piped.csv; echo ${PIPESTATUS[0]}");
  EXPECT_EQ(done.out, "0\n");
  EXPECT_NE(done.err.find("200 samples at 10 Hz"), std::string::npos)
      << "what is said beside the record is not in it: " << done.err;
  const auto all = files();
  // The metadata name the profile as it was given.
  const auto rows = [](const std::string& text) { return text.substr(text.find("time_s")); };
  EXPECT_EQ(rows(all.at("piped.csv")), rows(all.at("record.csv")));
}

}  // namespace
}  // namespace zerodrift::cli_test
