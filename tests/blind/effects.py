# SPDX-License-Identifier: Apache-2.0
"""Errors of a gyro, each from the physics behind it, as additions to the rate in deg/h.

`draw(name, rng, places)` picks the inner parameters of one gyro's effect. Its `wave(scene, size)` is then the same
law on every record; `size` scales it (proportionally where `linear`). README.md lists all of them.
"""
from dataclasses import dataclass, field
from typing import Callable

import numpy as np

import thermal


@dataclass
class Scene:
    """One record's inputs and true temperatures; `rng` feeds what is random in an effect."""
    inputs: object
    temperatures: thermal.Temperatures
    rng: np.random.Generator
    axis: int = 0
    memory: dict = field(default_factory=dict)

    @property
    def rate(self):
        return self.inputs.rate_deg_h[:, self.axis]

    def cross_rate(self, which):
        return self.inputs.rate_deg_h[:, (self.axis + which) % 3]

    def random(self, name):
        """The same stream each time an effect asks: one record has one realisation of it."""
        if name not in self.memory:
            self.memory[name] = int(self.rng.integers(2**62))
        return np.random.default_rng(self.memory[name])

    def hub(self, slowest_s):
        key = ("hub", round(slowest_s, 3))
        if key not in self.memory:
            self.memory[key] = thermal.hub_mean(self.temperatures.at_depth(1.0), slowest_s)
        return self.memory[key]


@dataclass
class Effect:
    name: str
    shape: dict                       # inner parameters, for the truth file
    wave: Callable                    # (scene, size) -> deg/h
    linear: bool = True
    removable: bool = True            # a twin that knows it can predict it on an unseen record
    needs: tuple = ()                 # columns without which it can't be named


CELL_DEPTH = (np.arange(thermal.CELLS) + 0.5) / thermal.CELLS


def per_minute(temperature):
    """dT/dt in °C/min."""
    return np.gradient(temperature) * 60.0


def place_temperature(scene, place):
    t = scene.temperatures
    return {"coil_outer": lambda: t.at_depth(0.1), "coil_inner": lambda: t.at_depth(0.9), "board": lambda: t.board,
            "coil": lambda: t.coil.mean(axis=1)}[place]()


def place_columns(place):
    return {"coil": ("temperature_coil_outer", "temperature_coil_inner")}.get(place, ("temperature_" + place,))


# --- the coil -----------------------------------------------------------------------------------------------

def coil_integral(scene, weight):
    """Shupe's integral: the temperature rate of each layer times the weight of its place in the winding."""
    return per_minute(scene.temperatures.weighted(weight))


def shupe(rng, places):
    tilt = rng.uniform(-0.3, 0.3)
    weight = 1.0 + tilt * (CELL_DEPTH - 0.5)
    return Effect("shupe", {"winding_tilt": tilt}, lambda s, a: a * coil_integral(s, weight),
                  needs=place_columns("coil"))


def coil_lag(rng, places):
    slowest = 60 * 10**rng.uniform(np.log10(4), np.log10(35))
    return Effect("coil_lag", {"slowest_mode_s": slowest}, lambda s, a: a * per_minute(s.hub(slowest)),
                  needs=("temperature_coil_inner",))


def gradient(rng, places):
    weight = 12 * (0.5 - CELL_DEPTH)
    return Effect("gradient", {}, lambda s, a: a * s.temperatures.weighted(weight), needs=place_columns("coil"))


def gradient_rate(rng, places):
    weight = 12 * (0.5 - CELL_DEPTH)
    return Effect("gradient_rate", {}, lambda s, a: a * coil_integral(s, weight), needs=place_columns("coil"))


def shupe_temperature(rng, places):
    # thermo-optic coefficient of the fibre, growing with temperature
    growth = rng.uniform(0.008, 0.02)

    def wave(scene, size):
        coil = scene.temperatures.coil
        coefficient = np.expm1(growth * (coil - 25.0)) / growth
        return size * (coefficient * np.gradient(coil, axis=0) * 60).mean(axis=1)

    return Effect("shupe_temperature", {"growth_per_degc": growth}, wave, needs=place_columns("coil"))


def preisach(temperature, thresholds, coercivities, weights, start=-1.0):
    """Sum of relays that go up above threshold + coercivity and down below threshold - coercivity."""
    state = np.full(len(thresholds), start)
    state[temperature[0] > thresholds] = 1.0
    up, down = thresholds + coercivities, thresholds - coercivities
    out = np.empty(len(temperature))
    for k, t in enumerate(temperature):
        state[t > up] = 1.0
        state[t < down] = -1.0
        out[k] = weights @ state
    return out


def hysteresis(rng, places):
    place = str(rng.choice(["coil", "coil_outer", "coil_inner"]))
    relays = 300
    centre = rng.uniform(5, 40, relays)
    coercivity = np.abs(rng.normal(0, rng.uniform(5, 10), relays))
    weights = np.exp(-0.5 * ((centre - rng.uniform(15, 30)) / rng.uniform(12, 25))**2) / relays

    def wave(scene, size):
        t = place_temperature(scene, place)
        coarse = np.arange(0, len(t), 20)
        return size * np.interp(np.arange(len(t)), coarse, preisach(t[coarse], centre, coercivity, weights))

    return Effect("hysteresis", {"place": place, "relays": relays, "mean_coercivity_degc": float(coercivity.mean())},
                  wave, needs=place_columns(place))


def temperature_step(rng, places):
    # domains of the fibre's clamp that let go one after the other within a few tenths of a degree
    place = str(rng.choice(["coil", "coil_outer", "board"]))
    centre, coercivity, spread = rng.uniform(12, 33), rng.uniform(0.3, 2.0), rng.uniform(0.02, 0.15)
    domains = rng.normal(centre, spread, 12)

    def wave(scene, size):
        t = place_temperature(scene, place)
        coarse = np.arange(0, len(t), 5)
        flips = preisach(t[coarse], domains, np.full(12, coercivity), np.full(12, 1 / 24))
        return size * np.repeat(flips, 5)[:len(t)]

    return Effect("temperature_step", {"place": place, "at_degc": centre, "half_width_degc": coercivity}, wave,
                  needs=place_columns(place))


def bias_step(rng, places):
    # stress in a splice that lets go: an edge, and a creep of up to a fifth of it afterwards, once in the gyro's life:
    # in the first record that asks
    at, creep, tau_s = rng.uniform(0.05, 0.95), rng.uniform(-0.2, 0.2), 60 * 10**rng.uniform(0, 1.3)
    happened_in = []

    def wave(scene, size):
        happened_in[:] = happened_in or [scene]
        n = len(scene.inputs)
        since = np.arange(n) - at * n
        if scene is not happened_in[0]:
            return np.zeros(n)
        return size * np.where(since >= 0, 1 - creep * np.exp(-np.maximum(since, 0) / tau_s), 0.0)

    return Effect("bias_step", {"at": at, "creep": creep, "tau_s": tau_s}, wave, removable=False)


def etalon_fringe(rng, places):
    # Airy transmission of a low-finesse cavity
    place = str(rng.choice(["coil", "coil_outer", "board"]))
    period, finesse, phase = rng.uniform(2, 7), rng.uniform(0.3, 1.2), rng.uniform(0, np.pi)

    def wave(scene, size):
        t = place_temperature(scene, place)
        return size / (1 + finesse * np.sin(np.pi * t / period + phase)**2)

    return Effect("etalon_fringe", {"place": place, "period_degc": period, "coefficient_of_finesse": finesse}, wave,
                  needs=place_columns(place))


def bias_temperature(rng, places):
    # interference of two misaligned polarisations: a slow sine of the temperature
    place = str(rng.choice(places))
    span, phase = rng.uniform(80, 140), rng.uniform(-1, 1)
    return Effect("bias_temperature", {"place": place, "period_degc": span},
                  lambda s, a: a * np.sin(2 * np.pi * (place_temperature(s, place) - 20) / span + phase),
                  needs=place_columns(place))


# --- time ---------------------------------------------------------------------------------------------------

def warm_up(rng, places):
    tau = 10**rng.uniform(np.log10(150), np.log10(1500))
    if rng.random() < 0.5:
        part, ratio = rng.uniform(0.3, 0.7), rng.uniform(2.5, 6)
        shape = {"form": "two exponentials", "tau_s": tau, "part": part, "ratio": ratio}

        def law(t):
            return part * np.exp(-t / tau) + (1 - part) * np.exp(-t * ratio / tau)
    else:
        power = rng.uniform(1.5, 3)
        shape = {"form": "hyperbola", "tau_s": tau, "power": power}

        def law(t):
            return (1 + t / tau)**-power

    def wave(scene, size):
        since = scene.inputs.since_power_on_s
        return size * np.where(since >= 0, law(np.maximum(since, 0)), 0.0)

    return Effect("warm_up", shape, wave, needs=("supply_V",))


def rate_ramp(rng, places):
    # ageing: an approach to an equilibrium that is many hours off, or diffusion-limited
    if rng.random() < 0.5:
        tau_h = rng.uniform(8, 30)
        return Effect("rate_ramp", {"form": "approach", "tau_h": tau_h},
                      lambda s, a: -a * np.expm1(-np.arange(len(s.inputs)) / 3600 / tau_h))
    start_h = rng.uniform(0.5, 3)
    return Effect("rate_ramp", {"form": "square root", "start_h": start_h},
                  lambda s, a: a * (np.sqrt(start_h + np.arange(len(s.inputs)) / 3600) - np.sqrt(start_h)))


def line(rng, places):
    frequency, third = 10**rng.uniform(np.log10(0.01), np.log10(0.4)), rng.uniform(0, 0.1)

    def wave(scene, size):
        phase = 2 * np.pi * frequency * np.arange(len(scene.inputs)) + scene.random("line").uniform(0, 2 * np.pi)
        return size * (np.sin(phase) + third * np.sin(3 * phase))

    return Effect("line", {"frequency_hz": frequency, "third_harmonic": third}, wave, removable=False)


def switching(rng, n, mean_up_s, mean_down_s):
    """Two levels, +1/2 and -1/2, each held for an exponentially distributed time of at least a second."""
    out, at, level = np.empty(n), 0, float(rng.choice([-0.5, 0.5]))
    while at < n:
        length = max(1, int(np.ceil(rng.exponential(mean_up_s if level > 0 else mean_down_s))))
        out[at:at + length] = level
        at, level = at + length, -level
    return out


def telegraph(rng, places):
    dwell, bias = 10**rng.uniform(np.log10(250), np.log10(900)), rng.uniform(0.6, 1.6)

    def wave(scene, size):
        return size * switching(scene.random("telegraph"), len(scene.inputs), dwell * bias, dwell / bias)

    return Effect("telegraph", {"mean_dwell_s": dwell, "asymmetry": bias}, wave, removable=False)


# --- the rate -----------------------------------------------------------------------------------------------

def scale_factor(rng, places):
    # wavelength of the source off its nominal one
    return Effect("scale_factor", {}, lambda s, a: (1 / (1 - a) - 1) * s.rate, linear=False, needs=("reference",))


def scale_factor_temperature(rng, places):
    place = str(rng.choice([p for p in places if p == "board"] or places))
    curve = rng.uniform(-0.003, 0.003)

    def wave(scene, size):
        # wavelength of the source with its temperature
        d = place_temperature(scene, place) - 25.0
        return (1 / (1 - size * (d + curve * d**2)) - 1) * scene.rate

    return Effect("scale_factor_temperature", {"place": place, "curve_per_degc": curve}, wave, linear=False,
                  needs=("reference",) + place_columns(place))


def scale_factor_nonlinearity(rng, places):
    # the demodulator shows the sine of the Sagnac phase
    full = 36000.0
    bend = rng.uniform(0.4, 1.2)  # phase at full rate, rad

    def wave(scene, size):
        phase = bend * scene.rate / full
        return size * (np.sin(phase) - phase) * 6 / bend**3

    return Effect("scale_factor_nonlinearity", {"phase_at_full_rate_rad": bend}, wave, needs=("reference",))


def scale_factor_asymmetry(rng, places):
    # the two modulator slopes have different gains; rounded at zero by the closed loop's dead time
    round_deg_h = 10**rng.uniform(0, 2)
    return Effect("scale_factor_asymmetry", {"rounding_deg_h": round_deg_h},
                  lambda s, a: a * (np.hypot(s.rate, round_deg_h) - round_deg_h), needs=("reference",))


def misalignment(rng, places):
    which = int(rng.integers(1, 3))

    def wave(scene, size):
        return (np.cos(size) - 1) * scene.rate + np.sin(size) * scene.cross_rate(which)

    return Effect("misalignment", {"towards": which}, wave, linear=False, needs=("reference", "cross_reference"))


def dead_band(rng, places):
    # lock-in: the square root law of coupled counter-propagating waves
    def wave(scene, size):
        w = scene.rate
        return np.sign(w) * np.sqrt(np.maximum(w**2 - size**2, 0)) - w

    return Effect("dead_band", {}, wave, linear=False, needs=("reference",))


def modulator_reset(rng, places):
    # serrodyne: phase in units of a reset; a parabolic flyback error over each ramp, exactly averaged over the second
    reset_arcsec = 10**rng.uniform(np.log10(60), np.log10(400))
    gain_share = rng.uniform(-1, 1) * 2e-4

    def wave(scene, size):
        resets = np.cumsum(scene.rate) / reset_arcsec
        on = np.flatnonzero(np.diff(np.concatenate([[-1.0], scene.inputs.since_power_on_s])) > 1)
        for start in on:
            resets[start:] -= resets[start]
        before = np.concatenate([[0.0], resets[:-1]])

        def integral(p):  # of the parabola u² - u + 1/6 over its period: periodic
            u = p - np.floor(p)
            return u**3 / 3 - u**2 / 2 + u / 6

        advance = resets - before
        centre = 0.5 * (resets + before)
        u = centre - np.floor(centre)
        small = np.abs(advance) < 1e-3
        mean = (integral(resets) - integral(before)) / np.where(small, 1.0, advance)
        return size * (6 * np.where(small, u**2 - u + 1 / 6, mean) + gain_share * np.clip(scene.rate, -3e4, 3e4))

    return Effect("modulator_reset", {"reset_arcsec": reset_arcsec, "gain_share": gain_share}, wave,
                  needs=("reference",))


def clock_offset(rng, places):
    def wave(scene, size):
        # mean over a second that ends size seconds earlier, to first order in size
        ends = scene.inputs.rate_end_deg_h[:, scene.axis]
        return -size * np.diff(ends)

    return Effect("clock_offset", {}, wave, needs=("reference",))


# --- other inputs -------------------------------------------------------------------------------------------

def vibration_rectification(rng, places):
    # depth of the phase modulation that shakes the fibre: 1 - J0
    depth_per_g = rng.uniform(0.1, 0.3)
    angles = (np.arange(64) + 0.5) * np.pi / 64

    def wave(scene, size):
        depth = depth_per_g * scene.inputs.vibration_g
        return size * (1 - np.cos(depth[:, None] * np.sin(angles)).mean(axis=1))

    return Effect("vibration_rectification", {"depth_per_g": depth_per_g}, wave, needs=("vibration_g",))


def acceleration_sensitivity(rng, places):
    along, soft = int(rng.integers(3)), rng.uniform(0.3, 0.7)
    return Effect("acceleration_sensitivity", {"along": along, "softening": soft},
                  lambda s, a: a * np.arctan(soft * s.inputs.acceleration_g[:, along]) / soft,
                  needs=("acceleration",))


def magnetic(rng, places):
    along, saturation = int(rng.integers(3)), rng.uniform(250, 600)
    return Effect("magnetic", {"along": along, "saturation_ut": saturation},
                  lambda s, a: a * np.tanh(s.inputs.magnetic_ut[:, along] / saturation), needs=("magnetic",))


def source_intensity(rng, places):
    return Effect("source_intensity", {}, lambda s, a: a * np.log(s.inputs.current_ma / 100.0),
                  needs=("source_current_mA",))


# --- what the catalogue does not know -----------------------------------------------------------------------

def bump(rng, places):
    place = str(rng.choice(["coil", "coil_outer", "board"]))
    centre, width = rng.uniform(14, 31), rng.uniform(1.2, 3.0)

    def wave(scene, size):
        return size / np.cosh((place_temperature(scene, place) - centre) / width)**2

    return Effect("temperature_bump", {"place": place, "at_degc": centre, "width_degc": width}, wave,
                  needs=place_columns(place))


def two_bumps(rng, places):
    place = str(rng.choice(["coil", "board"]))
    first, second, width = rng.uniform(8, 18), rng.uniform(24, 38), rng.uniform(1.0, 2.5)

    def wave(scene, size):
        t = place_temperature(scene, place)
        return size * (np.exp(-np.abs((t - first) / width)**3) - np.exp(-np.abs((t - second) / width)**3))

    return Effect("temperature_two_bumps", {"place": place, "at_degc": [first, second]}, wave,
                  needs=place_columns(place))


def threshold_and_power(rng, places):
    # slope change above a temperature, plus supply times rate
    at, share = rng.uniform(18, 28), rng.uniform(0.4, 0.8)

    def wave(scene, size):
        kink = np.maximum(place_temperature(scene, "coil_outer") - at, 0)
        power = (scene.inputs.supply_v - 5.0) * scene.rate * scene.inputs.powered
        return size * (kink + share * power / 250.0)

    return Effect("threshold_slope_and_supply_times_rate", {"at_degc": at}, wave,
                  needs=place_columns("coil_outer") + ("supply_V", "reference"))


def humidity_creep(rng, places):
    # a coating that takes up water slowly and gives it off faster, and can hold only so much
    uptake_s, release_s = rng.uniform(4000, 9000), rng.uniform(500, 1200)
    middle = rng.uniform(18, 28)

    def wave(scene, size):
        t = place_temperature(scene, "coil")
        goal = 1 / (1 + np.exp((t - middle) / 3.0))
        held, out = goal[0], np.empty(len(t))
        for k, g in enumerate(goal.tolist()):
            held += (g - held) / (uptake_s if g > held else release_s)
            out[k] = held
        return size * out

    return Effect("humidity_creep", {"uptake_s": uptake_s, "release_s": release_s}, wave, needs=place_columns("coil"))


def difference_squared(rng, places):
    return Effect("temperature_difference_squared", {},
                  lambda s, a: a * (place_temperature(s, "coil_outer") - place_temperature(s, "coil_inner"))**2,
                  needs=place_columns("coil"))


def rate_magnitude(rng, places):
    # even in the temperature rate, unlike anything thermal in the catalogue
    power = rng.uniform(1.0, 2.0)
    return Effect("temperature_rate_even", {"power": power},
                  lambda s, a: a * np.abs(per_minute(place_temperature(s, "coil")))**power, needs=place_columns("coil"))


def field_times_temperature(rng, places):
    along, saturation = int(rng.integers(3)), rng.uniform(150, 400)
    middle = rng.uniform(20, 26)

    def wave(scene, size):
        b = np.tanh(scene.inputs.magnetic_ut[:, along] / saturation)
        return size * b * (place_temperature(scene, "coil") - middle)

    return Effect("field_times_temperature", {"along": along}, wave, needs=("magnetic",) + place_columns("coil"))


def even_field(rng, places):
    along = int(rng.integers(3))
    return Effect("field_even", {"along": along},
                  lambda s, a: a * (1 - np.cos(s.inputs.magnetic_ut[:, along] / 120.0)), needs=("magnetic",))


def supply(rng, places):
    return Effect("supply_voltage", {},
                  lambda s, a: a * np.where(s.inputs.powered, np.expm1(4 * (s.inputs.supply_v / 5.0 - 1)), 0.0),
                  needs=("supply_V",))


def tilt_product(rng, places):
    return Effect("acceleration_product", {},
                  lambda s, a: a * s.inputs.acceleration_g[:, 0] * s.inputs.acceleration_g[:, 1],
                  needs=("acceleration",))


def after_vibration(rng, places):
    # shaken loose, creeps back afterwards
    tau = rng.uniform(150, 500)

    def wave(scene, size):
        level, out = 0.0, np.empty(len(scene.inputs))
        for k, g in enumerate((scene.inputs.vibration_g > 0.2).tolist()):
            level += (1 - level) / 60 if g else -level / tau
            out[k] = level * (not g)
        return size * out

    return Effect("creep_after_vibration", {"tau_s": tau}, wave, needs=("vibration_g",))


def current_times_gradient(rng, places):
    def wave(scene, size):
        difference = place_temperature(scene, "coil_outer") - place_temperature(scene, "coil_inner")
        return size * (scene.inputs.current_ma / 100.0 - 1) * difference

    return Effect("source_current_times_gradient", {}, wave, needs=("source_current_mA",) + place_columns("coil"))


WAVEFORMS = {f.__name__: f for f in [
    gradient, gradient_rate, coil_lag, shupe_temperature, hysteresis, warm_up, scale_factor, scale_factor_temperature,
    scale_factor_nonlinearity, scale_factor_asymmetry, misalignment, dead_band, rate_ramp, telegraph, line,
    vibration_rectification, acceleration_sensitivity, magnetic, source_intensity, temperature_step, etalon_fringe,
    modulator_reset, clock_offset, bias_temperature, shupe]}

UNKNOWNS = {f.__name__: f for f in [
    bump, two_bumps, threshold_and_power, humidity_creep, difference_squared, rate_magnitude, field_times_temperature,
    even_field, supply, tilt_product, after_vibration, current_times_gradient]}

# What happens in one record and in no other; hidden by suites of their own.
EVENTS = {f.__name__: f for f in [bias_step]}

# Made in cases.py: spectra, the record's faults, a badly glued thermometer.
STOCHASTIC = ["quantization", "bias_instability", "rate_random_walk", "markov", "angle_random_walk"]
FAULTS = ["spikes", "saturation", "dropped_samples"]
HIDEABLE = sorted(list(WAVEFORMS) + STOCHASTIC + FAULTS + ["sensor_lag"])


def draw(name, rng, places):
    """The effect of one gyro; `places` are the probes there are."""
    return {**WAVEFORMS, **UNKNOWNS, **EVENTS}[name](rng, places)
