#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The recipes of CONTRIBUTING.md, followed on a copy of the tree.

recipes.py [--work DIR]    adds a configuration key, an effect, a scheme and a topic, each in files that its recipe names and in no
                           other, builds what they concern and uses what was added (about ten minutes on two cores)

A line each, PASS or FAIL with the reason; exit code 1: something failed. --work: the copy and its build stay there.
"""

import argparse
import fnmatch
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LONGEST_S = 3600  # ends what hangs

SCHEME_H = """\
// SPDX-License-Identifier: Apache-2.0
// The mean of all labels, and how they lie about it.
#pragma once

#include <cstddef>

#include "common/regression/drift_scheme.h"

namespace zerodrift::regression {

// O(1).
class RunningMean final : public DriftScheme {
 public:
  void learn(const DriftLabel& label) override;
  [[nodiscard]] DriftPrediction predict(double time_s,
                                        std::span<const double> features) const override;

 private:
  std::size_t count_ = 0;
  double mean_ = 0.0;
  double squares_ = 0.0;  // of the distances from the mean
};

}  // namespace zerodrift::regression
"""
SCHEME_CPP = """\
// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/running_mean.h"

namespace zerodrift::regression {

void RunningMean::learn(const DriftLabel& label) {
  const double before = label.drift - mean_;
  mean_ += before / static_cast<double>(++count_);
  squares_ += before * (label.drift - mean_);
}

DriftPrediction RunningMean::predict(double /*time_s*/, std::span<const double> /*features*/) const {
  if (count_ == 0) return {};
  return {.drift = mean_, .variance = squares_ / static_cast<double>(count_)};
}

}  // namespace zerodrift::regression
"""
TOPIC_IDL = """\
// SPDX-License-Identifier: Apache-2.0
// A gyro's orientation on its vehicle. Topic: orientation.
module zerodrift {
module msg {

@final
struct Orientation {
  @key unsigned long gyro_id;
  double quaternion[4];  // frame b to the vehicle's, scalar first
};

};
};
"""


class Copy:
    """A tree that one recipe changes at a time."""

    def __init__(self, root):
        self.root = root
        self.touched = set()

    def new(self, path, text):
        (self.root / path).write_text(text)
        self.touched.add(path)

    def before(self, path, anchor, text):
        self.change(path, anchor, text + anchor)

    def behind(self, path, anchor, text):
        self.change(path, anchor, anchor + text)

    def change(self, path, anchor, text):
        old = (self.root / path).read_text()
        if old.count(anchor) != 1:
            sys.exit(f"recipes: {path}: found '{anchor.strip()}' {old.count(anchor)} times, expected it once")
        (self.root / path).write_text(old.replace(anchor, text))
        self.touched.add(path)


def add_key(copy):
    copy.behind("common/compensation/options.h", "  double handover_s = 1.0;", "\n  double example_s = 2.0;  //")
    copy.before("common/compensation/option_keys.cpp", '  visitor.number({"learning.handover_s"',
                '  visitor.number({"learning.example_s", Decides::kAnswers, "An example.", kAbove0},\n'
                "                 learning.example_s);\n")
    test = "tests/unit/config/compensation_config_test.cpp"
    copy.behind(test, 'text << " | learning "', " << o.learning.example_s << ' '")
    copy.before(test, '      {"learning.handover_s",', '      {"learning.example_s", {"", "learning: {example_s: 3}"}},\n')


def add_effect(copy):
    old = (copy.root / "common/twin/effects/vibration_rectification.cpp").read_text()
    new = old.replace("inputs.vibration_g * inputs.vibration_g", "inputs.vibration_g")
    for name, other in (("vibration_rectification", "vibration_bias"), ("coefficient_deg_h_per_g2", "coefficient_deg_h_per_g"),
                        ("k g^2", "k g"), ("k g²", "k g")):
        new = new.replace(name, other)
    copy.new("common/twin/effects/vibration_bias.cpp", new)
    copy.before("common/twin/effect_catalogue.cpp", "  X(acceleration_sensitivity)", "  X(vibration_bias)                  \\\n")
    copy.before("tests/unit/twin/effect_laws_test.cpp", '"acceleration_sensitivity",\n', '"vibration_bias",\n')


def add_scheme(copy):
    schemes = "common/regression/schemes/"
    copy.new(schemes + "running_mean.h", SCHEME_H)
    copy.new(schemes + "running_mean.cpp", SCHEME_CPP)
    copy.behind(schemes + "CMakeLists.txt", "rbf_network.cpp", " running_mean.cpp")
    copy.behind(schemes + "CMakeLists.txt", "rbf_network.h", " running_mean.h")
    factory = schemes + "scheme_factory.cpp"
    copy.behind(factory, '#include "common/regression/schemes/no_scheme.h"\n', '#include "common/regression/schemes/running_mean.h"\n')
    copy.behind(factory, "constexpr std::array kBaselines{\n",
                '    Baseline{"running-mean", [](Options) -> Made { return std::make_unique<RunningMean>(); }},\n')
    copy.before("common/comparison/compared_scheme.h", '"persistence",', '"running-mean", ')
    copy.behind("tests/unit/regression/schemes/scheme_factory_test.cpp", '{"none", ', '"running-mean", ')


def add_topic(copy):
    copy.new("idl/dds/orientation.idl", TOPIC_IDL)
    topics = "common/dds/topics.h"
    copy.before(topics, '#include "idl/dds/rate_referencePubSubTypes.h"', '#include "idl/dds/orientationPubSubTypes.h"\n')
    copy.before(topics, "inline constexpr TopicSpec kTwinReport{",
                'inline constexpr TopicSpec kOrientation{"orientation", "zerodrift::msg::Orientation", 1, 128, '
                "Reliability::kReliable, Durability::kVolatile, Ownership::kShared, 20ms, 0ms};\n")
    copy.before(topics, "template <> struct TopicOf<msg::TwinReport>",
                "template <> struct TopicOf<msg::Orientation> : Binding<msg::OrientationPubSubType, kOrientation> {};\n")
    copy.before(topics, "msg::ThermalCoverage>;\n", "msg::Orientation, ")
    copy.before("docs/topics.md", "| environment |", "| orientation | reliable | 1 | volatile | shared | 20 | 0 | 0 | 0 |\n")


# What a recipe is called in CONTRIBUTING.md, who follows it, and what must pass then. Programs of tests are given with a filter.
RECIPES = [
    ("A configuration key", add_key, [("config_test", "*")]),
    ("An effect of the twin", add_effect, [("twin_test", "*EffectCatalogue*:*vibration_bias*")]),
    ("A scheme to compare with", add_scheme, [("regression_schemes_test", "SchemeFactory*:*EveryScheme*")]),
    ("A topic", add_topic, [("dds_test", "Topic*")]),
]


def files_of_recipe(title):
    text = (ROOT / "CONTRIBUTING.md").read_text()
    found = re.search(r"^\*\*" + re.escape(title) + r"\*\*.*?(?=\n\n|\Z)", text, re.M | re.S)
    if not found:
        sys.exit(f"recipes: CONTRIBUTING.md: found no recipe '{title}'")
    return [word for word in re.findall(r"`([^`\s]+)`", found[0]) if "/" in word or word.endswith(".md")]


def is_named(path, named):
    return any(fnmatch.fnmatch(path, name + "*" if name.endswith("/") else name) for name in named)


def run(command, cwd, log):
    done = subprocess.run(command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=LONGEST_S)
    log.write(f"$ {' '.join(map(str, command))}\n{done.stdout}\n")
    return done


class Verdicts:
    def __init__(self):
        self.failed = False

    def say(self, good, what, why=""):
        print(f"{'PASS' if good else 'FAIL'} {what}{'' if good else ': ' + why}", flush=True)
        self.failed |= not good


def follow_all(copy, verdicts):
    for title, follow, _ in RECIPES:
        copy.touched = set()
        follow(copy)
        named = files_of_recipe(title)
        unnamed = sorted(path for path in copy.touched if not is_named(path, named))
        verdicts.say(not unnamed, f"{title}: {len(copy.touched)} files", f"its recipe doesn't name {', '.join(unnamed)}")


def build(copy, log):
    folder = copy.root / "build/release"
    configured = run(["cmake", "-G", "Ninja", "-S", copy.root, "-B", folder, "-DCMAKE_BUILD_TYPE=Release",
                      "-DZERODRIFT_BUILD_TESTS=ON", "-DZERODRIFT_UNITY=ON"], copy.root, log)
    targets = ["zerodrift"] + [program for _, _, tests in RECIPES for program, _ in tests]
    built = configured.returncode or run(["cmake", "--build", folder, "--target", *targets], copy.root, log).returncode
    if built:
        sys.exit(f"FAIL the copy doesn't build: {log.name}")
    return folder / "bin"


def use_all(copy, bin_folder, verdicts, log):
    page = run([bin_folder / "zerodrift", "config", "reference"], copy.root, log)
    (copy.root / "docs/configuration.md").write_text(page.stdout)  # as the recipe of the key says
    verdicts.say("example_s" in page.stdout, "the key is on its page", "example_s isn't")
    for title, _, tests in RECIPES:
        for program, pattern in tests:
            done = run([bin_folder / program, f"--gtest_filter={pattern}", "--gtest_brief=1"], copy.root, log)
            passed = done.returncode == 0 and "[  PASSED  ] 0 tests" not in done.stdout
            verdicts.say(passed, f"{title}: {program}", done.stdout.strip()[-500:])
    zerodrift = bin_folder / "zerodrift"
    model, record = copy.root / "recipe.yaml", copy.root / "recipe.csv"
    shipped = (ROOT / "config/models/paper_fog.yaml").read_text()
    model.write_text(shipped + "  - {kind: vibration_bias, axis: x, parameters: {coefficient_deg_h_per_g: 1}}\n")
    made = run([zerodrift, "simulate", "--model", model, "--profile", "config/profiles/diagnosis_chamber.yaml", "--seed", "1",
                "--rate", "1", "--out", record], copy.root, log)
    verdicts.say(made.returncode == 0, "the effect is simulated", made.stdout.strip())
    compared = run([zerodrift, "compare", "--record", record, "--schemes", "none,running-mean"], copy.root, log)
    verdicts.say(compared.returncode == 0 and "running-mean" in compared.stdout, "the scheme is compared", compared.stdout.strip()[-500:])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path)
    work = parser.parse_args().work
    folder = work or Path(tempfile.mkdtemp(prefix="zerodrift-recipes."))
    folder.mkdir(parents=True, exist_ok=True)
    verdicts = Verdicts()
    try:
        tracked = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
        for path in filter(None, tracked.split("\0")):
            if (ROOT / path).is_file():
                (folder / "tree" / path).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / path, folder / "tree" / path)
        copy = Copy(folder / "tree")
        follow_all(copy, verdicts)
        with open(folder / "log", "w") as log:
            use_all(copy, build(copy, log), verdicts, log)
    finally:
        if not work:
            shutil.rmtree(folder, ignore_errors=True)
    sys.exit(1 if verdicts.failed else 0)


if __name__ == "__main__":
    main()
