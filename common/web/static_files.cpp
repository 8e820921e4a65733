// SPDX-License-Identifier: Apache-2.0
#include "common/web/static_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "common/files/file_error.h"
#include "common/files/input_file.h"
#include "common/web/web_error.h"

namespace zerodrift::web {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMostFiles = 4096;
constexpr std::size_t kMostBytes = std::size_t{64} << 20U;
constexpr std::size_t kHashLength = 8;

constexpr std::array<std::pair<std::string_view, std::string_view>, 16> kContentTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".mjs", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".webmanifest", "application/manifest+json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".jpg", "image/jpeg"},
    {".ico", "image/x-icon"},
    {".woff2", "font/woff2"},
    {".woff", "font/woff"},
    {".wasm", "application/wasm"},
    {".txt", "text/plain; charset=utf-8"},
    {".md", "text/plain; charset=utf-8"},
}};

// FNV-1a, 64 bits: tells versions of a file apart, and nothing more is asked of it.
std::string etag_of(const std::string& content) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : content) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3U;
  }
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text = "\"";
  for (int shift = 60; shift >= 0; shift -= 4)
    text += kDigits[static_cast<std::size_t>(hash >> static_cast<unsigned>(shift) & 0xFU)];
  return text + '"';
}

std::string read_whole(const fs::path& path) {
  try {
    return files::read_whole_file(path, kMostBytes);
  } catch (const files::FileError& error) {
    throw WebError(error.what());
  }
}

// "gzip;q=0" is a no; what else stands there is not looked at.
bool takes_gzip(std::string_view accept_encoding) {
  const std::size_t at = accept_encoding.find("gzip");
  if (at == std::string_view::npos) return false;
  std::string_view rest = accept_encoding.substr(at + 4);
  rest = rest.substr(0, rest.find(','));
  return rest.find("q=0") == std::string_view::npos || rest.find("q=0.") != std::string_view::npos;
}

}  // namespace

std::string_view content_type_of(std::string_view path) {
  for (const auto& [end, type] : kContentTypes) {
    if (path.ends_with(end)) return type;
  }
  return "application/octet-stream";
}

bool has_hashed_name(std::string_view path) {
  if (path.find("/assets/") == std::string_view::npos) return false;
  const std::string_view name = path.substr(path.rfind('/') + 1);
  const std::size_t dash = name.find('-');
  const std::size_t dot = name.rfind('.');
  if (dash == std::string_view::npos || dot == std::string_view::npos || dot < kHashLength + 1)
    return false;
  const std::string_view hash = name.substr(dot - kHashLength, kHashLength);
  return dash < dot - kHashLength && name[dot - kHashLength - 1] == '-' &&
         std::all_of(hash.begin(), hash.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; });
}

StaticFiles::StaticFiles(const fs::path& folder) {
  std::size_t bytes = 0;
  try {
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.symlink_status().type() != fs::file_type::regular) continue;
      std::string content = read_whole(entry.path());
      bytes += content.size();
      if (files_.size() == kMostFiles || bytes > kMostBytes) {
        throw WebError(folder.string() + ": found more than " + std::to_string(kMostFiles) +
                       " files or 64 MiB; is it the page's folder?");
      }
      std::string etag = etag_of(content);
      files_['/' + fs::relative(entry.path(), folder).generic_string()] = {
          body_of(std::move(content)), std::move(etag)};
    }
  } catch (const fs::filesystem_error& error) {
    throw WebError(folder.string() + ": " + error.code().message());
  }
}

std::optional<Response> StaticFiles::respond(const Request& request) const {
  std::string path = request.target.path;
  if (path.ends_with('/')) path += "index.html";
  const auto plain = files_.find(path);
  if (plain == files_.end()) {
    // By the folder's name without its slash the links of its page would lead beside it.
    if (!files_.contains(path + "/index.html")) return std::nullopt;
    Response moved = plain_response(308, path + '/');
    moved.headers = {{"Location", path + '/'}};
    return moved;
  }
  const auto packed = files_.find(path + ".gz");
  const bool has_packed = packed != files_.end();
  const bool packs = has_packed && takes_gzip(request.accept_encoding);
  const File& file = packs ? packed->second : plain->second;

  Response response{.content_type = std::string(content_type_of(path)), .body = file.content};
  response.headers = {{"ETag", file.etag},
                      {"Cache-Control",
                       has_hashed_name(path) ? "public, max-age=31536000, immutable" : "no-cache"}};
  if (packs) response.headers.emplace_back("Content-Encoding", "gzip");
  if (has_packed) response.headers.emplace_back("Vary", "Accept-Encoding");
  if (request.if_none_match.find(file.etag) != std::string::npos) {
    response.status = 304;
    response.body = nullptr;
  }
  return response;
}

}  // namespace zerodrift::web
