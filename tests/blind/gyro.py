# SPDX-License-Identifier: Apache-2.0
"""The gyro before anything is hidden in it: what its factory knows, and how the factory found it out.

The drift comes from the generator's own physics. The model file's parameters are the generalised least-squares fit of
the file's documented equations (c1 D + c2 D² + c3 D³, s dT/dt, k W) to a calibration run.
"""
from dataclasses import dataclass, field

import numpy as np

import effects
import noise
import thermal

REFERENCE_DEGC = 25.0


@dataclass
class Base:
    """Sizes in deg/h (per °C/min for the Shupe effect); 0 or None = the gyro has none of it."""
    bias: float
    polynomial: tuple = (0.0, 0.0, 0.0)  # Chebyshev, over 2 to 42 °C
    wiggle: float = 0.0                  # a sine the cubic can't follow
    bias_place: str = None
    shupe: float = 0.0
    shupe_place: str = None
    shupe_spread: float = 0.0            # share of the whole coil beside the layers at the probe
    scale: float = 0.0

    def bias_curve(self, temperature):
        u = (temperature - 22.0) / 20.0
        a1, a2, a3 = self.polynomial
        return a1 * u + a2 * (2 * u**2 - 1) + a3 * (4 * u**3 - 3 * u) + self.wiggle * np.sin(3.3 * u)

    def drift(self, scene):
        out = np.full(len(scene.inputs), self.bias)
        if self.bias_place:
            out += self.bias_curve(effects.place_temperature(scene, self.bias_place))
        if self.shupe_place:
            centre = {"coil_outer": 0.1, "coil_inner": 0.9}[self.shupe_place]
            local = np.exp(-0.5 * ((effects.CELL_DEPTH - centre) / 0.05)**2)
            weight = (1 - self.shupe_spread) * local / local.mean() + self.shupe_spread
            out += self.shupe * effects.coil_integral(scene, weight)
        if self.scale:
            out += self.scale * scene.rate
        return out


def draw_base(rng, places, hidden):
    """`hidden` effects are left out: they come from effects.py, the factory doesn't know them."""
    base = Base(bias=rng.uniform(-2, 2))
    if "bias_temperature" not in hidden and ("sensor_lag" in hidden or rng.random() < 0.9):
        base.bias_place = str(rng.choice(places))
        sign = rng.choice([-1, 1], 3)
        base.polynomial = tuple(sign * [rng.uniform(0.2, 1.5), rng.uniform(0, 0.3), rng.uniform(0, 0.1)])
        base.wiggle = 0.02
    coil_places = [p for p in places if p != "board"]
    if "shupe" not in hidden and rng.random() < 0.8:
        base.shupe_place = str(rng.choice(coil_places))
        base.shupe = rng.choice([-1, 1]) * 10**rng.uniform(-0.7, 0.5)
        base.shupe_spread = 0.1
    if "sensor_lag" in hidden:
        others = [p for p in places if p != base.shupe_place]
        base.bias_place = str(rng.choice(others))
        sizes = [rng.uniform(0.5, 2), rng.uniform(0.2, 0.8), rng.uniform(0.4, 1)]
        base.polynomial = tuple(rng.choice([-1, 1], 3) * sizes)
    if "scale_factor" not in hidden and rng.random() < 0.7:
        base.scale = rng.choice([-1, 1]) * 10**rng.uniform(-5.3, -4)
    return base


def draw_levels(rng, hidden):
    levels = noise.NoiseLevels(n_deg_per_sqrt_h=10**rng.uniform(-3, np.log10(5e-3)),
                               b_deg_h=10**rng.uniform(np.log10(5e-3), np.log10(5e-2)) if rng.random() < 0.85 else 0.0,
                               k_deg_per_h_1_5=10**rng.uniform(-2.3, -1.3) if rng.random() < 0.85 else 0.0)
    if "bias_instability" in hidden:
        levels.b_deg_h = 0.0
    if "rate_random_walk" in hidden:
        levels.k_deg_per_h_1_5 = 0.0
    return levels


def draw_thermometers(rng, places):
    depth = {"coil_outer": 0.1, "coil_inner": 0.9, "board": -1.0}
    every = int(rng.choice([1, 1, 2, 5]))
    return {place: thermal.Thermometer(place, depth[place], rng.uniform(1, 4), rng.uniform(0.003, 0.01),
                                       0.0625 if place == "board" else float(rng.choice([0.005, 0.01])), every)
            for place in places}


@dataclass
class Known:
    """One effect of the model file: columns by parameter name, in the parameter's unit."""
    kind: str
    parameters: list
    inputs: list = field(default_factory=list)


def known_effects(base):
    known = []
    if base.bias_place:
        known.append(Known("bias_temperature",
                           ["c1_deg_h_per_degc", "c2_deg_h_per_degc2", "c3_deg_h_per_degc3"], [base.bias_place]))
    if base.shupe_place:
        known.append(Known("shupe", ["coefficient_deg_h_min_per_degc"], [base.shupe_place]))
    if base.scale:
        known.append(Known("scale_factor", ["error_ppm"]))
    return known


def model_columns(known, scene, thermometers):
    """The documented equations at unit parameters, from what the thermometers show (without their noise)."""
    columns = {}
    for effect in known:
        if effect.kind == "bias_temperature":
            d = thermometers[effect.inputs[0]].shown(scene.temperatures) - REFERENCE_DEGC
            for power, parameter in enumerate(effect.parameters, 1):
                columns[effect.kind, parameter] = d**power
        elif effect.kind == "shupe":
            shown = thermometers[effect.inputs[0]].shown(scene.temperatures)
            columns[effect.kind, effect.parameters[0]] = effects.per_minute(shown)
        else:
            columns[effect.kind, effect.parameters[0]] = scene.rate * 1e-6
    return columns


def calibrate(base, known, scene, thermometers, levels, rng):
    """Parameters and standard errors, (kind, name) -> value, from the mean of four runs of the calibration profile."""
    n = len(scene.inputs)
    columns = model_columns(known, scene, thermometers)
    variance = noise.density(levels, noise.cosine_frequencies(n)) / 4
    measured = base.drift(scene) + np.mean([noise.synthesise_levels(n, levels, rng) for _ in range(4)], axis=0)
    values, errors = {}, {}
    if columns:
        whitener = noise.Whitener(variance)
        coefficients, covariance = whitener.fit(list(columns.values()), measured)
        values = dict(zip(columns, coefficients.tolist()))
        errors = dict(zip(columns, np.sqrt(np.diag(covariance)).tolist()))
    rest = measured - sum((values[key] * column for key, column in columns.items()), np.zeros(n))
    values["bias", "bias_deg_h"] = float(rest.mean())
    errors["bias", "bias_deg_h"] = float(np.sqrt(variance[0] / n))
    return values, errors
