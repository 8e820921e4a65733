// SPDX-License-Identifier: Apache-2.0
// fuzz_diagnosis_pairs: diagnoses pairs of record and model, one a seed, as `zerodrift diagnose`
// does. Each has to end within a time, with an answer whose figures are all finite and whose
// repaired model can be read again, or with one line that refuses.
//
//   fuzz_diagnosis_pairs --first 1 --seeds 20000
//   fuzz_diagnosis_pairs --first 4711 --seeds 1 --keep /tmp/pair   # the files, to diagnose by hand
#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "common/config/config_error.h"
#include "common/config/twin_config.h"
#include "common/diagnosis/held_out.h"
#include "common/files/file_error.h"
#include "services/zerodrift/diagnosis_report.h"
#include "services/zerodrift/diagnosis_run.h"
#include "tests/fuzz/diagnosis_pair.h"
#include "tests/fuzz/expectations.h"

namespace {

using namespace zerodrift;
using Json = nlohmann::ordered_json;

struct Request {
  std::uint64_t first = 1;
  std::uint64_t seeds = 40;
  double most_s = 20.0;
  std::string keep;
};

// For the handler of signals, which may look at nothing else.
std::array<char, 80> now_running{};

// Says which pair ended the program, then ends it as the signal would have.
extern "C" void tell_seed(int signal) {
  const ssize_t written =
      ::write(STDERR_FILENO, now_running.data(), std::strlen(now_running.data()));
  static_cast<void>(written);
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

void watch_signals() {
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL, SIGVTALRM})
    ::signal(signal, tell_seed);
}

// Of the processor, so that what else runs here takes none of it.
void limit_time(double most_s) {
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(most_s);
  timer.it_value.tv_usec =
      static_cast<suseconds_t>(1e6 * (most_s - static_cast<double>(timer.it_value.tv_sec)));
  ::setitimer(ITIMER_VIRTUAL, &timer, nullptr);
}

// Whether `path`, "x/recalibrated/0/standard_error", is of a noise: the likelihood of one that
// another noise stands in for need not curve.
bool is_of_noise(const std::string& path, const Json& axis) {
  const std::string pointer = path.substr(path.find('/'), path.rfind('/') - path.find('/'));
  const Json& change = axis.at(Json::json_pointer(pointer));
  return change.contains("name") && diagnosis::is_noise(change["name"].get<std::string>());
}

// Figures that are there and have no value: what isn't known, by the answer's own account.
bool may_be_unknown(const std::string& path, const Json& axis) {
  if (path.ends_with("/unknown")) return true;
  if (path.ends_with("/standard_error")) return is_of_noise(path, axis);
  if (path.find("/gap/held_out/") != std::string::npos) return axis["held_out_kind"] == "nothing";
  if (path.find("/gap/allan_log_distance/") != std::string::npos)
    return true;  // without noise none
  return path.find("/gap/fit/") != std::string::npos && axis["verdict"] == "undecidable";
}

// The JSON writes null for what is not finite.
void demand_figures(const Json& value, const std::string& path, const Json& axis) {
  if (value.is_null() && !may_be_unknown(path, axis)) throw fuzz::Broken(path + " is no number");
  if (!value.is_structured()) return;
  for (const auto& [key, item] : value.items()) demand_figures(item, path + "/" + key, axis);
}

void demand_probabilities(const Json& axis) {
  for (const Json& effect : axis["effects"]) {
    const double probability = effect["probability"];
    fuzz::demand(probability >= 0.0 && probability <= 1.0, "a probability is in 0 to 1");
  }
}

void demand_whole(const services::DiagnosisResult& result) {
  const Json json = services::diagnosis_json(result);
  for (const auto& [name, axis] : json["axis"].items()) {
    demand_figures(axis, name, axis);
    demand_probabilities(axis);
    fuzz::demand(!axis["sentence"].get<std::string>().empty(), "an axis has a sentence");
  }
  for (const std::string& sentence : services::diagnosis_sentences(result))
    fuzz::demand_one_line(sentence);
  static_cast<void>(services::diagnosis_tables(result));
  static_cast<void>(services::diagnosis_page(result));
}

// What is not to be kept goes with the object.
class Folder {
 public:
  explicit Folder(const std::string& keep) : is_kept_(!keep.empty()), path_(keep) {
    const std::string own = "zerodrift_pairs_" + std::to_string(::getpid());
    if (!is_kept_) path_ = std::filesystem::temp_directory_path() / own;
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    if (!is_kept_) std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  bool is_kept_;
  std::filesystem::path path_;
};

class Pairs {
 public:
  explicit Pairs(Request request) : request_(std::move(request)), folder_(request_.keep) {}

  int run() {
    watch_signals();
    for (std::uint64_t i = 0; i < request_.seeds; ++i) {
      const std::uint64_t seed = request_.first + i;
      std::snprintf(now_running.data(), now_running.size(), "\nseed %" PRIu64 ": no answer\n",
                    seed);
      limit_time(request_.most_s);
      try_pair(seed);
      if ((i + 1) % 500 == 0) tell();
    }
    limit_time(0.0);
    tell();
    return failed_ == 0 ? 0 : 1;
  }

 private:
  void try_pair(std::uint64_t seed) {
    const std::clock_t begin = std::clock();
    try {
      run_pair(fuzz::diagnosis_pair(seed));
      ++answered_;
    } catch (const fuzz::Broken& broken) {
      fail(seed, broken.what());
    } catch (const std::exception& error) {
      fail(seed, std::string("unexpected: ") + error.what());
    }
    const double took_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    total_s_ += took_s;
    if (took_s <= longest_s_) return;
    longest_s_ = took_s;
    longest_seed_ = seed;
  }

  void run_pair(const fuzz::DiagnosisPair& pair) {
    const std::filesystem::path& folder = folder_.path();
    services::DiagnosisRequest of;
    of.model = folder / "model.yaml";
    of.record.file = folder / "record.csv";
    config::save_model(pair.model, of.model);
    std::ofstream(of.record.file) << pair.record;
    if (!pair.validation.empty()) {
      of.validation.push_back(folder / "validation.csv");
      std::ofstream(of.validation.back()) << pair.validation;
    }
    diagnose(of, folder / "repaired.yaml");
  }

  void diagnose(const services::DiagnosisRequest& request, const std::string& repaired) {
    std::string refusal;
    try {
      const services::DiagnosisResult result = services::run_diagnosis(request);
      demand_whole(result);
      config::save_model(result.diagnosis.repaired, repaired);
    } catch (const files::FileError& error) {
      refusal = error.what();
    } catch (const std::invalid_argument& error) {
      refusal = error.what();
    }
    if (refusal.empty()) return static_cast<void>(config::load_model(repaired));
    fuzz::demand_one_line(refusal);
    // An error of a library would name no file.
    fuzz::demand(refusal.find(request.record.file) != std::string::npos ||
                     refusal.find("validation.csv") != std::string::npos,
                 ("a refusal names the record, found: " + refusal).c_str());
    ++refused_;
  }

  void fail(std::uint64_t seed, const std::string& why) {
    ++failed_;
    std::printf("seed %" PRIu64 ": %s\n", seed, why.c_str());
    std::fflush(stdout);
  }

  void tell() const {
    std::printf("%" PRIu64 " answered, %" PRIu64 " of them refused, %" PRIu64
                " failed; %.1f s, the longest %.2f s (seed %" PRIu64 ")\n",
                answered_, refused_, failed_, total_s_, longest_s_, longest_seed_);
    std::fflush(stdout);
  }

  Request request_;
  Folder folder_;
  std::uint64_t answered_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t failed_ = 0;
  double total_s_ = 0.0;
  double longest_s_ = 0.0;
  std::uint64_t longest_seed_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Diagnoses made-up pairs of record and model.", "fuzz_diagnosis_pairs");
  Request request;
  app.add_option("--first", request.first, "first seed")->capture_default_str();
  app.add_option("--seeds", request.seeds, "how many")->capture_default_str();
  app.add_option("--most", request.most_s, "processor's seconds a pair")->capture_default_str();
  app.add_option("--keep", request.keep, "folder for the files of the last pair");
  CLI11_PARSE(app, argc, argv);
  return Pairs(std::move(request)).run();
}
