// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/provenance.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "common/files/file_error.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::services {
namespace {

// FIPS 180-4, the example of one block.
constexpr const char* kOfAbc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

class ProvenanceOfAReport : public ScratchFolder {
 protected:
  void SetUp() override { ASSERT_EQ(::setenv("SOURCE_DATE_EPOCH", "951782400", 1), 0); }
  void TearDown() override { ::unsetenv("SOURCE_DATE_EPOCH"); }
  std::string file_ = path("record.csv");
};

TEST_F(ProvenanceOfAReport, NamesTheBytesThatWereRead) {
  std::ofstream(file_) << "abc";
  EXPECT_EQ(hashed(file_).sha256, kOfAbc);
  std::ofstream(file_) << "abd";
  EXPECT_NE(hashed(file_).sha256, kOfAbc);
  std::filesystem::remove(file_);
  EXPECT_THROW((void)hashed(file_), files::FileError);
}

TEST_F(ProvenanceOfAReport, HasTheDateThatTheBuildIsToldOf) {
  EXPECT_EQ(today(), "2000-02-29");
  for (const auto* wrong : {"", "-1", "now", "1e9", "12 ", "999999999999"}) {
    ASSERT_EQ(::setenv("SOURCE_DATE_EPOCH", wrong, 1), 0);
    EXPECT_THROW((void)today(), std::invalid_argument) << wrong;
  }
}

TEST_F(ProvenanceOfAReport, HasTheCommandAsAShellTakesIt) {
  const std::array<const char*, 4> arguments{"/opt/zerodrift", "compare", "a b", "it's"};
  EXPECT_EQ(invocation_of("1", 4, arguments.data()).command_line,
            "zerodrift compare 'a b' 'it'\\''s'");
}

TEST_F(ProvenanceOfAReport, SaysTheSameInTextJsonAndPageBehindEverythingElse) {
  std::ofstream(file_) << "abc";
  const auto provenance = provenance_of({"zerodrift 1", "zerodrift compare"}, "", {file_});
  const auto text = provenance_sentences(provenance);
  ASSERT_EQ(text.size(), 3U);
  EXPECT_EQ(text[0], "Made on 2000-02-29 by zerodrift 1: zerodrift compare");
  EXPECT_NE(text[2].find(kOfAbc), std::string::npos);

  const ReportFiles files{path("report.json"), path("report.html")};
  write_report(
      files, {{"figure", 1}},
      [] {
        return report::Document{
            .title = "T", .subtitle = "", .verdict = "", .blocks = {report::Heading{"Result"}}};
      },
      provenance);
  const auto json = nlohmann::ordered_json::parse(std::ifstream(files.json));
  EXPECT_EQ(json.back(), json["provenance"]);
  EXPECT_EQ(json["provenance"]["date"], "2000-02-29");
  EXPECT_TRUE(json["provenance"]["configuration"].is_null());
  EXPECT_EQ(json["provenance"]["inputs"][0]["sha256"], kOfAbc);
  std::stringstream page;
  page << std::ifstream(files.html).rdbuf();
  std::size_t place = page.str().find("Result</h2>");
  for (const std::string& sentence : text) {
    place = page.str().find(sentence, place);
    EXPECT_NE(place, std::string::npos) << sentence;
  }
}

}  // namespace
}  // namespace zerodrift::services
