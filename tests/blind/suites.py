# SPDX-License-Identifier: Apache-2.0
"""Which cases a suite holds, and which seeds belong to which suite.

The ranges are disjoint: what was looked at while developing is never scored, and the small suite that every test run
shows is not the one that is reported.
"""
import sys

import numpy as np

import effects
import hardships

SEEDS = {"dev": range(1, 10_000), "fast": range(10_000, 20_000), "full": range(20_000, 1_000_000),
         "hard_dev": range(1_000_000, 1_010_000), "hard": range(1_010_000, 2**31), "events_dev": range(2**31, 2**31 + 10_000),
         "events": range(2**31 + 10_000, 2**32)}
SIZES = {"dev": (100, 100, 40, 60), "full": (100, 100, 40, 60), "fast": (8, 9, 3, 4)}  # null, single, double, unknown
HARD_SIZES = (6, 8)  # null, single, of each hardship
EVENTS_OF_EACH = 40
RECALIBRATION_SHARE = 0.3  # of the null cases
MODEL_NOISE_CASES = 3      # of the null cases of a large suite: white noise above what the model says


class SeedError(ValueError):
    """The seed belongs to another suite."""


def check_seed(suite, seed):
    if seed not in SEEDS[suite]:
        r = SEEDS[suite]
        raise SeedError(f"seed {seed}: suite {suite} takes {r.start} to {r.stop - 1}")


def add_arguments(parser):
    """Which cases of which suite."""
    parser.add_argument("--suite", required=True, choices=sorted(SEEDS))
    parser.add_argument("--seed", required=True, type=int)
    parser.add_argument("--only", default="", help="case numbers: 3,17 or 0:20")


def is_own_seed(options):
    """Of add_arguments(); says it where the seed belongs to another suite."""
    try:
        check_seed(options.suite, options.seed)
    except SeedError as problem:
        print(problem, file=sys.stderr)
        return False
    return True


def suite_rng(suite, seed, *index):
    check_seed(suite, seed)
    return np.random.default_rng([list(SEEDS).index(suite), seed, *index])


def case_rng(suite, seed, index):
    return suite_rng(suite, seed, index)


def single_names(rng, count):
    """Every effect equally often; the rest of the count at random. angle_random_walk comes once at most: being in
    the model already it is a recalibration, and more of it stands among the null cases."""
    others = [name for name in effects.HIDEABLE if name != "angle_random_walk"]
    names = others * (count // len(others))
    if len(names) < count and names:
        names.append("angle_random_walk")
    rest = count - len(names)
    return names + [str(name) for name in rng.permutation(others)[:rest]]


def allowed_pair(first, second):
    """At most one of two hidden effects is random or a fault of the record: d is then defined for both."""
    special = set(effects.STOCHASTIC + effects.FAULTS + ["clock_offset", "sensor_lag", "telegraph"])
    pair = {first, second}
    # a lagging thermometer needs a bias that the factory knows
    contradictory = pair == {"sensor_lag", "bias_temperature"}
    return len(pair) == 2 and not pair <= special and "angle_random_walk" not in pair and not contradictory


def draw_pair(rng):
    while True:
        first, second = (str(name) for name in rng.choice(effects.HIDEABLE, 2, replace=False))
        if allowed_pair(first, second):
            return [first, second]


def plain_plan(rng, suite):
    nulls, singles, doubles, unknowns = SIZES[suite]
    recalibrated = int(round(RECALIBRATION_SHARE * nulls))
    noisy = MODEL_NOISE_CASES if nulls >= 50 else 0
    kinds = ["recalibration"] * (recalibrated - noisy) + ["model_noise"] * noisy + ["nothing"] * (nulls - recalibrated)
    unknown_names = sorted(effects.UNKNOWNS)
    cases = [("null", [kind]) for kind in kinds]
    cases += [("single", [name]) for name in single_names(rng, singles)]
    cases += [("double", draw_pair(rng)) for _ in range(doubles)]
    offset = int(rng.integers(len(unknown_names)))
    cases += [("unknown", [unknown_names[(i + offset) % len(unknown_names)]]) for i in range(unknowns)]
    return [(kind, names, None) for kind, names in cases]


def draw_single(rng, hardship):
    left_out = ["angle_random_walk"] + (["spikes"] if hardship == "wild_sample" else [])
    return str(rng.choice([name for name in effects.HIDEABLE if name not in left_out]))


def hard_plan(rng):
    nulls, singles = HARD_SIZES
    cases = []
    for hardship in hardships.NAMES:
        cases += [("null", ["nothing"], {"name": hardship}) for _ in range(nulls)]
        cases += [("single", [draw_single(rng, hardship)], {"name": hardship}) for _ in range(singles)]
    cases += [("single", [str(rng.choice(hardships.FORMS))], {"name": "mismatch", "share": share, "distance": distance})
              for share, distance in hardships.ladder()]
    return cases


def events_plan():
    return [("single", [name], None) for name in effects.EVENTS for _ in range(EVENTS_OF_EACH)]


def entries(suite, seed):
    """The cases in the suite's order, shuffled: (class, names, hardship or None) each."""
    rng = suite_rng(suite, seed)
    if suite.startswith("events"):
        cases = events_plan()
    else:
        cases = hard_plan(rng) if suite.startswith("hard") else plain_plan(rng, suite)
    return [cases[i] for i in rng.permutation(len(cases))]


def plan(suite, seed):
    """(class, names) of each case. Class null has sub-kinds as its name."""
    return [(kind, names) for kind, names, _ in entries(suite, seed)]
