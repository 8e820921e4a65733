# SPDX-License-Identifier: Apache-2.0
"""What is done to the gyro during a record: chamber, rate table, field coils, tilt, shaker, current, power.

Several ramp rates both ways over the same temperatures with soaks, one more power-on in a soak, and block-wise
random levels of every other input, each with change times of its own, so that none looks like another.
"""
from dataclasses import dataclass

import numpy as np

DURATION_S = 18000
OFF_AT_START_S = 30


@dataclass
class Inputs:
    """One value a second; rates are means over the second that ends at the sample."""
    air_degc: np.ndarray
    rate_deg_h: np.ndarray       # (n, 3)
    rate_end_deg_h: np.ndarray   # (n + 1, 3), at the seconds' ends; row 0 = start
    magnetic_ut: np.ndarray      # (n, 3)
    acceleration_g: np.ndarray   # (n, 3)
    vibration_g: np.ndarray
    current_ma: np.ndarray
    supply_v: np.ndarray         # 0 = off
    since_power_on_s: np.ndarray  # negative while off

    @property
    def powered(self):
        return self.supply_v > 0

    def __len__(self):
        return len(self.air_degc)


def chamber(rng, low_degc, high_degc, n):
    """Air temperature and the middle of a soak late in the record, s."""
    rates = rng.permutation([0.5, 1.0, 2.0, 4.0]) * rng.uniform(0.8, 1.25, 4)  # °C/min
    levels = [low_degc, high_degc] if rng.random() < 0.5 else [high_degc, low_degc]
    middle = rng.uniform(0.35, 0.65) * (high_degc - low_degc) + low_degc
    stops = [levels[0], levels[1], levels[0], middle, levels[1], levels[0], levels[1]]
    minutes, values = [0.0], [stops[0]]
    soaks = []

    def hold(length):
        soaks.append((minutes[-1], minutes[-1] + length))
        minutes.append(minutes[-1] + length)
        values.append(values[-1])

    hold(rng.uniform(12, 20))
    leg = 0
    while minutes[-1] * 60 < n:
        target = stops[(leg + 1) % len(stops)]
        minutes.append(minutes[-1] + max(abs(target - values[-1]) / rates[leg % 4], 0.1))
        values.append(target)
        hold(rng.uniform(10, 26))
        leg += 1
    inside = [s for s in soaks if 0.3 * n < (s[0] + 0.7 * (s[1] - s[0])) * 60 < 0.85 * n]
    soak = inside[rng.integers(len(inside))] if inside else (0.5 * n / 60, 0.55 * n / 60)
    return np.interp(np.arange(n), np.array(minutes) * 60, values), (soak[0] + 0.7 * (soak[1] - soak[0])) * 60


def slow_air(rng, low_degc, high_degc, n):
    """One slow way through a few temperatures, as a room or a day has it, and a time late in it, s."""
    stops = np.concatenate([[low_degc, high_degc], rng.uniform(low_degc, high_degc, 3)])
    air = np.interp(np.arange(n), np.linspace(0, n, len(stops)), rng.permutation(stops))
    return air, rng.uniform(0.5, 0.8) * n


def block_levels(rng, n, shortest_s, longest_s, draw):
    """Random levels, each held for a random time."""
    out = np.empty(n)
    at = 0
    while at < n:
        length = int(rng.uniform(shortest_s, longest_s))
        out[at:at + length] = draw()
        at += length
    return out


def rate_level(rng, rest_or_fast=False):
    """A third at rest, a third slow (below and around Earth rate), a third fast; deg/h."""
    kind = rng.random()
    if kind < 0.33 or (rest_or_fast and kind < 0.66):
        return 0.0
    sign = rng.choice([-1.0, 1.0])
    if kind < 0.66:
        return sign * 10**rng.uniform(np.log10(0.05), np.log10(40))
    return sign * 10**rng.uniform(2, np.log10(36000))


def table_rate(rng, n, scale, rest_or_fast=False):
    """Rate at every tenth of a second, changing linearly over 2 to 5 s, reduced to means and ends."""
    changes, levels, at = [0.0], [0.0], 0.0
    while at < n:
        hold = rng.uniform(60, 360)
        level = scale * rate_level(rng, rest_or_fast)
        changes += [at + rng.uniform(2, 5), at + hold]
        levels += [level, level]
        at += hold
    fine = np.interp(np.arange(10 * n + 1) / 10.0, changes, levels)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (fine[1:] + fine[:-1]) / 10)])
    return np.diff(angle[::10]), fine[::10]


def draw_inputs(rng, low_degc, high_degc, n=DURATION_S, static=False, second_power_on=True, rest_or_fast=False,
                slow=False):
    """A record's inputs; `static`: the gyro stands still and nothing is applied but heat and power."""
    air, soak_s = (slow_air if slow else chamber)(rng, low_degc, high_degc, n)
    rate, ends = np.zeros((n, 3)), np.zeros((n + 1, 3))
    field, tilt = np.zeros((n, 3)), np.zeros((n, 3))
    tilt[:, 2] = 1.0
    vibration, current = np.zeros(n), np.full(n, 100.0)
    supply = np.full(n, 5.0)
    if not static:
        for axis in range(3):
            rate[:, axis], ends[:, axis] = table_rate(rng, n, 1.0, rest_or_fast)
            field[:, axis] = block_levels(rng, n, 100, 500, lambda: rng.choice([0, 1, 1]) * rng.uniform(-250, 250))
        azimuth = block_levels(rng, n, 200, 700, lambda: rng.uniform(-np.pi, np.pi))
        height = block_levels(rng, n, 200, 700, lambda: rng.uniform(-1, 1))
        flat = np.sqrt(1 - height**2)
        tilt = np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), height])
        vibration = block_levels(rng, n, 100, 500, lambda: rng.choice([0, 1]) * rng.uniform(0.5, 4))
        current = block_levels(rng, n, 150, 600, lambda: rng.uniform(88, 112))
        supply = block_levels(rng, n, 150, 600, lambda: rng.uniform(4.75, 5.25))
    starts = [OFF_AT_START_S]
    supply[:OFF_AT_START_S] = 0.0
    if second_power_on:
        off = int(soak_s)
        starts.append(off + int(rng.uniform(120, 240)))
        supply[off:starts[-1]] = 0.0
    since = np.full(n, -1.0)
    for start in starts:
        since[start:] = np.arange(n - start) + 1.0
    since[supply == 0] = -1.0
    return Inputs(air, rate, ends, field, tilt, vibration, current, supply, since)
