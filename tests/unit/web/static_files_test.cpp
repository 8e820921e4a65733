// SPDX-License-Identifier: Apache-2.0
#include "common/web/static_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/web/web_error.h"

namespace zerodrift::web {
namespace {

namespace fs = std::filesystem;

class Page : public testing::Test {
 protected:
  Page() : root_(fs::temp_directory_path() / ("zerodrift_page_" + std::to_string(getpid()))) {
    fs::create_directories(root_ / "page/assets");
    write("secret.txt", "secret");
    write("page/index.html", "<p>page</p>");
    write("page/assets/index-B1a2C3d4.js", "let a;");
    write("page/assets/index-B1a2C3d4.js.gz", "packed");
    fs::create_symlink(root_ / "secret.txt", root_ / "page/link.txt");
    fs::create_directory_symlink(root_, root_ / "page/up");
  }
  ~Page() override { fs::remove_all(root_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(root_ / name) << text;
  }
  [[nodiscard]] StaticFiles files() const { return StaticFiles(root_ / "page"); }
  static Request request(const std::string& path) {
    Request made;
    made.target.path = path;
    return made;
  }
  static std::string header(const Response& response, const std::string& name) {
    for (const auto& [known, value] : response.headers)
      if (known == name) return value;
    return "";
  }

  fs::path root_;
};

TEST_F(Page, FilesComeWithTypeAndTag) {
  const auto index = files().respond(request("/"));
  ASSERT_TRUE(index);
  EXPECT_EQ(*index->body, "<p>page</p>");
  EXPECT_EQ(index->content_type, "text/html; charset=utf-8");
  EXPECT_EQ(header(*index, "Cache-Control"), "no-cache");
  EXPECT_EQ(*files().respond(request("/index.html"))->body, *index->body);
}

TEST_F(Page, WhoHasItAlreadyIsToldSo) {
  Request again = request("/");
  again.if_none_match = header(*files().respond(request("/")), "ETag");
  const auto response = files().respond(again);
  EXPECT_EQ(response->status, 304U);
  EXPECT_FALSE(response->body);
  write("page/index.html", "<p>another</p>");
  EXPECT_EQ(files().respond(again)->status, 200U);
}

TEST_F(Page, AHashedAssetIsKeptForAYearAndPackedForWhoTakesIt) {
  Request asset = request("/assets/index-B1a2C3d4.js");
  EXPECT_EQ(*files().respond(asset)->body, "let a;");
  EXPECT_EQ(header(*files().respond(asset), "Cache-Control"),
            "public, max-age=31536000, immutable");
  EXPECT_EQ(header(*files().respond(asset), "Vary"), "Accept-Encoding");
  asset.accept_encoding = "br, gzip";
  const auto packed = files().respond(asset);
  EXPECT_EQ(*packed->body, "packed");
  EXPECT_EQ(header(*packed, "Content-Encoding"), "gzip");
  EXPECT_EQ(packed->content_type, "text/javascript; charset=utf-8");
  asset.accept_encoding = "gzip;q=0";
  EXPECT_EQ(*files().respond(asset)->body, "let a;");
}

TEST_F(Page, NothingOutsideTheFolderIsServedByPathOrLink) {
  for (const char* path : {"/secret.txt", "/../secret.txt", "/link.txt", "/up/secret.txt",
                           "/page/index.html", "/assets", "/assets/"})
    EXPECT_FALSE(files().respond(request(path))) << path;
}

TEST_F(Page, ASubfoldersNameLeadsToItsPage) {
  fs::create_directory(root_ / "page/docs");
  write("page/docs/index.html", "<p>index</p>");
  write("page/docs/a.md", "# A");
  EXPECT_EQ(*files().respond(request("/docs/"))->body, "<p>index</p>");
  EXPECT_EQ(files().respond(request("/docs/a.md"))->content_type, "text/plain; charset=utf-8");
  const auto moved = files().respond(request("/docs"));
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->status, 308U);
  EXPECT_EQ(header(*moved, "Location"), "/docs/");
  for (const char* path : {"/docs/../../secret.txt", "//docs", "/assets"})
    EXPECT_FALSE(files().respond(request(path))) << path;
}

TEST_F(Page, AFolderThatIsNotThereIsOneLine) {
  EXPECT_THROW(StaticFiles(root_ / "nowhere"), WebError);
}

TEST(HashedName, IsWhatABundlerWrites) {
  EXPECT_TRUE(has_hashed_name("/assets/index-B1a2C3d4.js"));
  EXPECT_TRUE(has_hashed_name("/assets/u-plot-_-a2C3d4.css"));
  for (const char* path : {"/index-B1a2C3d4.js", "/assets/index.js", "/assets/index-short.js",
                           "/assets/-B1a2C3.js", "/assets/index-B1a2C3d4"})
    EXPECT_FALSE(has_hashed_name(path)) << path;
}

}  // namespace
}  // namespace zerodrift::web
