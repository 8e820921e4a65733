// SPDX-License-Identifier: Apache-2.0
#include "common/files/named_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "common/core/one_line.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::files {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSecret = "-----BEGIN EC PRIVATE KEY-----";
constexpr std::size_t kMost = 1000;

class NamedFile : public ScratchFolder {
 protected:
  NamedFile() {
    fs::create_directory(folder());
    write("key.pem", kSecret);
  }
  [[nodiscard]] fs::path folder() const { return folder_ / "models"; }
  [[nodiscard]] std::string refusal(const std::string& name) const {
    try {
      const std::string bytes = read_named(folder(), name, kMost);
      return "read " + bytes;
    } catch (const NameRefused& refused) {
      return refused.what();
    }
  }
};

TEST_F(NamedFile, IsReadWholeUpToItsBound) {
  std::ofstream(folder() / "a-b_c.yaml") << std::string(kMost, 'x');
  EXPECT_EQ(read_named(folder(), "a-b_c.yaml", kMost), std::string(kMost, 'x'));
  EXPECT_EQ(refusal("none.yaml"), "'none.yaml': no such file in the service's folder");
  std::ofstream(folder() / "long.yaml") << std::string(kMost + 1, 'x');
  EXPECT_EQ(refusal("long.yaml"), "'long.yaml': has more than 1000 bytes, which none needs");
  std::ofstream(folder() / "empty");
  EXPECT_EQ(read_named(folder(), "empty", kMost), "");
}

struct Way {
  const char* what;
  std::function<void(const fs::path& root)> make;  // root/models/x, or what it leads through
};

class WayOutAbuse : public NamedFile, public testing::WithParamInterface<Way> {};

// Rule: no kind of file but a regular one of the folder itself is read, and none blocks.
TEST_P(WayOutAbuse, IsRefusedWithoutAWordOfWhatLiesThere) {
  GetParam().make(folder_);
  const std::string text = refusal("x");
  EXPECT_TRUE(text.starts_with("'x': is ")) << text;
  EXPECT_EQ(text.find("BEGIN"), std::string::npos) << text;
  EXPECT_EQ(text.find(folder_.string()), std::string::npos) << text;
}

INSTANTIATE_TEST_SUITE_P(
    All, WayOutAbuse,
    testing::Values(
        Way{"link_up", [](const fs::path& r) { fs::create_symlink("../key.pem", r / "models/x"); }},
        Way{"link_by_path",
            [](const fs::path& r) { fs::create_symlink("/etc/passwd", r / "models/x"); }},
        Way{"link_within",
            [](const fs::path& r) {
              std::ofstream(r / "models/y") << kSecret;
              fs::create_symlink("y", r / "models/x");
            }},
        Way{"link_to_nothing", [](const fs::path& r) { fs::create_symlink("no", r / "models/x"); }},
        Way{"link_to_itself", [](const fs::path& r) { fs::create_symlink("x", r / "models/x"); }},
        Way{"link_to_device",
            [](const fs::path& r) { fs::create_symlink("/dev/zero", r / "models/x"); }},
        Way{"hard_link",
            [](const fs::path& r) { fs::create_hard_link(r / "key.pem", r / "models/x"); }},
        Way{"folder", [](const fs::path& r) { fs::create_directory(r / "models/x"); }},
        Way{"pipe",
            [](const fs::path& r) { ASSERT_EQ(::mkfifo((r / "models/x").c_str(), 0600), 0); }}),
    [](const auto& way) { return way.param.what; });

class NameAbuse : public NamedFile, public testing::WithParamInterface<std::string> {};

// Rule: whatever the name is, it leads nowhere, and the refusal is one clean and short line.
TEST_P(NameAbuse, LeadsNowhere) {
  const std::string text = refusal(GetParam());
  EXPECT_TRUE(text.find("is no name") != std::string::npos) << text;
  EXPECT_TRUE(core::is_one_line(text)) << text;
  EXPECT_LT(text.size(), 200U);
  ASSERT_TRUE(problem_of_name(GetParam()));
  EXPECT_TRUE(core::is_one_line(*problem_of_name(GetParam())));
  EXPECT_LT(problem_of_name(GetParam())->size(), 255U);  // of a reply
}

INSTANTIATE_TEST_SUITE_P(All, NameAbuse,
                         testing::Values("", ".", "..", "../key.pem", "/etc/passwd", "models/x",
                                         "/dev/zero", ".hidden", "a/../../key.pem", "a b", "a\nb",
                                         "\x1b[2J", "'", "\"; rm -rf /", "a\\b", "\xff\xfe",
                                         "key.pem\u202e", std::string("key.pem\0x", 9),
                                         std::string(4096, 'a'), std::string(97, 'a')));

TEST_F(NamedFile, AFolderThatIsGoneIsSaidToBe) {
  fs::remove_all(folder());
  EXPECT_EQ(refusal("x"), "'x': the service's folder is not there any more");
}

}  // namespace
}  // namespace zerodrift::files
