#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Generates the cases of a suite, lets `zerodrift diagnose` loose on each, and scores its JSON.

    run.py --diagnose PATH_TO_zerodrift --suite fast --seed S [--jobs 2] [--work DIR] [--table out.md] [--keep]
    run.py --diagnose PATH_TO_zerodrift_blind_baselines --baseline bic|stlsq ...
    run.py ... --kinds-only --classes null,single    models that list their effects without values
    run.py ... --at-most-false-names 1 --at-least-right 10 --at-most-failed 0    bars: exit code 1 where one is missed

A case is made, diagnosed and its records deleted, so that a suite needs little room. diagnose is given the paths of the
case alone; the truth lies in another folder. One case may take --timeout seconds of a processor; then it counts as failed.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import generate
import score
import suites


ASLEEP = 20.0  # times its seconds of a processor, for one that waits for ever


def command_for(program, baseline, case, out_model, out_json):
    head = [program, "--method", baseline] if baseline else [program, "diagnose"]
    validation = case / "validation.csv"
    return head + ["--model", str(case / "model.yaml"), "--record", str(case / "record.csv"), "--out-model", str(out_model),
                   "--json", str(out_json)] + (["--validate", str(validation)] if validation.exists() else [])


def run_bounded(command, log, timeout_s):
    """Runs it in one process, for so many seconds of a processor however busy that is; {exit_code, timed_out, wall_s, cpu_s}."""
    start = time.monotonic()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor_s = max(1, round(timeout_s))
    with open(log, "w") as output:
        try:
            code = subprocess.run(command, stdout=output, stderr=subprocess.STDOUT, timeout=ASLEEP * timeout_s,
                                  stdin=subprocess.DEVNULL,
                                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU,
                                                                        (processor_s, processor_s + 1))).returncode
            timed_out = code in (-signal.SIGXCPU, -signal.SIGKILL)
        except subprocess.TimeoutExpired:
            timed_out = True
    if timed_out:
        code = None
    now = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime
    return {"exit_code": code, "timed_out": timed_out, "wall_s": round(time.monotonic() - start, 3),
            "cpu_s": round(cpu, 3)}


def one_case(job):
    """In a worker process, which has one child at a time: its use of the processor is that child's."""
    options, index = job
    work = pathlib.Path(options["work"])
    name = generate.write_case(options["suite"], options["seed"], index, work / "cases", work / "truth",
                               options["kinds_only"])
    results = work / "results"
    answer = results / f"{name}.json"
    answer.unlink(missing_ok=True)
    command = command_for(options["program"], options["baseline"], work / "cases" / name,
                          results / f"{name}.model.yaml", answer)
    run = run_bounded(command, results / f"{name}.log", options["timeout_s"])
    if run["timed_out"]:
        answer.unlink(missing_ok=True)
    (results / f"{name}.run.json").write_text(json.dumps(run) + "\n")
    if not options["keep"]:
        for record in ("record.csv", "validation.csv"):
            (work / "cases" / name / record).unlink(missing_ok=True)
    return name, run


def run_suite(options, indices, jobs):
    with concurrent.futures.ProcessPoolExecutor(max_workers=jobs) as pool:
        for name, run in pool.map(one_case, [(options, index) for index in indices]):
            state = "time-out" if run["timed_out"] else f"exit {run['exit_code']}"
            print(f"{name}: {state}, {run['cpu_s']:.2f} s CPU", file=sys.stderr)


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--diagnose", required=True, help="the program")
    suites.add_arguments(parser)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--baseline", choices=["bic", "stlsq"])
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds of a processor per case")
    parser.add_argument("--classes", default="", help="only these: null,single")
    parser.add_argument("--kinds-only", action="store_true", help="models list their effects without values")
    parser.add_argument("--work", help="default: a temporary folder, deleted at the end")
    parser.add_argument("--keep", action="store_true", help="keep the records (needs --work)")
    parser.add_argument("--table", help="also write the table here")
    parser.add_argument("--at-most-false-names", type=int, help="bar: null cases with a false name or unknown effect")
    parser.add_argument("--at-least-right", type=int, help="bar: right cases that hide something (score.is_right)")
    parser.add_argument("--at-most-failed", type=int, help="bar: cases without a readable result")
    options = parser.parse_args(argv)
    if not suites.is_own_seed(options):
        return 2
    work = pathlib.Path(options.work or tempfile.mkdtemp(prefix="blind_"))
    try:
        # answers and truths of an earlier run would be scored with this one's
        for folder in ("truth", "results"):
            shutil.rmtree(work / folder, ignore_errors=True)
            (work / folder).mkdir(parents=True)
        plan = suites.plan(options.suite, options.seed)
        classes = options.classes.split(",") if options.classes else {kind for kind, _ in plan}
        indices = [i for i in generate.parse_only(options.only, len(plan)) if plan[i][0] in classes]
        run_suite({"program": str(pathlib.Path(options.diagnose).resolve()), "baseline": options.baseline,
                   "suite": options.suite, "seed": options.seed, "work": str(work), "timeout_s": options.timeout,
                   "keep": options.keep and bool(options.work), "kinds_only": options.kinds_only}, indices, options.jobs)
        title = f"suite {options.suite}, seed {options.seed}, {options.baseline or 'diagnose'}"
        title += ", kinds only" if options.kinds_only else ""
        scored = score.load_results(work / "truth", work / "results")
        text = score.table_text(scored, title)
        score.put_table(text, options.table)
        missed = score.missed_bars(scored, options.at_most_false_names, options.at_least_right, options.at_most_failed)
        for line in missed:
            print(line, file=sys.stderr)
        if missed:
            return 1
    finally:
        if not options.work:
            shutil.rmtree(work)
    return 0


if __name__ == "__main__":
    sys.exit(main())
