# SPDX-License-Identifier: Apache-2.0
"""Each hardship does to a record what it says, and nothing else."""
import unittest

import numpy as np

import cases
import effects
import hardships
import score
import suites


def record():
    n = 50
    columns = ["rate_x_deg_h", "reference_x_deg_h", "temperature_board_degC", "magnetic_x_uT", "magnetic_y_uT",
               "magnetic_z_uT", "acceleration_x_g", "acceleration_y_g"]
    out = {"time_s": np.arange(n)}
    out |= {name: np.linspace(0, 1, n) * (i + 1) for i, name in enumerate(columns)}
    out["rate_x_deg_h"][:5] = np.nan
    return out


def hidden(name, **shape):
    return cases.Hidden(effects.Effect(name, shape, None), 1.0, 10.0, "waveform")


class Afterwards(unittest.TestCase):
    def changed(self, name, what=(), seed=1):
        before = record()
        after = hardships.after(name, before, what, np.random.default_rng(seed))
        self.assertTrue(set(after) <= set(before))
        return before, after, [n for n in after if not np.array_equal(after[n], before[n], equal_nan=True)]

    def test_what_is_no_such_hardship_changes_nothing(self):
        for name in (None, "short", "mismatch"):
            before, after, changed = self.changed(name)
            self.assertEqual((set(after), changed), (set(before), []))

    def test_one_component_is_the_one_that_the_effect_acts_along(self):
        for seed in range(5):
            _, after, changed = self.changed("one_component", [hidden("magnetic", along=1)], seed)
            self.assertEqual(changed, [])
            self.assertEqual([n for n in after if n.startswith("magnetic")], ["magnetic_y_uT"])
            self.assertEqual(len([n for n in after if n.startswith("acceleration")]), 1)

    def test_wild_samples_are_one_to_three_valid_rates(self):
        for seed in range(10):
            before, after, changed = self.changed("wild_sample", seed=seed)
            self.assertEqual(changed, ["rate_x_deg_h"])
            off = np.abs(after["rate_x_deg_h"] - before["rate_x_deg_h"])
            self.assertTrue(1 <= np.count_nonzero(off > 5.0) <= 3)
            self.assertTrue(np.isnan(after["rate_x_deg_h"][:5]).all())

    def test_few_digits_are_multiples_of_a_step_of_rates_or_of_references(self):
        seen = set()
        for seed in range(10):
            _, after, changed = self.changed("few_digits", seed=seed)
            seen.update(changed)
            for name in changed:
                values = after[name][np.isfinite(after[name])]
                self.assertLess(len(set(values)), 50)
        self.assertEqual(seen, {"rate_x_deg_h", "reference_x_deg_h"})

    def test_without_a_reference_all_else_stays(self):
        before, after, changed = self.changed("no_reference")
        self.assertEqual((set(before) - set(after), changed), ({"reference_x_deg_h"}, []))


class Made(unittest.TestCase):
    def test_every_hardship_has_its_nulls_and_singles_and_every_rung_one(self):
        entries = suites.entries("hard_dev", 1_000_000)
        for name in hardships.NAMES:
            kinds = [kind for kind, _, hard in entries if hard["name"] == name]
            self.assertEqual((kinds.count("null"), kinds.count("single")), suites.HARD_SIZES)
        rungs = sorted((hard["share"], hard["distance"]) for _, _, hard in entries if hard["name"] == "mismatch")
        self.assertEqual(rungs, sorted(hardships.ladder()))

    def test_a_short_record_is_short_its_d_is_of_it_and_nothing_validates_it(self):
        entries = suites.entries("hard_dev", 1_000_000)
        index = next(i for i, (kind, _, hard) in enumerate(entries) if (kind, hard["name"]) == ("null", "short"))
        case = cases.make_case("hard_dev", 1_000_000, index)
        self.assertEqual(len(case.fit["time_s"]), case.truth["hardship"]["seconds"])
        self.assertIsNone(case.validation)

    def test_slow_records_go_through_few_temperatures_each(self):
        entries = suites.entries("hard_dev", 1_000_000)
        index = next(i for i, (kind, _, hard) in enumerate(entries) if (kind, hard["name"]) == ("null", "slow"))
        case = cases.make_case("hard_dev", 1_000_000, index)
        for record in (case.fit, case.validation):
            column = next(record[name] for name in record if name.startswith("temperature_"))
            self.assertLess(np.ptp(column[np.isfinite(column)]), 20.5)

    def test_a_form_that_differs_does_so_by_its_share_at_its_d(self):
        entries = suites.entries("hard_dev", 1_000_000)
        index = next(i for i, (_, _, hard) in enumerate(entries) if (hard.get("share"), hard.get("distance")) == (0.5, 30.0))
        truth = cases.make_case("hard_dev", 1_000_000, index).truth
        self.assertAlmostEqual(truth["effects"][0]["d"], 30.0, delta=0.1)
        self.assertEqual(truth["effects"][0]["shape"]["mismatch_share"], 0.5)

    def test_no_share_is_the_form_itself(self):
        rng = np.random.default_rng(3)
        case_rng = np.random.default_rng(4)
        specimen = cases.draw_specimen(case_rng, ["magnetic"])
        scene = cases.make_scene(specimen, case_rng, 0.0, 40.0, static=False, seconds=1200)
        effect = effects.draw("magnetic", rng, specimen.places)
        np.testing.assert_allclose(hardships.rough_form(effect, 0.0, rng).wave(scene, 2.0), effect.wave(scene, 2.0))


class Outcomes(unittest.TestCase):
    TRUTH = {"case": "case_000", "class": "single", "kind": "", "axis": "x", "recalibrated": [], "hardship": {"name": "short"},
             "effects": [{"name": "magnetic", "axis": "x", "d": 20.0, "removable": True}],
             "validation": {"before_rms_deg_h": 0.1, "oracle_rms_deg_h": 0.02}}

    def said(self, names=(), unknown=None, alternatives=()):
        named = [{"name": n, "probability": 0.6, "alternatives": [{"name": a, "probability": 0.4} for a in alternatives]}
                 for n in names]
        return score.Result(self.TRUTH, {"verdict": "x", "axis": {"x": {"effects": named, "unknown": unknown}}}, {})

    def test_each_answer_has_its_outcome(self):
        self.assertEqual(score.outcome(self.said(["magnetic"])), "right")
        self.assertEqual(score.outcome(self.said(["line"], alternatives=["magnetic"])), "in the set")
        self.assertEqual(score.outcome(self.said(["line"])), "wrong")
        self.assertEqual(score.outcome(self.said()), "nothing")
        self.assertEqual(score.outcome(self.said(unknown={"description": "?"})), "unknown")
        self.assertEqual(score.outcome(score.Result(self.TRUTH, None, {})), "failed")

    def test_the_table_counts_them_by_hardship(self):
        text = "\n".join(score.hardship_table([self.said(["magnetic"]), self.said(["line"])]))
        self.assertIn("| short | 0/0 | 1/2 | 0/2 | 0/2 | 0/2 | 1/2 | 0/2 |", text)


if __name__ == "__main__":
    unittest.main()
