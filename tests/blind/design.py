#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Scores `zerodrift design` on gyros of this generator: does its profile resolve what a poor record left ambiguous?

    design.py --zerodrift build/release/bin/zerodrift --seed 51001 --cases 24 [--jobs 2] [--table out.md]

A gyro with one hidden effect (d 8 to 40 on the poor record) gives a record of three hours as one is easily made: a single ramp,
turns about one oblique axis, or field, tilt, vibration and current switched together. Where `diagnose` leaves the hidden effect in a
set of several, or finds it and can't prove it, the case is ambiguous. `design` gets model, JSON and the limits of one chamber, and the
same gyro goes through what it writes, through each entry of a fixed menu, and through random blocks within the same limits, three hours
each. A case is resolved by an experiment where the set of the new record and the old set (and "nothing", if it was not proved) have
the hidden effect alone in common.
"""
import argparse
import concurrent.futures
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import cases
import effects
import generate
import gyro
import noise
import profiles
import score
import thermal

ROOT = pathlib.Path(__file__).resolve().parents[2]
SECONDS = 10800
LOW_DEGC, HIGH_DEGC = 2.0, 42.0
LIMITS = f"""duration_s: {SECONDS}
ambient_degc: 20
temperature: {{low_degc: {LOW_DEGC}, high_degc: {HIGH_DEGC}, ramp_degc_per_min: 2.5, soak_s: 720}}
rate_table: {{largest_deg_s: 10}}
magnetic: {{largest_ut: 250}}
tilt: {{largest_deg: 90}}
vibration: {{largest_g: 4}}
source_current: {{change_ma: 12}}
supply: {{change_v: 0.25}}
power: {{off_s: 180}}
"""
BY_TEMPERATURE = ["bias_temperature", "shupe", "coil_lag", "gradient", "gradient_rate", "hysteresis", "warm_up", "rate_ramp",
                  "temperature_step", "etalon_fringe", "shupe_temperature"]
BY_RATE = ["scale_factor_temperature", "scale_factor_nonlinearity", "scale_factor_asymmetry", "misalignment", "scale_factor"]
BY_SURROUNDINGS = ["magnetic", "acceleration_sensitivity", "vibration_rectification", "source_intensity"]
HIDEABLE = [name for name in BY_TEMPERATURE + BY_RATE + BY_SURROUNDINGS if name in effects.WAVEFORMS]
# A gyro that does nothing but show every input in its record: how a profile file becomes this generator's inputs.
WITNESS = """gyro: witness
nominal_rate_hz: 1
probes: [{name: chamber, node: chamber, rate_hz: 1}]
effects:
  - {kind: bias, axis: x, parameters: {bias_deg_h: 0}}
  - {kind: magnetic, axis: x, parameters: {x_deg_h_per_ut: 1e-9}}
  - {kind: acceleration_sensitivity, axis: x, parameters: {x_deg_h_per_g: 1e-9}}
  - {kind: vibration_rectification, axis: x, parameters: {coefficient_deg_h_per_g2: 1e-9}}
  - {kind: source_intensity, axis: x, parameters: {coefficient_deg_h_per_ma: 1e-9}}
"""


def inputs_from(air, rate, field, tilt, vibration, current, supply):
    """Inputs whose rates are means over seconds."""
    ends = np.vstack([rate[:1], 0.5 * (rate[1:] + rate[:-1]), rate[-1:]])
    since = np.zeros(len(air))
    count = 0.0
    for i, on in enumerate(supply > 0):
        count = count + 1.0 if on else 0.0
        since[i] = count if on else -1.0
    return profiles.Inputs(air, rate, ends, field, tilt, vibration, current, supply, since)


def still(n):
    flat = np.zeros((n, 3))
    flat[:, 2] = 1.0
    return [np.full(n, 20.0), np.zeros((n, 3)), np.zeros((n, 3)), flat, np.zeros(n), np.full(n, 100.0), np.full(n, 5.0)]


def poor_inputs(name, rng):
    """What an owner does at first."""
    parts = still(SECONDS)
    time = np.arange(SECONDS)
    parts[0] = np.interp(time, [0, 600, 6600], [LOW_DEGC + 5, LOW_DEGC + 5, HIGH_DEGC - 5])
    if name in BY_RATE:
        direction = np.array([1.0, 0.6, 0.4])
        parts[1] = np.outer(profiles.table_rate(rng, SECONDS, 1.0)[0], direction)
    if name in BY_SURROUNDINGS:
        level = profiles.block_levels(rng, SECONDS, 300, 900, lambda: rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0]))
        parts[2] = np.outer(150 * level, [1.0, 0.5, 0.3])
        angle = 0.5 * level
        parts[3] = np.column_stack([np.sin(angle), 0.4 * np.sin(angle), np.sqrt(1 - 1.16 * np.sin(angle)**2)])
        parts[4] = 2 * np.abs(level)
        parts[5] = 100 + 8 * level
    return inputs_from(*parts)


def cycles(ramp_degc_per_min, soak_s):
    times, values, up = [0.0], [LOW_DEGC], True
    while times[-1] < SECONDS:
        times.append(times[-1] + (HIGH_DEGC - LOW_DEGC) / ramp_degc_per_min * 60)
        values.append(HIGH_DEGC if up else LOW_DEGC)
        times.append(times[-1] + soak_s)
        values.append(values[-1])
        up = not up
    return np.interp(np.arange(SECONDS), times, values)


def fixed_menu(rng):
    """Experiments by name, made without a question in mind."""
    ramps, turning, blocks = still(SECONDS), still(SECONDS), profiles.draw_inputs(rng, LOW_DEGC, HIGH_DEGC, SECONDS)
    ramps[0] = cycles(2.5, 720)
    slow = list(ramps)
    slow[0] = cycles(0.6, 720)
    turning[0] = ramps[0]
    turning[1] = np.column_stack([profiles.table_rate(rng, SECONDS, 1.0)[0] for _ in range(3)])
    around = [np.full(SECONDS, 20.0), np.zeros((SECONDS, 3)), blocks.magnetic_ut, blocks.acceleration_g, blocks.vibration_g,
              blocks.current_ma, np.full(SECONDS, 5.0)]
    return {"fast ramps with soaks": inputs_from(*ramps), "slow ramps": inputs_from(*slow),
            "rate table while the temperature ramps": inputs_from(*turning),
            "blocks of surroundings at constant temperature": inputs_from(*around)}


def simulated_inputs(zerodrift, profile, folder):
    """A profile file as `simulate` runs it."""
    (folder / "witness.yaml").write_text(WITNESS)
    subprocess.run([zerodrift, "simulate", "--model", folder / "witness.yaml", "--profile", profile, "--rate", "1", "--reference",
                    "--duration", str(SECONDS), "--out", folder / "witness.csv"], check=True, stdout=subprocess.DEVNULL)
    with open(folder / "witness.csv") as text:
        rows = list(csv.DictReader(line for line in text if not line.startswith("#")))

    def column(name, absent=0.0):
        return np.array([float(row[name]) if row.get(name) else absent for row in rows])

    powered = np.array([bool(row["rate_x_rad_s"]) for row in rows])
    vectors = {name: np.column_stack([column(pattern % axis) for axis in "xyz"]) for name, pattern in
               (("rate", "reference_%s_rad_s"), ("field", "magnetic_%s_uT"), ("tilt", "acceleration_%s_m_s2"))}
    return inputs_from(column("temperature_chamber_degC"), np.degrees(vectors["rate"]) * 3600, vectors["field"],
                       vectors["tilt"] / 9.80665, column("vibration_g"), column("source_current_mA", 100.0),
                       np.where(powered, column("supply_V", 5.0), 0.0))


class Specimen:
    """A gyro with one hidden effect, and its factory model."""

    def __init__(self, name, rng):
        self.rng = rng
        self.gyro = cases.draw_specimen(rng, [name])
        self.gyro.static = False
        self.gyro.missing = set()
        scene = self.scene(poor_inputs(name, rng))
        levels = self.gyro.levels
        whitener = noise.Whitener(noise.density(levels, noise.cosine_frequencies(SECONDS)))
        cases.tame_misfit(self.gyro, scene, whitener)
        known = gyro.known_effects(self.gyro.base)
        columns = gyro.model_columns(known, scene, self.gyro.thermometers)
        self.hidden, _, _ = cases.size_all([name], self.gyro, scene, list(columns.values()), levels, rng)
        factory = cases.make_scene(self.gyro, rng, LOW_DEGC, HIGH_DEGC, static=False, second_power_on=False)
        values, errors = gyro.calibrate(self.gyro.base, known, factory, self.gyro.thermometers, levels, rng)
        self.model = {"format_version": 1, "gyro": "fibre-optic gyro", "gyro_id": "unit", "nominal_rate_hz": 1,
                      "probes": [{"name": t.name, "node": t.name, "rate_hz": 1.0 / t.every_s, "lag_s": round(t.lag_s, 2),
                                  "noise_degc": round(t.noise_degc, 4), "quantisation_degc": t.step_degc}
                                 for t in self.gyro.thermometers.values()],
                      "effects": cases.model_effects(cases.AXES[self.gyro.axis], known, values, errors,
                                                     cases.listed_levels(levels, rng), [])}
        self.poor = scene

    def scene(self, inputs):
        temperatures = thermal.solve(self.gyro.body, inputs.air_degc, inputs.powered)
        return effects.Scene(inputs, temperatures, self.rng, self.gyro.axis)

    def record(self, scene):
        rate, _, _ = cases.measured_rate(self.gyro, scene, self.hidden, self.rng)
        kept = np.ones(len(scene.inputs), dtype=bool)
        return generate.csv_text(cases.make_record(self.gyro, scene, {self.gyro.axis: rate}, {}, kept, self.rng), "unit")


def diagnosed(zerodrift, folder, record, name):
    """The axis of the JSON, or None."""
    (folder / f"{name}.csv").write_text(record)
    done = subprocess.run([zerodrift, "diagnose", "--model", folder / "model.yaml", "--record", folder / f"{name}.csv", "--json",
                           folder / f"{name}.json"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    (folder / f"{name}.csv").unlink()
    if done.returncode != 0:
        return None
    return next(iter(json.loads((folder / f"{name}.json").read_text())["axis"].values()))


def names_left(axis):
    """All that a diagnosis keeps possible, by name."""
    names = set()
    for effect in (axis["effects"] + axis["taken_back"]) if axis else []:
        names.add(score.canonical(effect["name"], effect.get("parameters")))
        names.update(score.canonical(other["name"], other.get("parameters")) for other in effect["alternatives"])
    if axis and (axis["taken_back"] or not names):
        names.add("nothing")
    return names


def one_case(job):
    """{effect, ambiguous, resolved by experiment}."""
    zerodrift, seed, index = job
    rng = np.random.default_rng([seed, index])
    name = HIDEABLE[index % len(HIDEABLE)]
    for _ in range(50):
        try:
            specimen = Specimen(name, rng)
            break
        except cases.Redraw:
            continue
    else:
        return {"effect": name, "ambiguous": False, "why": "no draw fits"}
    result = {"effect": name, "d": round(specimen.hidden[0].distance, 1), "ambiguous": False}
    with tempfile.TemporaryDirectory() as text:
        folder = pathlib.Path(text)
        (folder / "model.yaml").write_text(generate.yaml_text(specimen.model))
        (folder / "limits.yaml").write_text(LIMITS)
        left = names_left(diagnosed(zerodrift, folder, specimen.record(specimen.poor), "poor"))
        result["left"] = sorted(left)
        if name not in left or len(left) < 2:
            return result
        done = subprocess.run([zerodrift, "design", "--model", folder / "model.yaml", "--diagnosis", folder / "poor.json",
                               "--limits", folder / "limits.yaml", "--out", folder / "designed.yaml", "--replicates", "0"],
                              capture_output=True, text=True)
        result["design"] = (done.stdout + done.stderr).strip().splitlines()
        result["ambiguous"] = True
        experiments = fixed_menu(np.random.default_rng(seed))
        experiments["shipped diagnosis_chamber, its first three hours"] = simulated_inputs(
            zerodrift, ROOT / "config/profiles/diagnosis_chamber.yaml", folder)
        experiments["random"] = profiles.draw_inputs(rng, LOW_DEGC, HIGH_DEGC, SECONDS)
        if (folder / "designed.yaml").exists():
            experiments["designed"] = simulated_inputs(zerodrift, folder / "designed.yaml", folder)
        result["sets"] = {}
        for what, inputs in experiments.items():
            axis = diagnosed(zerodrift, folder, specimen.record(specimen.scene(inputs)), "again")
            result["sets"][what] = sorted(names_left(axis))
        result["resolved"] = {what: left & set(names) == {name} for what, names in result["sets"].items()}
        result["resolved"].setdefault("designed", False)
    return result


def table_of(results):
    """Markdown."""
    ambiguous = [r for r in results if r["ambiguous"]]
    lines = [f"{len(results)} gyros, {len(ambiguous)} ambiguous after the poor record.", "",
             "| experiment | resolved | 95 % interval |", "|---|---|---|"]
    names = sorted({what for r in ambiguous for what in r["resolved"]})
    for what in names:
        hits = sum(r["resolved"].get(what, False) for r in ambiguous)
        low, high = score.wilson(hits, len(ambiguous))
        lines.append(f"| {what} | {hits}/{len(ambiguous)} | {low:.2f} to {high:.2f} |")
    return "\n".join(lines) + "\n"


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--zerodrift", required=True)
    parser.add_argument("--seed", required=True, type=int)
    parser.add_argument("--cases", required=True, type=int, help="gyros that are drawn, one hidden effect after the other")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--table", help="file for the table")
    parser.add_argument("--json", help="file for every case")
    options = parser.parse_args(argv)
    program = str(pathlib.Path(options.zerodrift).resolve())
    results = []
    with concurrent.futures.ProcessPoolExecutor(max_workers=options.jobs) as pool:
        for result in pool.map(one_case, [(program, options.seed, i) for i in range(options.cases)]):
            print(json.dumps(result), file=sys.stderr, flush=True)
            results.append(result)
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(results, indent=1) + "\n")
    score.put_table(table_of(results), options.table)


if __name__ == "__main__":
    main()
