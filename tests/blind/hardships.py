# SPDX-License-Identifier: Apache-2.0
"""What an owner's record has and a benchmark's own has not. Suite `hard` gives every case one of these.

A hardship takes nothing from the truth: the effect acts in the gyro as before, d is that of the record as it is written
(`short`, `mismatch`) or as it would be without the hardship (all others).
"""
from dataclasses import replace

import numpy as np

SHORT_MINUTES = (20, 40, 60, 90, 120, 180)
MISMATCH_SHARES = (0.0, 0.1, 0.2, 0.35, 0.5)    # of a form, std of what it differs by over its own
MISMATCH_DISTANCES = (8.0, 15.0, 30.0, 60.0, 100.0)
# Effects of which there is a form to differ from, on a record that predicts them.
FORMS = ["acceleration_sensitivity", "coil_lag", "gradient", "gradient_rate", "magnetic", "scale_factor_asymmetry", "shupe",
         "shupe_temperature", "source_intensity", "temperature_step", "vibration_rectification", "warm_up"]

AFTER = ["one_component", "wild_sample", "few_digits", "no_reference"]  # done to a record that is made


def rough_form(effect, share, rng):
    """The same effect, each value of which depends on the coil's temperature a little as well: z (1 + share g(T))."""
    weights = rng.standard_normal(3) / np.arange(1, 4)
    phases = rng.uniform(0, 2 * np.pi, 3)

    def wave(scene, size):
        plain = effect.wave(scene, 1.0)
        span = (scene.temperatures.coil.mean(axis=1) - 20.0) / 60.0
        factor = sum(w * np.sin(2 * np.pi * k * span + p) for k, (w, p) in enumerate(zip(weights, phases), 1))
        change = plain * factor
        spread = np.std(change)
        return size * (plain + share * np.std(plain) / spread * change if spread > 0 else plain)

    return replace(effect, wave=wave, shape={**effect.shape, "mismatch_share": share})


def one_component(record, hidden, rng):
    """A sensor with one axis, the one that matters where one does."""
    for group in ("magnetic", "acceleration"):
        columns = [name for name in record if name.startswith(group + "_")]
        if not columns:
            continue
        along = [h.effect.shape.get("along") for h in hidden if h.effect.name.startswith(group)]
        keep = columns[along[0] if along and along[0] is not None else int(rng.integers(len(columns)))]
        record = {name: column for name, column in record.items() if name == keep or name not in columns}
    return record


def wild_sample(record, hidden, rng):
    """One to three rates from nowhere, often the first one after power-on."""
    out = dict(record)
    for name in [n for n in record if n.startswith("rate_")]:
        column = record[name].copy()
        valid = np.flatnonzero(np.isfinite(column))
        at = rng.choice(valid, int(rng.integers(1, 4)), replace=False)
        if rng.random() < 0.4:
            at[0] = valid[0]
        column[at] += rng.choice([-1.0, 1.0], at.size) * 10**rng.uniform(0.7, 3, at.size)
        out[name] = column
    return out


def few_digits(record, hidden, rng):
    """A reference or a rate printed with too few digits: .001 or .01 deg/s, or .1 or 1 deg/h."""
    out = dict(record)
    references = [n for n in record if n.startswith("reference_")]
    names, step = [n for n in record if n.startswith("rate_")], float(rng.choice([0.1, 1.0]))
    if references and rng.random() < 0.5:
        names, step = references, float(rng.choice([3.6, 36.0]))
    for name in names:
        out[name] = np.round(record[name] / step) * step
    return out


def no_reference(record, hidden, rng):
    """The gyro turns, and nobody wrote down how fast."""
    return {name: column for name, column in record.items() if not name.startswith("reference_")}


def slow_ranges(rng, low_degc, high_degc):
    """Two ranges of temperature within one, of 8 to 20 °C each, that overlap or not."""
    widths = rng.uniform(8, 20, 2)
    lows = low_degc + rng.uniform(0, 1, 2) * (high_degc - low_degc - widths)
    return [(a, a + width) for a, width in zip(lows, widths)]


def draw(name, rng):
    """What is drawn before the case is made: {seconds}, {rest_or_fast}, {slow} or nothing."""
    if name == "short":
        return {"seconds": 60 * int(rng.choice(SHORT_MINUTES))}
    if name == "slow":
        return {"slow": True}
    # What turns by less than a drift can't be told from one without a reference, nor from rest by a coarse one.
    return {"rest_or_fast": True} if name in ("no_reference", "few_digits") else {}


def after(name, record, hidden, rng):
    """The record with the hardship, where it is one that is done afterwards."""
    if name not in AFTER:
        return record
    return {"one_component": one_component, "wild_sample": wild_sample, "few_digits": few_digits,
            "no_reference": no_reference}[name](record, hidden, rng)


NAMES = AFTER + ["short", "slow"]


def ladder():
    """(share, distance) of each rung."""
    return [(share, distance) for share in MISMATCH_SHARES for distance in MISMATCH_DISTANCES]
