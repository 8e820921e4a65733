#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Known effects in real records: real noise and real drift that nobody made, and a truth all the same.

    real.py --diagnose PATH_TO_zerodrift --seed S [--rounds 1] [--jobs 2] [--data ../shared/data] [--table out.md]

Each record is diagnosed as it is, and with one effect added at a drawn strength. An effect counts as found where it is
named in the record that has it, and as made up where it is named in the record as it is. Models list kinds alone: nobody
knows these gyros. Exit code 0 with one line where the records are missing.
"""
import argparse
import concurrent.futures
import csv
import json
import lzma
import os
import pathlib
import sys
import tempfile
from dataclasses import dataclass

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import effects
import generate
import noise
import run
import score
import thermal

LSB_DEG_H = 0.05 * 3600
RAD_S_DEG_H = np.degrees(1.0) * 3600
KINDS = ["bias", "angle_random_walk", "bias_instability", "rate_random_walk"]


@dataclass
class Record:
    """A rate a second, deg/h, and a temperature a second or nothing."""
    name: str
    rate: np.ndarray
    temperature: np.ndarray = None


def second_means(values, per_second):
    n = len(values) // per_second * per_second
    return values[:n].reshape(-1, per_second).mean(axis=1)


def static_records(folder):
    """Three MEMS gyros of a unit at rest, 2 h 47 min, three times; no temperature."""
    for path in sorted((folder / "adis16405_static").glob("adis16405_run*.csv.xz")):
        with lzma.open(path, "rt") as text:
            values = np.loadtxt(text, delimiter=",", skiprows=1)
        for axis in range(3):
            yield Record(f"{path.name.split('.')[0]}_{'xyz'[axis]}", LSB_DEG_H * second_means(values[:, axis], 100))


def chamber_records(folder):
    """A MEMS unit through 52, -18, 74 and 34 °C; a row counts as a second, as its README infers."""
    path = folder / "imu_thermal_chamber" / "imu_thermal.csv"
    if not path.exists():
        return
    with open(path, newline="") as text:
        rows = list(csv.DictReader(text))[1:]
    temperature = np.array([float(row["temp_c"]) for row in rows])
    for axis in "xyz":
        rate = np.array([float(row[f"gyro_{axis}"]) for row in rows]) * RAD_S_DEG_H
        yield Record(f"chamber_{axis}", rate, temperature)


# --- what is added: a wave of unit size, from time and temperature -----------------------------------------------

def line(record, rng):
    frequency = 10**rng.uniform(np.log10(0.01), np.log10(0.3))
    return np.sin(2 * np.pi * frequency * np.arange(len(record.rate)) + rng.uniform(0, 2 * np.pi))


def rate_ramp(record, rng):
    tau_s = 3600 * rng.uniform(4, 20)
    return -np.expm1(-np.arange(len(record.rate)) / tau_s)


def telegraph(record, rng):
    dwell_s = 10**rng.uniform(np.log10(200), np.log10(600))
    return effects.switching(rng, len(record.rate), dwell_s, dwell_s)


def etalon_fringe(record, rng):
    period = rng.uniform(4, 12)
    return np.cos(2 * np.pi * record.temperature / period + rng.uniform(0, 2 * np.pi))


def temperature_step(record, rng):
    at = rng.uniform(*np.quantile(record.temperature, [0.25, 0.75]))
    return 1 / (1 + np.exp(-np.clip((record.temperature - at) / 0.1, -50, 50)))


def shupe(record, rng):
    smooth = thermal.first_order_lag(record.temperature, 20.0)
    return np.gradient(smooth) * 60


WITHOUT_TEMPERATURE = {"line": line, "rate_ramp": rate_ramp, "telegraph": telegraph, "spikes": None}
WITH_TEMPERATURE = {"line": line, "etalon_fringe": etalon_fringe, "temperature_step": temperature_step, "shupe": shupe,
                    "spikes": None}


def smoothed_variance(values, columns):
    """Of each cosine, by third octaves, of what the columns leave."""
    design = np.column_stack([np.ones(len(values)), *columns])
    rest = values - design @ np.linalg.lstsq(design, values, rcond=None)[0]
    power = noise.cosine_transform(rest)[1:]**2
    edges = np.unique(np.round(2**np.arange(0, np.log2(len(power)) + 1 / 3, 1 / 3)).astype(int)) - 1
    edges = np.append(edges[edges < len(power)], len(power))
    means = np.add.reduceat(power, edges[:-1]) / np.diff(edges)
    return np.repeat(means, np.diff(edges))


def polynomial_columns(record):
    if record.temperature is None:
        return []
    u = (record.temperature - record.temperature.mean()) / record.temperature.std()
    return [u, u**2, u**3]


def inject(record, name, distance, rng):
    """The rate with the effect at d, beside the model's own columns and under the record's own noise."""
    columns = polynomial_columns(record)
    if name == "spikes":
        white = np.std(np.diff(record.rate)) / np.sqrt(2)
        rate = record.rate.copy()
        at = rng.choice(len(rate), int(rng.integers(5, 25)), replace=False)
        rate[at] += rng.choice([-1, 1], at.size) * (6 + rng.exponential(distance / 8, at.size)) * white
        return rate
    wave = (WITH_TEMPERATURE if record.temperature is not None else WITHOUT_TEMPERATURE)[name](record, rng)
    whitener = noise.Whitener(smoothed_variance(record.rate, columns))
    return record.rate + wave * distance / whitener.distance(wave, whitener.basis(columns))


def write_case(folder, record, rate):
    """Record and model of kinds alone."""
    columns = {"time_s": np.arange(len(rate), dtype=float), "rate_x_deg_h": rate}
    model = {"format_version": 1, "gyro": "MEMS gyro", "gyro_id": record.name, "nominal_rate_hz": 1, "probes": []}
    listed = [{"kind": kind, "axis": "x"} for kind in KINDS]
    if record.temperature is not None:
        columns["temperature_board_degC"] = record.temperature
        model["probes"] = [{"name": "board", "node": "board", "rate_hz": 1, "lag_s": 0, "noise_degc": 0.02,
                            "quantisation_degc": 0.001}]
        listed.append({"kind": "bias_temperature", "axis": "x", "inputs": ["board"]})
    folder.mkdir(parents=True)
    (folder / "record.csv").write_text(generate.csv_text(columns, 1))
    (folder / "model.yaml").write_text(generate.yaml_text({**model, "effects": listed}))


@dataclass
class Said:
    record: str
    injected: str   # "" of the record as it is
    distance: float
    finding: object


def one(job):
    program, work, record, name, distance, seed = job
    rng = np.random.default_rng(seed)
    folder = pathlib.Path(work) / f"{record.name}_{name or 'as_it_is'}_{distance:.1f}"
    write_case(folder, record, inject(record, name, distance, rng) if name else record.rate)
    answer = folder / "answer.json"
    run.run_bounded([program, "diagnose", "--model", str(folder / "model.yaml"), "--record", str(folder / "record.csv"),
                     "--json", str(answer)], folder / "log", 120.0)
    said = score.read_json(answer)
    (folder / "record.csv").unlink()
    axis = ((said or {}).get("axis") or {}).get("x")
    return Said(record.name, name, distance, score.Finding(axis) if axis is not None else None)


def table(answers):
    plain = {a.record: a.finding for a in answers if not a.injected}
    failed = sum(a.finding is None for a in answers)
    out = [f"{len(answers)} records, {failed} without a readable result.", "",
           "| effect | named where it is | ... or in a set | named where it is not |", "|---|---|---|---|"]
    for name in sorted({a.injected for a in answers if a.injected}):
        mine = [a for a in answers if a.injected == name and a.finding]
        others = [plain[record] for record in {a.record for a in mine} if plain.get(record)]
        found = sum(name in a.finding.names for a in mine)
        in_set = sum(a.finding.in_set(name) for a in mine)
        made_up = sum(name in finding.names for finding in others)
        out.append(f"| {name} | {found}/{len(mine)} | {in_set}/{len(mine)} | {made_up}/{len(others)} |")
    out += ["", "Each:", ""]
    for a in answers:
        said = a.finding.label() if a.finding else "no result"
        hidden = f"{a.injected} (d {a.distance:.1f})" if a.injected else "as it is"
        out.append(f"- {a.record}, {hidden}: {said}")
    return "\n".join(out) + "\n"


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--diagnose", required=True, help="the program")
    parser.add_argument("--seed", required=True, type=int)
    parser.add_argument("--rounds", type=int, default=1, help="strengths of each effect in each record")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--data", default=str(pathlib.Path(__file__).resolve().parents[3] / "shared" / "data"))
    parser.add_argument("--table", help="also write the table here")
    options = parser.parse_args(argv)
    records = [*static_records(pathlib.Path(options.data)), *chamber_records(pathlib.Path(options.data))]
    if not records:
        print(f"skipped: no records in {options.data}")
        return 0
    rng = np.random.default_rng(options.seed)
    with tempfile.TemporaryDirectory(prefix="real_") as work:
        program = str(pathlib.Path(options.diagnose).resolve())
        jobs = []
        for record in records:
            jobs.append((program, work, record, "", 0.0, 0))
            for name in WITH_TEMPERATURE if record.temperature is not None else WITHOUT_TEMPERATURE:
                for _ in range(options.rounds):
                    distance = float(np.exp(rng.uniform(*np.log((12.0, 60.0)))))
                    jobs.append((program, work, record, name, distance, int(rng.integers(2**62))))
        with concurrent.futures.ProcessPoolExecutor(max_workers=options.jobs) as pool:
            answers = list(pool.map(one, jobs))
    score.put_table(table(answers), options.table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
