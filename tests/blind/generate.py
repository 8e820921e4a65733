#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the cases of a suite: what `zerodrift diagnose` may see under --out, the truth under --truth.

    generate.py --suite fast|full|dev|hard --seed S --out DIR [--truth DIR] [--only 3,17 | --only 0:20] [--kinds-only]

DIR/case_007/ holds model.yaml, record.csv (to diagnose) and, but of a short record, validation.csv; TRUTH/case_007.json what is hidden.
"""
import argparse
import json
import os
import pathlib
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cases
import suites

DIGITS = {"time_s": 3, "vibration_g": 3, "source_current_mA": 3, "supply_V": 4}


def column_digits(name):
    if name.startswith("magnetic"):
        return 2
    return DIGITS.get(name, 4)


def csv_text(record, gyro_id):
    """Comma-separated with a header; blank = not measured."""
    cells = []
    for name, column in record.items():
        pattern = f"%.{column_digits(name)}f"
        cells.append([pattern % v if v == v else "" for v in column.tolist()])
    rows = "\n".join(map(",".join, zip(*cells)))
    return f"# gyro_id: {gyro_id}\n{','.join(record)}\n{rows}\n"


def yaml_text(model):
    """The model as YAML; JSON's flow style is YAML too and keeps every number."""
    lines = [f"{key}: {json.dumps(value)}" for key, value in model.items() if key not in ("probes", "effects")]
    for key in ("probes", "effects"):
        lines.append(f"{key}:")
        for entry in model[key]:
            first = True
            for name, value in entry.items():
                lines.append(("  - " if first else "    ") + f"{name}: {json.dumps(value)}")
                first = False
    return "\n".join(lines) + "\n"


def kinds_alone(model):
    """The model of an owner who knows what the gyro has, but not how much of it."""
    values = ("parameters", "standard_errors")
    effects = [{key: value for key, value in entry.items() if key not in values} for entry in model["effects"]]
    return {**model, "effects": effects}


def write_case(suite, seed, index, out, truth, kinds_only=False):
    """Makes and writes one case; returns its name."""
    case = cases.make_case(suite, seed, index)
    name = case.truth["case"]
    folder = pathlib.Path(out) / name
    folder.mkdir(parents=True, exist_ok=True)
    pathlib.Path(truth).mkdir(parents=True, exist_ok=True)
    gyro_id = case.model["gyro_id"]
    (folder / "model.yaml").write_text(yaml_text(kinds_alone(case.model) if kinds_only else case.model))
    (folder / "record.csv").write_text(csv_text(case.fit, gyro_id))
    if case.validation is not None:
        (folder / "validation.csv").write_text(csv_text(case.validation, gyro_id))
    (pathlib.Path(truth) / f"{name}.json").write_text(json.dumps(case.truth, indent=1) + "\n")
    return name


def parse_only(text, count):
    """'3,17' or '0:20' as case numbers; nothing = all."""
    if not text:
        return list(range(count))
    if ":" in text:
        first, last = text.split(":")
        return list(range(count))[int(first or 0):int(last or count)]
    return [int(part) for part in text.split(",")]


def truth_folder(out, truth):
    """Beside the cases, never inside them."""
    out = pathlib.Path(out).resolve()
    chosen = pathlib.Path(truth).resolve() if truth else out.with_name(out.name + "_truth")
    if chosen == out or out in chosen.parents or chosen in out.parents:
        raise ValueError(f"the truth goes into a folder of its own, not {chosen}")
    return chosen


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True)
    parser.add_argument("--truth", help="default: <out>_truth")
    suites.add_arguments(parser)
    parser.add_argument("--kinds-only", action="store_true", help="models list their effects without values")
    options = parser.parse_args(argv)
    try:
        suites.check_seed(options.suite, options.seed)
        truth = truth_folder(options.out, options.truth)
    except ValueError as problem:
        print(problem, file=sys.stderr)
        return 2
    for index in parse_only(options.only, len(suites.plan(options.suite, options.seed))):
        write_case(options.suite, options.seed, index, options.out, truth, options.kinds_only)
    return 0


if __name__ == "__main__":
    sys.exit(main())
