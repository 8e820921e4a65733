// SPDX-License-Identifier: Apache-2.0
// zerodrift_blind_baselines: `zerodrift diagnose` with a naive choice, for the benchmark's table.
// The same options, the same JSON.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include "common/config/twin_config.h"
#include "common/measurement/measured_record.h"
#include "common/report/json_file.h"
#include "common/service/one_of.h"
#include "services/zerodrift/diagnosis_report.h"
#include "services/zerodrift/diagnosis_run.h"
#include "tests/blind/baselines.h"

namespace {

using namespace zerodrift;

struct Request {
  blind::BaselineOptions baseline;
  std::string model;
  std::string record;
  std::vector<std::string> validation;
  std::string out_model;
  std::string json;
};

measurement::MeasuredRecord read(const std::string& file, services::DiagnosisResult& result) {
  auto record = measurement::read_measured_record({.record = {.file = file}}, [](double) {});
  result.warnings.insert(result.warnings.end(), record.warnings.begin(), record.warnings.end());
  return record;
}

void run(Request request) {
  const config::LoadedModel loaded = config::load_model(request.model);
  services::DiagnosisResult result;
  result.model = request.model;
  result.gyro = loaded.model.gyro;
  const auto record = read(request.record, result);
  result.record.file = request.record;
  std::vector<diagnosis::MeasuredSeries> validation;
  for (const std::string& file : request.validation) {
    validation.push_back(read(file, result).series);
    result.validation.push_back({.file = file});
  }
  request.baseline.record = request.record;
  result.diagnosis = blind::diagnose_by(request.baseline, loaded.model, record.series, validation);
  result.change = services::change_between(loaded.model, result.diagnosis.repaired);
  for (const std::string& sentence : services::diagnosis_sentences(result))
    std::printf("%s\n", sentence.c_str());
  if (!request.json.empty()) report::write_json(request.json, services::diagnosis_json(result));
  if (!request.out_model.empty()) config::save_model(result.diagnosis.repaired, request.out_model);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Names missing effects by ordinary least squares.", "zerodrift_blind_baselines");
  Request request;
  const std::map<std::string, blind::Method> methods{{"bic", blind::Method::kStepwiseBic},
                                                     {"stlsq", blind::Method::kStlsq}};
  app.add_option("--method", request.baseline.method, "bic or stlsq")
      ->required()
      ->transform(service::one_of(methods));
  app.add_option("--model", request.model, "the twin's model file")->required();
  app.add_option("--record", request.record, "a .csv, .csv.gz or .csv.xz file")->required();
  app.add_option("--validate", request.validation, "records that the gap is told of");
  app.add_option("--threshold", request.baseline.threshold, "of stlsq")->capture_default_str();
  app.add_option("--out-model", request.out_model, "file for the repaired model");
  app.add_option("--json", request.json, "file for all figures");
  CLI11_PARSE(app, argc, argv);
  try {
    run(std::move(request));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "zerodrift_blind_baselines: %s\n", error.what());
    return 2;
  }
  return 0;
}
