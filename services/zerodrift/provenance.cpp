// SPDX-License-Identifier: Apache-2.0
#define OPENSSL_SUPPRESS_DEPRECATED
#include "services/zerodrift/provenance.h"

#include <openssl/sha.h>

#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "common/files/input_file.h"
#include "common/record/bag_files.h"
#include "common/report/json_file.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::services {
namespace {

constexpr std::int64_t kLastEpochS = 253402300799;  // the end of the year 9999

// What a shell takes as one word as it stands.
bool is_plain(std::string_view word) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./=,:+@%";
  return !word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos;
}

std::string quoted(std::string_view word) {
  if (is_plain(word)) return std::string(word);
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

std::chrono::sys_seconds now() {
  const char* given = std::getenv("SOURCE_DATE_EPOCH");
  if (given == nullptr) {
    return std::chrono::floor<std::chrono::seconds>(std::chrono::sys_time<std::chrono::nanoseconds>(
        std::chrono::nanoseconds(service::unix_time_ns())));
  }
  std::int64_t seconds = -1;
  const char* end = given + std::strlen(given);
  const auto read = std::from_chars(given, end, seconds);
  if (read.ec != std::errc() || read.ptr != end || seconds < 0 || seconds > kLastEpochS) {
    throw std::invalid_argument("SOURCE_DATE_EPOCH: found '" + std::string(given) +
                                "', expected seconds since 1970");
  }
  return std::chrono::sys_seconds(std::chrono::seconds(seconds));
}

// By the calls that OpenSSL 3 calls deprecated: they take no memory. EVP fetches a provider, and
// where memory ends within that the process ends by a signal.
class Sha256 {
 public:
  Sha256() { SHA256_Init(&state_); }
  void add(std::string_view bytes) { SHA256_Update(&state_, bytes.data(), bytes.size()); }
  std::string digits() {
    std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
    SHA256_Final(digest.data(), &state_);
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const unsigned char byte : digest) {
      text += kDigits[byte >> 4U];
      text += kDigits[byte & 15U];
    }
    return text;
  }

 private:
  SHA256_CTX state_{};
};

nlohmann::ordered_json json_of(const HashedFile& file) {
  return {{"file", file.name}, {"sha256", file.sha256}};
}

nlohmann::ordered_json json_of(const Provenance& provenance) {
  nlohmann::ordered_json json{{"program", provenance.made_by.version},
                              {"date", provenance.date},
                              {"command_line", provenance.made_by.command_line},
                              {"configuration", nullptr}};
  if (!provenance.configuration.name.empty())
    json["configuration"] = json_of(provenance.configuration);
  auto& inputs = json["inputs"] = nlohmann::ordered_json::array();
  for (const HashedFile& file : provenance.inputs) inputs.push_back(json_of(file));
  return json;
}

}  // namespace

Invocation invocation_of(const char* version, int argc, const char* const* argv) {
  Invocation made_by{version, "zerodrift"};
  for (int i = 1; i < argc; ++i) made_by.command_line += ' ' + quoted(argv[i]);
  return made_by;
}

std::string today() {
  const std::chrono::year_month_day date{std::chrono::floor<std::chrono::days>(now())};
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02u-%02u", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
  return text.data();
}

HashedFile hashed(const std::string& file) {
  Sha256 hash;
  files::read_in_blocks(file, [&](std::string_view block) { hash.add(block); });
  return {file, hash.digits()};
}

Provenance provenance_of(const Invocation& made_by, const std::string& configuration,
                         const std::vector<std::string>& inputs) {
  Provenance provenance{made_by, today(), {}, {}};
  if (!configuration.empty()) provenance.configuration = hashed(configuration);
  for (const std::string& input : inputs) {
    for (const std::string& file : record::input_files_of(input))
      provenance.inputs.push_back(hashed(file));
  }
  return provenance;
}

std::vector<std::string> provenance_sentences(const Provenance& provenance) {
  std::vector<std::string> text{"Made on " + provenance.date + " by " + provenance.made_by.version +
                                ": " + provenance.made_by.command_line};
  const HashedFile& configuration = provenance.configuration;
  text.push_back(configuration.name.empty()
                     ? "Configuration: the defaults."
                     : "Configuration " + configuration.name + ", SHA-256 " + configuration.sha256);
  for (const HashedFile& file : provenance.inputs)
    text.push_back("Read: " + file.name + ", SHA-256 " + file.sha256);
  return text;
}

void write_report(const ReportFiles& files, nlohmann::ordered_json json,
                  const std::function<report::Document()>& page, const Provenance& provenance) {
  if (!files.json.empty()) {
    json["provenance"] = json_of(provenance);
    report::write_json(files.json, json);
  }
  if (files.html.empty()) return;
  report::Document whole = page();
  whole.blocks.emplace_back(report::Heading{"Made by and from"});
  for (std::string& sentence : provenance_sentences(provenance))
    whole.blocks.emplace_back(report::Paragraph{std::move(sentence)});
  report::write_html(files.html, whole);
}

}  // namespace zerodrift::services
