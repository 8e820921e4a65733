# SPDX-License-Identifier: Apache-2.0
"""The comparison of priors on residuals that are known by hand, and what keeps its record unseen."""
import pathlib
import sys
import tempfile
import unittest

import numpy as np

import effects
import prior


def truth(kind="single", names=("shupe",), removable=True):
    return {"case": "case_000", "class": kind, "axis": "x",
            "effects": [{"name": n, "axis": "x", "d": 20.0, "removable": removable} for n in names]}


def row(repaired=0.5, names=("shupe",), right=True, same=False, **more):
    levels = {"raw": 4.0, "persistence": 2.0, "none": 1.25, "factory": 1.0, "repaired": repaired, "minutes": 100}
    return {"case": "case_000", "class": "single", "hidden": [[n, 20.0] for n in names], "said": "shupe",
            "right": right, "same": same, "note": "", "rms": {"all": levels, "slow": levels}, **more}


def cells_of(lines, title):
    line = next(line for line in lines if line.startswith(f"| {title} |"))
    return [cell.strip() for cell in line.strip("|").split("|")]


class Unseen(unittest.TestCase):
    def test_diagnose_is_given_neither_the_validation_record_nor_the_truth(self):
        command = prior.diagnose_command("zerodrift", pathlib.Path("cases/case_000"), "m.yaml", "d.json")
        self.assertNotIn("validation", " ".join(command))
        self.assertNotIn("truth", " ".join(command))
        self.assertIn("cases/case_000/record.csv", command)

    def test_compensation_sees_the_validation_record_alone(self):
        command = prior.compensate_command("zerodrift", pathlib.Path("cases/case_000"), "c.yaml", "m.yaml", "o.csv")
        self.assertIn("cases/case_000/validation.csv", command)
        self.assertNotIn("/record.csv", " ".join(command))
        self.assertNotIn("--prior", prior.compensate_command("z", pathlib.Path("c"), "c.yaml", None, "o.csv"))

    def test_only_what_a_twin_could_predict_is_compared(self):
        self.assertTrue(prior.is_wanted(truth()))
        self.assertTrue(prior.is_wanted(truth("double", ("shupe", "magnetic"))))
        self.assertFalse(prior.is_wanted(truth("single", ("markov",), removable=False)))
        self.assertFalse(prior.is_wanted(truth("null", ())))
        self.assertFalse(prior.is_wanted(truth("unknown", ("bump",))))

    def test_effects_of_a_prior_are_ones_that_can_be_hidden(self):
        self.assertLessEqual(prior.HELD_BY_A_PRIOR, set(effects.HIDEABLE))


class Delay(unittest.TestCase):
    def test_labels_take_effect_ten_minutes_after_their_end_and_all_of_them_find_room(self):
        self.assertEqual(prior.CONFIRM_S + prior.HANDOVER_S, prior.LABEL_DELAY_S)
        # the compensation keeps 64 on their way
        self.assertLess(prior.LABEL_DELAY_S / prior.LABEL_INTERVAL_S + 1, 64)

    def test_configuration_names_the_probes_of_the_record(self):
        columns = ["time_s", "rate_x_deg_h", "temperature_coil_outer_degC", "temperature_board_degC", "supply_V"]
        text = prior.config_text(prior.probes_of(columns))
        self.assertIn("{kind: temperature, probe: coil_outer}", text)
        self.assertIn("probes: [coil_outer, board]", text)
        self.assertIn("handover_s: 595", text)

    def test_what_is_held_is_the_newest_minute_that_ended_ten_minutes_before(self):
        labels = np.arange(30.0)
        labels[5] = np.nan
        held = prior.held_minutes(labels)
        self.assertTrue(np.all(np.isnan(held[:11])))
        # minute 11 begins at 660 s, minute 0 ended at 60 s
        self.assertEqual(held[11], 0.0)
        self.assertEqual(held[29], 18.0)
        self.assertEqual(held[16], 4.0)  # minute 5 says nothing: the one before stays


class Residuals(unittest.TestCase):
    TIME_S = 155.0 + np.arange(3600.0)  # an hour that begins anywhere

    def test_minutes_are_means_of_what_is_measured_and_blank_below_half(self):
        values = np.repeat(np.arange(60.0), 60)
        values[60:91] = np.nan   # 29 samples left
        values[120:150] = np.nan  # 30 left
        means = prior.minute_means(self.TIME_S, values)
        self.assertEqual(len(means), 60)
        self.assertTrue(np.isnan(means[1]))
        np.testing.assert_array_equal(means[[0, 2, 59]], [0.0, 2.0, 59.0])

    def test_missing_rows_shift_no_minute(self):
        kept = np.ones(3600, dtype=bool)
        kept[70:90] = False
        means = prior.minute_means(self.TIME_S[kept], np.repeat(np.arange(60.0), 60)[kept])
        np.testing.assert_array_equal(means, np.arange(60.0))

    def test_a_constant_drift_is_held_and_a_ramp_lags_by_eleven_minutes(self):
        zero = np.zeros(3600)
        held = prior.residuals(self.TIME_S, zero + 2.0, zero, {"none": zero + 0.5})["all"]
        self.assertEqual((held["raw"], held["persistence"], held["none"]), (2.0, 0.0, 0.5))
        self.assertEqual(held["minutes"], 40)  # of an hour, the first twenty not judged
        ramp = np.repeat(np.arange(60.0), 60)
        self.assertAlmostEqual(prior.residuals(self.TIME_S, ramp, zero, {})["all"]["persistence"], 11.0, places=12)

    def test_true_rate_is_no_residual_and_no_reference_means_no_rate(self):
        turn = np.where(np.arange(3600) % 600 < 300, 50.0, 0.0)
        found = prior.residuals(self.TIME_S, turn + 1.0, turn, {"none": turn + 0.25})["all"]
        self.assertEqual((found["raw"], found["none"]), (1.0, 0.25))
        unknown = np.full(3600, np.nan)
        self.assertEqual(prior.residuals(self.TIME_S, np.ones(3600), unknown, {})["slow"]["raw"], 1.0)

    def test_what_fast_turns_do_counts_at_all_rates_only(self):
        fast = np.where(np.arange(3600) >= 3000, 36000.0, 0.0)  # ten minutes
        error = np.where(fast > 0, 3.0, 0.0)                    # of the scale factor
        found = prior.residuals(self.TIME_S, fast + error, fast, {"none": fast + error})
        self.assertEqual(found["slow"]["none"], 0.0)
        self.assertEqual(found["slow"]["minutes"], 30)
        self.assertAlmostEqual(found["all"]["none"], 3.0 * np.sqrt(10 / 40), places=12)

    def test_columns_are_read_by_name_with_blanks_as_unknown(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "r.csv"
            path.write_text("# gyro_id: u\ntime_s,mode_x,rate_x_deg_h\n0,frozen,1.5\n1,frozen,\n")
            read = prior.read_columns(path, ["time_s", "rate_x_deg_h", "reference_x_deg_h"])
        np.testing.assert_array_equal(read["rate_x_deg_h"], [1.5, np.nan])
        self.assertTrue(np.all(np.isnan(read["reference_x_deg_h"])))


class OneCase(unittest.TestCase):
    """With a stand-in for the program, which takes 0.5 deg/h off with a prior and none without."""
    PROGRAM = """#!{python}
import csv, pathlib, sys
words = dict(zip(sys.argv[2::2], sys.argv[3::2]))
if sys.argv[1] == "diagnose":
    {diagnose}
    sys.exit(0)
if "refused" in pathlib.Path(words.get("--prior", "/dev/null")).read_text():
    sys.exit(2)
off = 0.5 if "--prior" in words else 0.0
rows = list(csv.reader(open(words["--record"])))[1:]
pathlib.Path(words["--out"]).write_text("time_s,rate_x_rad_s\\n" + "".join(
    f"{{row[0]}},{{(float(row[1]) - off) / {factor}!r}}\\n" for row in rows))
"""

    def run_with(self, diagnose):
        with tempfile.TemporaryDirectory() as folder:
            case, work = pathlib.Path(folder) / "case", pathlib.Path(folder) / "work"
            case.mkdir(), work.mkdir()
            program = pathlib.Path(folder) / "program"
            program.write_text(self.PROGRAM.format(python=sys.executable, diagnose=diagnose,
                                                   factor=prior.DEG_H_PER_RAD_S))
            program.chmod(0o700)
            (case / "model.yaml").write_text("factory")
            rows = "".join(f"{t},2.0,20.0\n" for t in range(3600))
            (case / "validation.csv").write_text("time_s,rate_x_deg_h,temperature_board_degC\n" + rows)
            return prior.run_case({"program": str(program), "timeout_s": 20.0}, truth(), case, work)

    def test_without_an_answer_of_diagnose_the_factorys_model_stays(self):
        found = self.run_with("pass")
        self.assertEqual((found["said"], found["right"], found["same"]), (prior.NO_RESULT, False, True))
        self.assertAlmostEqual(found["rms"]["slow"]["none"], 2.0, places=9)  # 1e-16 rad/s are 2e-11 deg/h
        self.assertAlmostEqual(found["rms"]["slow"]["repaired"], 1.5, places=9)

    def test_a_repaired_model_that_is_refused_leaves_the_factorys_and_says_so(self):
        found = self.run_with('pathlib.Path(words["--out-model"]).write_text("refused")')
        self.assertIn("refused", found["note"])
        self.assertEqual(prior.ratio(found, "slow", "factory"), 1.0)

    def test_a_run_without_a_record_fails_the_case(self):
        found = self.run_with('pathlib.Path(words["--model"]).write_text("refused")')
        self.assertEqual(found["failed"], "factory, repaired")


class Table(unittest.TestCase):
    ROWS = [row(0.5), row(1.0, same=True, right=False), row(1.06, right=False), row(0.96), row(0.9, ("magnetic",))]

    def test_counts_what_fell_and_rose_by_more_than_a_twentieth(self):
        cells = cells_of(prior.ratio_rows(self.ROWS, "all"), "all cases")
        self.assertEqual(cells[1], "5")
        self.assertTrue(cells[2].startswith("0.960"))  # nothing found counts with 1
        self.assertEqual(cells[5:], ["2", "1"])

    def test_ratios_are_against_the_factory_no_prior_and_persistence(self):
        cells = cells_of(prior.ratio_rows([row(0.5)], "slow"), "all cases")
        self.assertEqual([cell.split()[0] for cell in cells[2:5]], ["0.500", "0.400", "0.250"])

    def test_groups_tell_names_found_and_what_a_prior_can_hold(self):
        lines = prior.ratio_rows(self.ROWS, "all")
        counts = {title: cells_of(lines, title)[1] for title, _ in prior.GROUPS}
        self.assertEqual(counts["something hidden that temperature or time drives"], "4")
        self.assertEqual(counts["... the right name found"], "2")
        self.assertEqual(counts["... not"], "2")
        self.assertEqual(counts["nothing hidden that a prior can hold"], "1")
        self.assertEqual(counts["the repaired prior another one than the factory's"], "4")

    def test_a_failed_case_is_told_and_left_out(self):
        text = prior.table_text(self.ROWS + [{**row(), "failed": "none"}])
        self.assertIn("6 cases, 1 of them failed", text)
        self.assertIn("failed: none", text)
        self.assertIn("| all cases | 5 |", text)


if __name__ == "__main__":
    unittest.main()
