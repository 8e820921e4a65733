// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/write_progress.h"

#include <string>

#include "common/report/numbers.h"

namespace zerodrift::services {
namespace {

constexpr std::uint64_t kEnoughToJudge = 1'000'000;  // bytes, thousands of rows
constexpr double kLarge = 100e6;

}  // namespace

WriteProgress::WriteProgress(const std::string& what, std::filesystem::path out)
    : bar_(what), out_(std::move(out)) {}

void WriteProgress::operator()(double share, std::uint64_t bytes) {
  if (!judged_ && bytes >= kEnoughToJudge && share > 0.0) {
    judged_ = true;
    announce(static_cast<double>(bytes) / share);
  }
  bar_.show(share);
}

void WriteProgress::announce(double expected_bytes) {
  if (expected_bytes < kLarge) return;
  const bool in_gb = expected_bytes >= 1e9;
  const std::string ending = out_.extension().string();
  bar_.say(out_.string() + ": about " +
           report::significant(expected_bytes / (in_gb ? 1e9 : 1e6), 2) + (in_gb ? " GB" : " MB") +
           (ending == ".csv" ? " will be written" : " will be written, less by compression"));
}

}  // namespace zerodrift::services
