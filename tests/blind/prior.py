#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What a repaired model is worth as the prior of the compensation, on a record that took no part in the repair.

    prior.py --zerodrift PATH --suite dev --seed S [--only 0:60] [--jobs 1] [--table out.md] [--json out.json]

Each case of class single or double whose hidden effects a twin could predict: `diagnose` sees record.csv alone (it
proves its repair on blocks of it), then `compensate` runs on validation.csv without a prior, with the factory's model
and with the repaired one, what it learns being 600 s old. The truth chooses the cases and labels the rows, nothing
else: neither program is given it.
"""
import argparse
import concurrent.futures
import csv
import json
import os
import pathlib
import shutil
import sys
import tempfile

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import generate
import run
import score
import suites

# A label takes effect CONFIRM_S + HANDOVER_S after its end. The compensation keeps at most 64 labels on their way:
# with the default interval of 5 s it would skip half of them.
LABEL_DELAY_S = 600.0
CONFIRM_S = 5.0
HANDOVER_S = LABEL_DELAY_S - CONFIRM_S
LABEL_INTERVAL_S = 20.0

MINUTE_S = 60
FEWEST_SAMPLES = 30            # of a minute's mean, as the generator has it (cases.minute_rms)
JUDGED_FROM_S = 1200.0         # the delay, and ten minutes for an initial set of labels
SLOW_DEG_H = 360.0             # nothing is learned above (common/compensation: kLargestReferenceRadps)
DEG_H_PER_RAD_S = 180 / np.pi * 3600
CHANGED = 0.05
NO_RESULT = "no result"
RATES = ("all", "slow")
RUNS = ("none", "factory", "repaired")
# What `compensate --prior` can take part of: driven by temperatures and the time since power-on alone.
HELD_BY_A_PRIOR = {"bias_temperature", "shupe", "coil_lag", "gradient", "gradient_rate", "shupe_temperature",
                   "sensor_lag", "hysteresis", "warm_up", "rate_ramp", "temperature_step", "etalon_fringe"}


# --- what is run --------------------------------------------------------------------------------------------

def is_wanted(truth):
    """Single or double, and a twin that knows all of it predicts it on an unseen record."""
    return truth["class"] in ("single", "double") and all(e["removable"] for e in truth["effects"])


def probes_of(columns):
    return [c.removeprefix("temperature_").removesuffix("_degC") for c in columns if c.startswith("temperature_")]


def config_text(probes):
    """The defaults but for the probe's name, the labels' length and their delay."""
    return (f"features:\n  - {{kind: temperature, probe: {probes[0]}}}\n"
            f"  - {{kind: temperature_rate, probe: {probes[0]}}}\n"
            f"probes: [{', '.join(probes)}]\n"
            f"learning: {{label_interval_s: {LABEL_INTERVAL_S:g}, confirm_s: {CONFIRM_S:g}, "
            f"handover_s: {HANDOVER_S:g}}}\n")


def diagnose_command(program, case, out_model, out_json):
    """Without --validate: the validation record is what the compensation is judged on."""
    return [program, "diagnose", "--model", str(case / "model.yaml"), "--record", str(case / "record.csv"),
            "--out-model", str(out_model), "--json", str(out_json)]


def compensate_command(program, case, config, prior, out):
    command = [program, "compensate", "--record", str(case / "validation.csv"), "--config", str(config),
               "--scheme", "online-svr", "--out", str(out)]
    return command + (["--prior", str(prior)] if prior else [])


# --- what is measured ---------------------------------------------------------------------------------------

def read_columns(path, names):
    """Columns by name; blank, or a column that isn't there: NaN."""
    with open(path, newline="") as file:
        rows = csv.reader(line for line in file if not line.startswith("#"))
        header = next(rows)
        at = {name: header.index(name) for name in names if name in header}
        cells = [[row[i] for i in at.values()] for row in rows]
    found = {name: np.array([float(row[k]) if row[k] else np.nan for row in cells]) for k, name in enumerate(at)}
    return {name: found.get(name, np.full(len(cells), np.nan)) for name in names}


def minute_means(time_s, values):
    """Means of the whole minutes since the first time; NaN where fewer than FEWEST_SAMPLES are finite."""
    minute = ((time_s - time_s[0]) // MINUTE_S).astype(int)
    finite = np.isfinite(values)
    count = np.bincount(minute[finite], minlength=minute[-1] + 1)
    total = np.bincount(minute[finite], weights=values[finite], minlength=minute[-1] + 1)
    means = np.full(len(count), np.nan)
    np.divide(total, count, out=means, where=count >= FEWEST_SAMPLES)
    return means[:int(time_s[-1] - time_s[0] + 1) // MINUTE_S]


def held_minutes(labels):
    """For each minute the newest label that ended LABEL_DELAY_S before it began; NaN where there was none yet."""
    held = np.full(len(labels), np.nan)
    delay = int(LABEL_DELAY_S // MINUTE_S) + 1
    for k in range(delay, len(labels)):
        newest = labels[k - delay]
        held[k] = newest if np.isfinite(newest) else held[k - 1]
    return held


def rms(values):
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else None


def residuals(time_s, rate_deg_h, reference_deg_h, compensated_deg_h):
    """RMS of minute means in deg/h by kind of rate and by what was taken off; every one of the same minutes.

    compensated_deg_h: by run. `slow` leaves out the samples in faster turns than are learned from.
    """
    reference = np.where(np.isfinite(reference_deg_h), reference_deg_h, 0.0)
    is_slow = np.abs(reference) <= SLOW_DEG_H
    held = held_minutes(minute_means(time_s, np.where(is_slow, rate_deg_h - reference, np.nan)))
    late = np.arange(len(held)) * MINUTE_S >= JUDGED_FROM_S
    out = {}
    for kind in RATES:
        counts = is_slow if kind == "slow" else np.full(len(time_s), True)
        means = {name: minute_means(time_s, np.where(counts, rate - reference, np.nan))
                 for name, rate in {"raw": rate_deg_h, **compensated_deg_h}.items()}
        means["persistence"] = means["raw"] - held
        judged = late & np.all([np.isfinite(m) for m in means.values()], axis=0)
        out[kind] = {name: rms(m[judged]) for name, m in means.items()}
        out[kind]["minutes"] = int(np.count_nonzero(judged))
    return out


def measured(case, axis, outputs):
    """residuals() from the validation record and what `compensate` wrote of it, by run."""
    rate, reference = f"rate_{axis}_deg_h", f"reference_{axis}_deg_h"
    record = read_columns(case / "validation.csv", ["time_s", rate, reference])
    compensated = {}
    for name, path in outputs.items():
        columns = read_columns(path, ["time_s", f"rate_{axis}_rad_s"])
        if not np.allclose(columns["time_s"], record["time_s"], rtol=0, atol=1e-6):
            raise ValueError(f"{path}: other times than the record's")
        compensated[name] = columns[f"rate_{axis}_rad_s"] * DEG_H_PER_RAD_S
    return residuals(record["time_s"], record[rate], record[reference], compensated)


# --- one case -----------------------------------------------------------------------------------------------

def compensated_with(options, case, work, name, prior):
    """Path of the compensated record, or None where the program gave none."""
    out = work / f"{name}.csv"
    command = compensate_command(options["program"], case, work / "compensation.yaml", prior, out)
    ran = run.run_bounded(command, work / f"{name}.log", options["timeout_s"])
    return out if ran["exit_code"] == 0 and out.exists() else None


def run_case(options, truth, case, work):
    """Diagnoses and compensates; the row of the table, with `failed` where there is nothing to compare."""
    answer, repaired = work / "diagnosis.json", work / "repaired.yaml"
    run.run_bounded(diagnose_command(options["program"], case, repaired, answer), work / "diagnose.log",
                    options["timeout_s"])
    result = score.Result(truth, score.read_json(answer), None)
    row = {"case": truth["case"], "class": truth["class"], "hidden": [[e["name"], e["d"]] for e in truth["effects"]],
           "said": NO_RESULT if result.failed else result.main.label(), "right": score.is_right(result),
           "note": ""}
    header = header_of(case / "validation.csv")
    (work / "compensation.yaml").write_text(config_text(probes_of(header)))
    priors = {"none": None, "factory": case / "model.yaml",
              "repaired": repaired if repaired.exists() else case / "model.yaml"}
    outputs = {name: compensated_with(options, case, work, name, prior) for name, prior in priors.items()}
    if outputs["repaired"] is None and outputs["factory"] is not None:
        row["note"] = "repaired model refused as a prior, the factory's stays"
        outputs["repaired"] = outputs["factory"]
    if any(path is None for path in outputs.values()):
        return {**row, "failed": ", ".join(name for name, path in outputs.items() if path is None)}
    row["same"] = outputs["repaired"].read_bytes() == outputs["factory"].read_bytes()
    return {**row, "rms": measured(case, truth["axis"], outputs)}


def header_of(path):
    with open(path) as file:
        return next(line for line in file if not line.startswith("#")).strip().split(",")


def one_case(job):
    """In a worker process; None for a case that is not wanted."""
    options, index = job
    folder = pathlib.Path(options["work"])
    name = generate.write_case(options["suite"], options["seed"], index, folder / "cases", folder / "truth")
    case, work = folder / "cases" / name, folder / "work" / name
    try:
        truth = json.loads((folder / "truth" / f"{name}.json").read_text())
        if not is_wanted(truth):
            return None
        work.mkdir(parents=True)
        return run_case(options, truth, case, work)
    finally:
        shutil.rmtree(case)
        shutil.rmtree(work, ignore_errors=True)


def run_suite(options, indices, jobs):
    rows = []
    with concurrent.futures.ProcessPoolExecutor(max_workers=jobs) as pool:
        for row in pool.map(one_case, [(options, index) for index in indices]):
            if row is None:
                continue
            rows.append(row)
            print(f"{row['case']}: " + (f"failed ({row['failed']})" if "failed" in row else
                                        f"repaired/factory {ratio(row, 'slow', 'factory'):.3f}"), file=sys.stderr)
    return rows


# --- the table ----------------------------------------------------------------------------------------------

def ratio(row, kind, against):
    return row["rms"][kind]["repaired"] / row["rms"][kind][against]


def quartiles(values):
    return tuple(float(q) for q in np.percentile(values, [50, 25, 75]))


def is_held_by_a_prior(row):
    return any(name in HELD_BY_A_PRIOR for name, _ in row["hidden"])


GROUPS = [("all cases", lambda row: True),
          ("something hidden that temperature or time drives", is_held_by_a_prior),
          ("... the right name found", lambda row: is_held_by_a_prior(row) and row["right"]),
          ("... not", lambda row: is_held_by_a_prior(row) and not row["right"]),
          ("nothing hidden that a prior can hold", lambda row: not is_held_by_a_prior(row)),
          ("the right name found", lambda row: row["right"]),
          ("not", lambda row: not row["right"]),
          ("the repaired prior another one than the factory's", lambda row: not row["same"])]


def ratio_rows(rows, kind):
    lines = []
    for title, belongs in GROUPS:
        group = [row for row in rows if belongs(row)]
        if not group:
            lines.append(f"| {title} | 0 | | | | | |")
            continue
        cells = []
        for against in ("factory", "none", "persistence"):
            middle, low, high = quartiles([ratio(row, kind, against) for row in group])
            cells.append(f"{middle:.3f} ({low:.3f} to {high:.3f})")
        changes = [ratio(row, kind, "factory") for row in group]
        fell = sum(change < 1 - CHANGED for change in changes)
        rose = sum(change > 1 + CHANGED for change in changes)
        lines.append(f"| {title} | {len(group)} | " + " | ".join(cells) + f" | {fell} | {rose} |")
    return lines


def level_row(rows, kind):
    cells = []
    for name in ("raw", "persistence") + RUNS:
        middle, low, high = quartiles([row["rms"][kind][name] for row in rows])
        cells.append(f"{middle:.4f} ({low:.4f} to {high:.4f})")
    return " | ".join(cells)


def case_line(row):
    hidden = " + ".join(f"{name} (d {d:.1f})" for name, d in row["hidden"])
    if "failed" in row:
        return f"| {row['case']} | {hidden} | {row['said']} | failed: {row['failed']} | | | | | |"
    level = row["rms"]["slow"]
    cells = [f"{level[name]:.4f}" for name in ("raw", "persistence") + RUNS]
    note = f" ({row['note']})" if row["note"] else ""
    return (f"| {row['case']} | {hidden} | {row['said']}{note} | " + " | ".join(cells) +
            f" | {ratio(row, 'slow', 'factory'):.3f} |")


KIND_TITLES = {"all": "all rates", "slow": f"rates up to {SLOW_DEG_H:.0f} deg/h, which are learned from"}


def table_text(rows, title=""):
    judged = [row for row in rows if "failed" not in row]
    same = sum(row["same"] for row in judged)
    unanswered = sum(row["said"] == NO_RESULT for row in rows)
    out = [f"### {title}", ""] if title else []
    out += [f"{len(rows)} cases, {len(rows) - len(judged)} of them failed and left out. RMS of the 60 s means of "
            f"compensated rate less reference on the unseen record, labels {LABEL_DELAY_S:.0f} s old, the first "
            f"{JUDGED_FROM_S / 60:.0f} minutes left out. In {same} of {len(judged)} cases the repaired model is the "
            "same prior as the factory's, as nothing was found or nothing that a prior holds; these count with "
            f"ratio 1. Of {unanswered} cases `diagnose` gave no result."]
    if not judged:
        return "\n".join(out) + "\n"
    out += ["", "| deg/h, median (quartiles) | raw | `persistence` | no prior | factory's prior | repaired prior |",
            "|---|---|---|---|---|---|"]
    out += [f"| {KIND_TITLES[kind]} | {level_row(judged, kind)} |" for kind in RATES]
    for kind in RATES:
        out += ["", f"Repaired prior against others, {KIND_TITLES[kind]}:", "",
                "| cases | n | / factory's prior, median (quartiles) | / no prior | / `persistence` "
                f"| fell by > {100 * CHANGED:.0f} % | rose by > {100 * CHANGED:.0f} % |",
                "|---|---|---|---|---|---|---|"]
        out += ratio_rows(judged, kind)
    out += ["", f"Each case, {KIND_TITLES['slow']}, deg/h:", "",
            "| case | hidden | said | raw | `persistence` | no prior | factory's | repaired | repaired/factory's |",
            "|---|---|---|---|---|---|---|---|---|"]
    out += [case_line(row) for row in rows]
    return "\n".join(out) + "\n"


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--zerodrift", required=True, help="the program")
    suites.add_arguments(parser)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds of a processor per run of the program")
    parser.add_argument("--table", help="also write the table here")
    parser.add_argument("--json", help="also write the rows here")
    options = parser.parse_args(argv)
    if not suites.is_own_seed(options):
        return 2
    plan = suites.plan(options.suite, options.seed)
    indices = [i for i in generate.parse_only(options.only, len(plan)) if plan[i][0] in ("single", "double")]
    with tempfile.TemporaryDirectory(prefix="blind_prior_") as work:
        rows = run_suite({"program": str(pathlib.Path(options.zerodrift).resolve()), "suite": options.suite,
                          "seed": options.seed, "work": work, "timeout_s": options.timeout}, indices, options.jobs)
    text = table_text(rows, f"suite {options.suite}, seed {options.seed}, the repaired model as prior")
    score.put_table(text, options.table)
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(rows, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
