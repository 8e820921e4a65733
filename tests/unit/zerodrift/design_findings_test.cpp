// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/design_findings.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "common/config/config_error.h"
#include "services/zerodrift/diagnosis_report.h"
#include "tests/unit/zerodrift/example_diagnosis.h"

namespace zerodrift::services {
namespace {

using Json = nlohmann::json;

Json warm_up_or_ramp() {
  const Json ramp{{"name", "rate_ramp"},
                  {"probability", 0.3},
                  {"inputs", Json::array()},
                  {"parameters", {{"ramp_deg_per_h2", 0.01}}}};
  return {{"name", "warm_up"},
          {"probability", 0.7},
          {"inputs", Json::array()},
          {"parameters", {{"amplitude_deg_h", 0.2}, {"tau_s", 1800.0}}},
          {"alternatives", Json::array({ramp})}};
}

Json document_with(const Json& effects) {
  Json axis{{"taken_back", Json::array()}, {"unknown", nullptr}};
  axis["effects"] = effects;
  return {{"axis", {{"y", axis}}}};
}

std::string error_of(const std::string& text) {
  try {
    (void)findings_from(text, "d.json", {});
  } catch (const config::ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(DesignFindings, ASetOfSeveralIsAQuestionWithTheirProbabilities) {
  const auto findings =
      findings_from(document_with(Json::array({warm_up_or_ramp()})).dump(), "d.json", {});
  ASSERT_EQ(findings.questions.size(), 1U);
  EXPECT_EQ(findings.questions[0].axis, core::Axis::kY);
  ASSERT_EQ(findings.questions[0].explanations.size(), 2U);
  EXPECT_EQ(findings.questions[0].explanations[1].name(), "rate_ramp");
  EXPECT_NEAR(findings.questions[0].explanations[1].probability, 0.3, 1e-12);
  EXPECT_EQ(findings.questions[0].explanations[1].effect.parameters.at("ramp_deg_per_h2"), 0.01);
}

// What diagnose writes is what design reads.
TEST(DesignFindings, TheJsonOfADiagnosisIsRead) {
  const auto json = diagnosis_json(example_diagnosis());
  EXPECT_NO_THROW((void)findings_from(json.dump(), "d.json", {}));
}

TEST(DesignFindings, NothingOpenAsksNothing) {
  EXPECT_TRUE(findings_from(document_with(Json::array()).dump(), "d.json", {}).questions.empty());
}

TEST(DesignFindingsAbuse, WhatIsWrongIsToldInOneLineWithItsPlace) {
  EXPECT_EQ(error_of("not json"),
            "d.json: found no JSON, expected what `zerodrift diagnose --json` writes");
  EXPECT_EQ(error_of("{}").rfind("d.json: axis: missing", 0), 0U) << error_of("{}");
  EXPECT_EQ(error_of("[]").rfind("d.json: found array, expected an object", 0), 0U);
  EXPECT_EQ(error_of(R"({"axis": [1]})"),
            "d.json: axis: found array, expected an object with axes");
  Json effect = warm_up_or_ramp();
  effect["probability"] = 2.0;
  EXPECT_EQ(error_of(document_with(Json::array({effect})).dump()),
            "d.json: axis.y.effects[0].probability: found 2, expected a probability, 0 to 1");
  effect = warm_up_or_ramp();
  effect["parameters"]["tau_s"] = "long";
  EXPECT_EQ(error_of(document_with(Json::array({effect})).dump()),
            "d.json: axis.y.effects[0].parameters.tau_s: found string, expected a number");
  effect = warm_up_or_ramp();
  effect["alternatives"][0].erase("parameters");
  EXPECT_EQ(error_of(document_with(Json::array({effect})).dump())
                .rfind("d.json: axis.y.effects[0].alternatives[0].parameters: missing", 0),
            0U);
}

}  // namespace
}  // namespace zerodrift::services
