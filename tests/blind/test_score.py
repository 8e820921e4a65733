# SPDX-License-Identifier: Apache-2.0
"""The scorer on results whose score is known by hand, and what keeps the benchmark blind."""
import contextlib
import io
import json
import pathlib
import tempfile
import unittest

import cases
import effects
import generate
import run
import score
import suites


def truth(kind, names=(), d=20.0, case="case_000", removable=True, **more):
    effect_list = [{"name": n, "axis": "x", "d": d, "removable": removable} for n in names]
    return {"case": case, "class": kind, "kind": "", "axis": "x", "effects": effect_list, "recalibrated": [],
            "validation": {"before_rms_deg_h": 0.10, "oracle_rms_deg_h": 0.02}, **more}


def named(name, probability=1.0, alternatives=(), **more):
    return {"name": name, "probability": probability, "parameters": {},
            "alternatives": [{"name": n, "probability": p} for n, p in alternatives], **more}


def report(effect_list=(), unknown=None, recalibrated=(), before=0.10, after=0.02, allan=0.05, verdict=None):
    gap = {"held_out": {"before_rms_deg_h": before, "after_rms_deg_h": after},
           "allan_log_distance": {"before": 0.5, "after": allan}}
    return {"verdict": verdict or ("unknown_effect" if unknown else "effect_named" if effect_list else "consistent"),
            "axis": {"x": {"effects": list(effect_list), "unknown": unknown, "gap": gap,
                           "recalibrated": [{"name": n, "parameter": "p"} for n in recalibrated]}}}


def rows_of(*pairs):
    rows, failures = score.score([score.Result(t, r, {"cpu_s": 1.0}) for t, r in pairs])
    return {row[0]: row for row in rows}, failures


class Bars(unittest.TestCase):
    RESULTS = [score.Result(t, r, {}) for t, r in (
        (truth("null"), report()), (truth("null"), report([named("shupe")])), (truth("null"), None),
        (truth("single", ["magnetic"]), report([named("magnetic")])),
        (truth("single", ["magnetic"]), report([named("magnetic")], unknown={"description": "?"})),
        (truth("double", ["magnetic", "line"]), report([named("magnetic"), named("line")])),
        (truth("unknown", ["bump"]), report(unknown={"description": "?"})))]

    def test_what_reaches_its_bars_misses_none(self):
        self.assertEqual(score.missed_bars(self.RESULTS), [])
        self.assertEqual(score.missed_bars(self.RESULTS, most_false_names=2, least_right=3, most_failed=1), [])

    def test_each_bar_can_be_missed_and_says_so_in_a_line(self):
        for bars, words in (({"most_false_names": 1}, "2 false findings on 3"),
                            ({"least_right": 4}, "3 right of 4"),
                            ({"most_failed": 0}, "1 of 7 cases without")):
            lines = score.missed_bars(self.RESULTS, **bars)
            self.assertEqual(len(lines), 1)
            self.assertIn(words, lines[0])


class Intervals(unittest.TestCase):
    def test_wilson_interval_of_a_textbook_case(self):
        # Wilson 1927; 10 of 100 at 95 %: 5.52 to 17.44 %
        low, high = score.wilson(10, 100)
        self.assertAlmostEqual(low, 0.0552, delta=5e-5)
        self.assertAlmostEqual(high, 0.1744, delta=5e-5)

    def test_wilson_interval_of_nothing_found_starts_at_zero(self):
        low, high = score.wilson(0, 100)
        self.assertAlmostEqual(low, 0.0, delta=1e-12)
        self.assertAlmostEqual(high, 0.0370, delta=5e-5)


class Probabilities(unittest.TestCase):
    def test_error_of_a_hand_made_set_is_the_mean_distance_of_its_bins(self):
        # Eight at .75 of which six are true: no distance; two at .96 of which one is: .46 each.
        stated = [(0.75, True)] * 6 + [(0.75, False)] * 2 + [(0.96, True), (0.96, False)]
        self.assertAlmostEqual(score.calibration_error(stated), 0.2 * 0.46, delta=1e-12)
        self.assertEqual([row[3:] for row in score.reliability(stated)], [(6, 8), (1, 2)])

    def test_certainty_has_a_bin(self):
        self.assertEqual(score.reliability([(1.0, True), (0.99, False)]), [(0.99, 1.0, 0.995, 1, 2)])

    def test_nothing_stated_has_no_error(self):
        self.assertIsNone(score.calibration_error([]))
        rows, _ = rows_of((truth("null"), report()))
        self.assertEqual(rows["probability of a name: expected calibration error"][2], "no case")

    def test_every_name_of_every_class_is_judged_and_an_alternative_beside_it(self):
        rows, _ = rows_of((truth("null"), report([named("magnetic", 1.0)])),
                          (truth("single", ["shupe"]), report([named("gradient", 0.75, [("shupe", 0.25)])])),
                          (truth("double", ["shupe", "line"]), report([named("shupe", 1.0)])))
        # Names: two at 1 of which one is true, one at .75 that isn't.
        self.assertIn("0.583 (n = 3)", rows["probability of a name: expected calibration error"][2])
        self.assertIn("0.625 (n = 4)", rows["... and of its alternatives"][2])


class CredibleSets(unittest.TestCase):
    def test_set_ends_where_95_percent_are_reached(self):
        effect = named("gradient", 0.6, [("coil_lag", 0.36), ("shupe_temperature", 0.03)])
        self.assertEqual(score.credible_set(effect), ["gradient", "coil_lag"])

    def test_set_is_ordered_by_probability_and_not_by_the_file(self):
        effect = named("gradient", 0.2, [("markov", 0.01), ("coil_lag", 0.79)])
        self.assertEqual(score.credible_set(effect), ["coil_lag", "gradient"])

    def test_coil_lag_without_lag_is_a_shupe(self):
        self.assertEqual(score.canonical("coil_lag", {"tau_s": 60}), "shupe")
        self.assertEqual(score.canonical("coil_lag", {"tau_s": 600}), "coil_lag")
        self.assertEqual(score.canonical("coil_lag"), "coil_lag")


class Classes(unittest.TestCase):
    def test_null_counts_false_names_and_false_unknowns_apart(self):
        rows, failures = rows_of((truth("null"), report()), (truth("null"), report([named("shupe")])),
                                 (truth("null"), report(unknown={"description": "?"})), (truth("null"), None))
        self.assertTrue(rows["null: a false name"][2].startswith("2/4"))
        self.assertTrue(rows["null: falsely `unknown_effect`"][2].startswith("1/4"))
        self.assertEqual(len(failures), 3)

    def test_recalibration_in_a_null_case_is_no_false_name(self):
        wrong = [{"name": "shupe", "parameter": "p", "from": 1, "to": 2}]
        rows, failures = rows_of((truth("null", recalibrated=wrong), report(recalibrated=["shupe"])))
        self.assertTrue(rows["null: a false name"][2].startswith("0/1"))
        self.assertTrue(rows["null: wrong parameter found again (all of a case)"][2].startswith("1/1"))
        self.assertEqual(failures, [])

    def test_single_effects_are_split_by_strength(self):
        rows, failures = rows_of((truth("single", ["shupe"], 12.0), report([named("shupe")])),
                                 (truth("single", ["shupe"], 11.9), report([named("markov", 0.6, [("shupe", 0.4)])])),
                                 (truth("single", ["shupe"], 30.0), report()))
        self.assertTrue(rows["single, d ≥ 12: first name right"][2].startswith("1/2"))
        self.assertTrue(rows["single, d 8 to 12: first name right"][2].startswith("0/1"))
        self.assertTrue(rows["single: truth in the 95 % set"][2].startswith("2/3"))
        self.assertTrue(rows["single: mean size of the 95 % set"][2].startswith("1.500 (n = 2)"))
        self.assertEqual(len(failures), 2)

    def test_the_first_name_is_the_one_with_the_most_evidence(self):
        found = [named("markov", log_evidence=10.0), named("shupe", log_evidence=90.0)]
        rows, _ = rows_of((truth("single", ["shupe"]), report(found)))
        self.assertTrue(rows["single, d ≥ 12: first name right"][2].startswith("1/1"))
        self.assertTrue(rows["single: a name too many"][2].startswith("1/1"))

    def test_a_name_with_an_unknown_rest_is_not_right(self):
        rows, _ = rows_of((truth("single", ["shupe"]), report([named("shupe")], unknown={"description": "?"})))
        self.assertTrue(rows["single, d ≥ 12: first name right"][2].startswith("0/1"))

    def test_more_white_noise_is_right_as_a_recalibration(self):
        rows, _ = rows_of((truth("single", ["angle_random_walk"]), report(recalibrated=["angle_random_walk"])))
        self.assertTrue(rows["single, d ≥ 12: first name right"][2].startswith("1/1"))

    def test_two_effects_need_both_and_false_names_cost_precision(self):
        rows, _ = rows_of((truth("double", ["shupe", "magnetic"]), report([named("magnetic"), named("shupe")])),
                          (truth("double", ["shupe", "magnetic"]), report([named("magnetic"), named("gradient")])))
        self.assertTrue(rows["two effects: both named"][2].startswith("1/2"))
        self.assertTrue(rows["two effects: names that are true"][2].startswith("3/4"))

    def test_unknown_effects_are_flagged_or_wrongly_named(self):
        rows, failures = rows_of((truth("unknown", ["bump"]), report(unknown={"description": "bump"})),
                                 (truth("unknown", ["bump"]), report([named("markov", 0.99)])),
                                 (truth("unknown", ["bump"]), report([named("markov", 0.5, [("shupe", 0.5)])])))
        self.assertTrue(rows["unknown effect: flagged"][2].startswith("1/3"))
        self.assertTrue(rows["unknown effect: a wrong name and no other that it might be"][2].startswith("1/3"))
        self.assertEqual(len(failures), 2)

    def test_the_gap_of_unknown_effects_has_its_own_row_and_formulas_are_counted(self):
        closed = report(unknown={"description": "k * B_x^2", "formulas": [{"formula": "k * B_x^2"}]},
                        before=0.10, after=0.02)
        left = report(unknown={"description": "bump", "formulas": []}, before=0.10, after=0.10)
        rows, _ = rows_of(*[(truth("unknown", ["bump"]), one) for one in (closed, closed, left)])
        self.assertTrue(rows["unknown effect: told by a formula that held-out data confirm"][2].startswith("2/3"))
        self.assertEqual(rows["unknown gap closed on the unseen record, median"][4], "yes")
        self.assertEqual(rows["gap closed on the unseen record, median (single, double)"][2], "no case")

    def test_a_missing_result_fails_and_never_vanishes(self):
        rows, failures = rows_of((truth("single", ["shupe"]), None), (truth("unknown", ["bump"]), None),
                                 (truth("double", ["shupe", "magnetic"]), None))
        self.assertTrue(rows["no readable result (crash, time-out)"][2].startswith("3/3"))
        self.assertEqual(len(failures), 3)
        self.assertTrue(rows["single: truth in the 95 % set"][2].startswith("0/1"))

    def test_names_on_the_other_axes_are_false(self):
        result = report([named("shupe")])
        result["axis"]["y"] = {"effects": [named("markov")]}
        rows, _ = rows_of((truth("single", ["shupe"]), result))
        self.assertTrue(rows["other axes of three-axis records: a false finding"][2].startswith("1/1"))

    def test_what_hides_in_the_thermometer_is_true_on_every_axis_and_another_name_is_not(self):
        for said, wrong in (("sensor_lag", "0/1"), ("shupe", "1/1")):
            result = report([named("sensor_lag")])
            result["axis"]["y"] = {"effects": [named(said)]}
            rows, _ = rows_of((truth("single", ["sensor_lag"]), result))
            self.assertTrue(rows["other axes of three-axis records: a false finding"][2].startswith(wrong))


class Proof(unittest.TestCase):
    GAP = "gap closed on the unseen record, median (single, double)"

    def test_gap_closed_is_measured_against_the_oracle(self):
        rows, _ = rows_of((truth("single", ["shupe"]), report([named("shupe")], before=0.10, after=0.04)))
        self.assertTrue(rows[self.GAP][2].startswith("0.750 (n = 1)"))

    def test_no_result_closes_no_gap(self):
        rows, _ = rows_of((truth("single", ["shupe"]), None))
        self.assertTrue(rows[self.GAP][2].startswith("0.000 (n = 1)"))

    def test_random_effects_and_null_cases_have_no_gap_to_close(self):
        rows, _ = rows_of((truth("single", ["markov"], removable=False), report()), (truth("null"), report()))
        self.assertEqual(rows[self.GAP][2], "no case")

    def test_a_held_out_record_that_got_worse_is_named(self):
        rows, failures = rows_of((truth("null"), report(before=0.1, after=0.104)),
                                 (truth("null"), report(before=0.1, after=0.106)))
        self.assertTrue(rows["held-out RMS worse by more than 5 %"][2].startswith("1/2"))
        self.assertEqual(len(failures), 1)


class Blindness(unittest.TestCase):
    def test_seed_ranges_of_the_suites_are_disjoint(self):
        names = sorted(suites.SEEDS)
        for first in names:
            for second in names:
                if first != second:
                    a, b = suites.SEEDS[first], suites.SEEDS[second]
                    self.assertTrue(a.stop <= b.start or b.stop <= a.start)

    def test_a_suite_refuses_the_seed_of_another(self):
        for suite, seed in (("dev", 20000), ("full", 5), ("fast", 5), ("full", 10000), ("dev", 0)):
            with self.assertRaises(suites.SeedError):
                suites.plan(suite, seed)
            with self.assertRaises(suites.SeedError):
                suites.case_rng(suite, seed, 0)

    def test_full_suite_hides_every_effect_at_least_three_times(self):
        plan = suites.plan("full", 20000)
        self.assertEqual([sum(kind == wanted for kind, _ in plan) for wanted in ("null", "single", "double",
                                                                                "unknown")], [100, 100, 40, 60])
        hidden = [names[0] for kind, names in plan if kind == "single"]
        for name in effects.HIDEABLE:
            if name != "angle_random_walk":
                self.assertGreaterEqual(hidden.count(name), 3, name)
        more_noise = [names for kind, names in plan if names[0] in ("angle_random_walk", "model_noise")]
        self.assertGreaterEqual(len(more_noise), 3)

    def test_no_pair_contradicts_itself_or_hides_two_random_effects(self):
        for kind, names in suites.plan("dev", 11):
            if kind == "double":
                self.assertNotEqual(names[0], names[1])
                self.assertLess(sum(n in effects.STOCHASTIC + effects.FAULTS for n in names), 2)
                self.assertNotEqual(set(names), {"sensor_lag", "bias_temperature"})

    def test_order_of_the_cases_does_not_tell_their_class(self):
        kinds = [kind for kind, _ in suites.plan("full", 20000)]
        self.assertGreater(sum(a != b for a, b in zip(kinds, kinds[1:])), 150)

    def test_truth_never_lies_with_the_cases(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "cases"
            for bad in (out, out / "truth", pathlib.Path(folder)):
                with self.assertRaises(ValueError):
                    generate.truth_folder(out, bad)
            self.assertNotIn(out, generate.truth_folder(out, None).parents)

    def test_a_case_is_reproducible_and_its_files_do_not_tell_what_is_hidden(self):
        index = next(i for i, (kind, names) in enumerate(suites.plan("dev", 7)) if names == ["magnetic"])
        with tempfile.TemporaryDirectory() as folder:
            texts = []
            for part in "ab":
                name = generate.write_case("dev", 7, index, f"{folder}/{part}", f"{folder}/{part}_truth")
                case = pathlib.Path(folder) / part / name
                self.assertEqual(sorted(p.name for p in case.iterdir()), ["model.yaml", "record.csv", "validation.csv"])
                texts.append([(case / f).read_text() for f in ("model.yaml", "record.csv", "validation.csv")])
            self.assertEqual(texts[0], texts[1])
            self.assertNotIn("magnetic", texts[0][0])
            self.assertNotEqual(texts[0][1], texts[0][2])
            hidden = json.loads((pathlib.Path(folder) / "a_truth" / f"{name}.json").read_text())
            self.assertEqual([e["name"] for e in hidden["effects"]], ["magnetic"])
            low, high = cases.DISTANCE_RANGE
            self.assertTrue(low <= hidden["effects"][0]["d"] <= high)
            self.assertLess(hidden["validation"]["oracle_rms_deg_h"], hidden["validation"]["before_rms_deg_h"])

    def test_kinds_alone_lose_their_values_and_nothing_else(self):
        model = {"gyro_id": "a", "effects": [{"kind": "shupe", "axis": "x", "inputs": ["board"], "parameters": {"c": 1.0},
                                              "standard_errors": {"c": 0.1}}]}
        self.assertEqual(generate.kinds_alone(model),
                         {"gyro_id": "a", "effects": [{"kind": "shupe", "axis": "x", "inputs": ["board"]}]})
        self.assertIn("parameters", model["effects"][0])


FAKE = """#!/bin/sh
while [ $# -gt 0 ]; do
  case "$1" in --json) json=$2;; --method) echo "$2" > /dev/null;; esac
  shift
done
%s
"""


class Runner(unittest.TestCase):
    def run_with(self, body, *more):
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder) / "fake"
            program.write_text(FAKE % body)
            program.chmod(0o755)
            shown = io.StringIO()
            with contextlib.redirect_stdout(shown), contextlib.redirect_stderr(io.StringIO()):
                code = run.main(["--diagnose", str(program), "--suite", "dev", "--seed", "3", "--only", "0:1", *more])
            self.assertEqual(code, 0)
            return shown.getvalue()

    def test_a_program_that_answers_is_scored(self):
        text = self.run_with("""echo '{"verdict": "consistent", "axis": {"x": {}, "y": {}, "z": {}}}' > "$json" """)
        self.assertIn("| no readable result (crash, time-out) | ≤ 0 % | 0/1", text)
        self.assertIn("kinds only", self.run_with("exit 1", "--kinds-only"))

    def test_a_program_that_hangs_is_stopped_and_counts_as_failed(self):
        for body, seconds in ("exec sleep 30", "0.1"), ("while :; do :; done", "1"):
            text = self.run_with(body, "--timeout", seconds)
            self.assertIn("| no readable result (crash, time-out) | ≤ 0 % | 1/1", text)

    def test_a_program_that_waits_for_the_processor_is_not_stopped(self):
        text = self.run_with("""sleep 1.5
echo '{"verdict": "consistent", "axis": {"x": {}, "y": {}, "z": {}}}' > "$json" """, "--timeout", "1")
        self.assertIn("| no readable result (crash, time-out) | ≤ 0 % | 0/1", text)

    def test_a_baseline_gets_its_method_instead_of_the_subcommand(self):
        case = pathlib.Path("c")
        self.assertEqual(run.command_for("b", "bic", case, "m", "j")[:3], ["b", "--method", "bic"])
        self.assertEqual(run.command_for("z", None, case, "m", "j")[:2], ["z", "diagnose"])


if __name__ == "__main__":
    unittest.main()
