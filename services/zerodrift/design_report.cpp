// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "common/report/numbers.h"
#include "common/report/table.h"
#include "services/zerodrift/design_run.h"

namespace zerodrift::services {
namespace {

using Json = nlohmann::ordered_json;
using report::significant;

constexpr int kDigits = 2;

std::string pair_of(const diagnosis::Separation& pair) {
  return pair.first + " and " + pair.second;
}

std::string axis_of(const DesignResult& result, const diagnosis::Separation& pair) {
  return std::string(core::name(result.questions[pair.question].axis));
}

std::size_t resolved(const std::vector<diagnosis::Share>& shares) {
  std::size_t sum = 0;
  for (const diagnosis::Share& share : shares) sum += share.resolved;
  return sum;
}

std::size_t records(const std::vector<diagnosis::Share>& shares) {
  std::size_t sum = 0;
  for (const diagnosis::Share& share : shares) sum += share.records;
  return sum;
}

std::string counted(std::size_t part, std::size_t whole) {
  return std::to_string(part) + " of " + std::to_string(whole);
}

Json json_of(const DesignResult& result, const diagnosis::Judgement& judgement) {
  Json pairs = Json::array();
  for (const diagnosis::Separation& pair : judgement.separations) {
    pairs.push_back({{"axis", axis_of(result, pair)},
                     {"first", pair.first},
                     {"second", pair.second},
                     {"standard_errors", pair.standard_errors}});
  }
  return {{"expected_entropy_nats", judgement.entropy_nats}, {"separations", pairs}};
}

Json json_of(const std::vector<diagnosis::Share>& shares) {
  Json json = Json::array();
  for (const diagnosis::Share& share : shares) {
    json.push_back({{"axis", core::name(share.axis)},
                    {"explanation", share.explanation},
                    {"resolved", share.resolved},
                    {"records", share.records}});
  }
  return json;
}

}  // namespace

Json design_json(const DesignRequest& request, const DesignResult& result) {
  Json json{{"model", request.model},
            {"diagnosis", request.diagnosis},
            {"limits", request.limits},
            {"seed", request.seed},
            {"notes", result.notes}};
  json["questions"] = Json::array();
  for (const diagnosis::Question& question : result.questions) {
    Json explanations = Json::array();
    for (const diagnosis::Explanation& explanation : question.explanations) {
      explanations.push_back({{"name", explanation.name()},
                              {"probability", explanation.probability},
                              {"parameters", explanation.effect.parameters}});
    }
    json["questions"].push_back(
        {{"axis", core::name(question.axis)}, {"explanations", explanations}});
  }
  if (result.questions.empty()) return json;
  json["designed"] = json_of(result, result.design.judgement);
  json["designed"]["measured"] = json_of(result.shares);
  json["best_fixed"] = json_of(result, result.fixed.judgement);
  json["best_fixed"]["what"] = result.fixed.what;
  json["best_fixed"]["measured"] = json_of(result.fixed_shares);
  json["inseparable"] = Json::array();
  for (const diagnosis::Inseparable& one : result.design.inseparable) {
    json["inseparable"].push_back({{"axis", axis_of(result, one.pair)},
                                   {"first", one.pair.first},
                                   {"second", one.pair.second},
                                   {"would_separate", one.channel}});
  }
  return json;
}

std::vector<std::string> design_sentences(const DesignResult& result) {
  std::vector<std::string> sentences;
  for (const diagnosis::Inseparable& one : result.design.inseparable) {
    sentences.push_back(
        "Axis " + axis_of(result, one.pair) +
        ": expected to stay together within these limits: " + pair_of(one.pair) + ", " +
        significant(one.pair.standard_errors, kDigits) + " standard errors apart; " +
        (one.channel.empty() ? "no other channel in the limits is expected to part them."
                             : one.channel + " in the limits would part them."));
  }
  sentences.push_back("Expected entropy of what is open: " +
                      significant(result.design.judgement.entropy_nats, kDigits) +
                      " nats with this profile, " +
                      significant(result.fixed.judgement.entropy_nats, kDigits) +
                      " with the best fixed one (" + result.fixed.what + ").");
  if (result.shares.empty() || result.shares.front().records == 0) return sentences;
  sentences.push_back("Simulated and diagnosed, it tells " +
                      counted(resolved(result.shares), records(result.shares)) + " records; " +
                      result.fixed.what + ": " +
                      counted(resolved(result.fixed_shares), records(result.fixed_shares)) + ".");
  return sentences;
}

void print_design_tables(const DesignResult& result) {
  report::Table pairs{.caption = "Standard errors apart",
                      .columns = {{"axis", report::Align::kLeft},
                                  {"pair", report::Align::kLeft},
                                  {"designed"},
                                  {"best fixed"}},
                      .rows = {},
                      .footnote = {}};
  for (std::size_t i = 0; i < result.design.judgement.separations.size(); ++i) {
    const auto& pair = result.design.judgement.separations[i];
    pairs.rows.push_back(
        {{axis_of(result, pair), pair_of(pair), significant(pair.standard_errors, kDigits),
          significant(result.fixed.judgement.separations[i].standard_errors, kDigits)}});
  }
  std::printf("%s\n", report::text_table(pairs).c_str());
  if (result.shares.empty() || result.shares.front().records == 0) return;
  report::Table shares{.caption = "Records that were resolved, by what was simulated",
                       .columns = {{"axis", report::Align::kLeft},
                                   {"truth", report::Align::kLeft},
                                   {"designed"},
                                   {"best fixed"}},
                       .rows = {},
                       .footnote = {}};
  for (std::size_t i = 0; i < result.shares.size(); ++i) {
    const auto& share = result.shares[i];
    shares.rows.push_back({{std::string(core::name(share.axis)), share.explanation,
                            counted(share.resolved, share.records),
                            counted(result.fixed_shares[i].resolved, share.records)}});
  }
  std::printf("%s\n", report::text_table(shares).c_str());
}

}  // namespace zerodrift::services
