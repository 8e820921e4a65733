# SPDX-License-Identifier: Apache-2.0
"""Makes one case: the gyro, the strength of what is hidden, a record to diagnose and one to validate, and the truth."""
from dataclasses import dataclass, field, replace

import numpy as np

import effects
import gyro
import hardships
import noise
import profiles
import suites
import thermal

AXES = "xyz"
DISTANCE_RANGE = (8.0, 40.0)      # of the whitened, projected effect; log-uniform
MISFIT_LIMIT = 1.5                # of what the factory's equations can't follow in the known effects
LARGEST_OVERLAP = 0.6             # of an unknown effect with any one of the catalogue, of two hidden ones
OPTIONAL = ["magnetic", "acceleration", "vibration_g", "source_current_mA", "supply_V", "cross_reference"]
OPTIONAL_MISSING = 0.12           # probability that a column group no hidden effect needs is missing


class Redraw(Exception):
    """This draw can't be a case of its class; take the next one."""


@dataclass
class Hidden:
    """A hidden effect at its strength."""
    effect: effects.Effect
    size: float
    distance: float
    distance_kind: str
    variance: np.ndarray = None   # stochastic: per cosine, at this size


@dataclass
class Case:
    """Everything of one case; records as columns of equal length."""
    model: dict
    fit: dict
    validation: dict
    truth: dict = field(default_factory=dict)


@dataclass
class Gyro:
    """One specimen."""
    axis: int
    places: list
    body: thermal.ThermalBody
    thermometers: dict
    base: gyro.Base
    levels: noise.NoiseLevels
    missing: set
    static: bool


# --- strength -----------------------------------------------------------------------------------------------

def target_distance(rng):
    return float(np.exp(rng.uniform(*np.log(DISTANCE_RANGE))))


def solve_size(distance_of, target, start):
    """Size at which a growing distance reaches the target, by steps in logarithms."""
    size = start
    for _ in range(25):
        found = distance_of(size)
        if found <= 0:
            size *= 4
        elif abs(found / target - 1) < 1e-3:
            break
        else:
            size *= (target / found)**0.8
    return size


SMALL_START = {"scale_factor": 1e-6, "scale_factor_temperature": 1e-7, "misalignment": 1e-6, "dead_band": 0.3}


def size_waveform(effect, scene, whitener, basis, target, rng):
    if effect.name == "telegraph":
        return size_telegraph(effect, scene, whitener, basis, target)
    if effect.name == "clock_offset":
        target *= 10 ** rng.uniform(0, 1)  # a millisecond is far above what such a record shows
    sign = float(rng.choice([-1.0, 1.0])) if effect.name != "dead_band" else 1.0
    if effect.linear:
        unit = whitener.distance(effect.wave(scene, 1.0), basis)
        if unit < 1e-6:
            raise Redraw("the record doesn't excite it")
        return Hidden(effect, sign * target / unit, target, "waveform")
    start = SMALL_START[effect.name]
    size = solve_size(lambda a: whitener.distance(effect.wave(scene, sign * a), basis), target, start)
    found = whitener.distance(effect.wave(scene, sign * size), basis)
    return Hidden(effect, sign * size, found, "waveform")


def size_telegraph(effect, scene, whitener, basis, target):
    """Equivalent d: log-likelihood of the waveform less ln(n e/m) nats for each of the m switches at n 10 s places."""
    wave = effect.wave(scene, 1.0)
    switches = int(np.count_nonzero(np.diff(wave)))
    if switches < 8:
        raise Redraw("telegraph that hardly switches")
    cost = switches * (np.log(len(wave) / 10 / switches) + 1)
    unit = whitener.distance(wave, basis)
    size = np.sqrt(target**2 + 2 * cost) / unit
    return Hidden(effect, size, target, "log-likelihood of the waveform less the cost of its switches")


# Beyond these nobody would call the gyro one of its class: arcsec, deg/h, deg/h^1.5, deg/h.
LARGEST_STOCHASTIC = {"quantization": 20.0, "bias_instability": 0.5, "rate_random_walk": 1.0, "markov": 0.5}


def stochastic_density(name, shape, f):
    return {"quantization": lambda: noise.rounding_density(f),
            "bias_instability": lambda: noise.flicker_density(f),
            "rate_random_walk": lambda: noise.walk_density(f),
            "markov": lambda: noise.lorentz_density(f, shape["correlation_s"]),
            "angle_random_walk": lambda: noise.white_density(f)}[name]()


def size_stochastic(name, levels, target, rng, n):
    """Equivalent d = sqrt(2 L), L the expected Whittle log-likelihood ratio against the best refit of the noise the
    model lists; for white noise above the listed one, against the listed one."""
    f = noise.cosine_frequencies(n)
    base = noise.density(levels, f)
    shape = {"correlation_s": 10**rng.uniform(np.log10(10), np.log10(300))} if name == "markov" else {}
    unit = stochastic_density(name, shape, f)
    effect = effects.Effect(name, shape, None, removable=False)
    kind = "expected Whittle log-likelihood ratio"
    if name == "angle_random_walk":
        factor = rng.uniform(1.25, 2.5)
        extra = levels.n_deg_per_sqrt_h * np.sqrt(factor**2 - 1)
        ratio = 1 + extra**2 * unit / base
        distance = np.sqrt(np.sum(ratio - 1 - np.log(ratio)))
        return Hidden(effect, extra, float(distance), kind, extra**2 * unit)
    parts = [levels.n_deg_per_sqrt_h**2 * noise.white_density(f)]
    if levels.b_deg_h > 0:
        parts.append(levels.b_deg_h**2 * noise.flicker_density(f))
    if levels.k_deg_per_h_1_5 > 0:
        parts.append(levels.k_deg_per_h_1_5**2 * noise.walk_density(f))

    def distance_of(size):
        return np.sqrt(2 * noise.log_likelihood_gain(base + size**2 * unit, parts))

    low, high = np.log(np.sqrt(np.min(base / unit))) - 3, np.log(LARGEST_STOCHASTIC[name])
    if distance_of(np.exp(high)) < target:
        raise Redraw(f"{name} can't reach d {target:.1f}")
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if distance_of(np.exp(middle)) < target else (low, middle)
    size = float(np.exp(high))
    return Hidden(effect, size, float(distance_of(size)), kind, size**2 * unit)


def size_spikes(target, white_deg_h, rng, n):
    """Equivalent d: sum over spikes of (height²/2 - ln n) nats, height in standard deviations of a second."""
    count = int(rng.integers(5, 25))
    heights = 5 + rng.exponential(1.0, count)

    def distance_of(height_scale):
        return np.sqrt(2 * np.sum(np.maximum(0, (height_scale * heights)**2 / 2 - np.log(n))))

    scale = max(1.0, solve_size(distance_of, target, 1.0))
    law = {"count": count, "mean_height_sigma": float(scale * heights.mean())}

    def wave(scene, size):
        out = np.zeros(len(scene.inputs))
        rng_here = scene.random("spikes")
        at = rng_here.choice(np.flatnonzero(scene.inputs.powered), count, replace=False)
        out[at] = rng_here.choice([-1, 1], count) * heights * size
        return out

    effect = effects.Effect("spikes", law, wave, removable=False)
    return Hidden(effect, scale * white_deg_h, float(distance_of(scale)), "heights less the cost of their places")


def size_saturation(scene, rng):
    """The limit is such that 50 to 500 seconds are clipped, by far more than the noise."""
    rate = np.sort(np.abs(scene.rate[scene.inputs.powered]))
    clipped = int(rng.integers(50, 500))
    limit = 0.999 * rate[-clipped]
    effect = effects.Effect("saturation", {"limit_deg_h": float(limit)}, None, removable=False, needs=("reference",))
    return Hidden(effect, float(limit), float(np.sqrt(clipped) * 10), "ten for each root of a clipped second")


def size_dropped(target):
    """d = root of the missing rows: the time stamps show each of them."""
    effect = effects.Effect("dropped_samples", {"rows": int(round(target**2))}, None, removable=False)
    return Hidden(effect, float(round(target**2)), target, "root of the missing rows")


def size_sensor_lag(specimen, scene, whitener, basis, target):
    """The thermometer the bias is calibrated on gets a second lag."""
    place = specimen.base.bias_place
    thermometer = specimen.thermometers[place]

    def wave(at, lag_s):
        here = thermometer.shown(at.temperatures)
        lagged = thermal.first_order_lag(here, lag_s)
        return specimen.base.bias_curve(here) - specimen.base.bias_curve(lagged)

    lag_s = solve_size(lambda lag: whitener.distance(wave(scene, lag), basis), target, 60.0)
    if lag_s > 500:
        raise Redraw("thermometer slower than any")
    effect = effects.Effect("sensor_lag", {"place": place}, wave, linear=False, needs=("temperature_" + place,))
    return Hidden(effect, lag_s, whitener.distance(wave(scene, lag_s), basis), "waveform")


# --- the specimen -------------------------------------------------------------------------------------------

def draw_places(rng):
    chance = rng.random()
    if chance < 0.85:
        return ["coil_outer", "coil_inner", "board"]
    if chance < 0.92:
        return ["coil_outer", "coil_inner"]
    return ["coil_outer", "board"]


def draw_specimen(rng, names):
    places = draw_places(rng)
    missing = {column for column in OPTIONAL if rng.random() < OPTIONAL_MISSING}
    static = bool(rng.random() < 0.1)
    return Gyro(axis=int(rng.integers(3)) if rng.random() < 0.1 else 0, places=places, body=thermal.draw_body(rng),
                thermometers=gyro.draw_thermometers(rng, places), base=gyro.draw_base(rng, places, names),
                levels=gyro.draw_levels(rng, names), missing=missing, static=static)


INPUT_COLUMNS = {"reference", "cross_reference", "magnetic", "acceleration", "vibration_g", "source_current_mA"}


def provide(specimen, needs):
    """The columns a hidden effect can be named from are there; all others may be missing."""
    for column in needs:
        specimen.missing.discard(column)
        if column in INPUT_COLUMNS and specimen.static:
            raise Redraw("needs inputs that this record doesn't apply")
        if column.startswith("temperature_") and column.removeprefix("temperature_") not in specimen.places:
            raise Redraw(f"{column} is missing")


def make_scene(specimen, rng, low, high, static=None, second_power_on=True, seconds=profiles.DURATION_S,
               rest_or_fast=False, slow=False):
    inputs = profiles.draw_inputs(rng, low, high, n=seconds, static=specimen.static if static is None else static,
                                  second_power_on=second_power_on, rest_or_fast=rest_or_fast, slow=slow)
    return effects.Scene(inputs, thermal.solve(specimen.body, inputs.air_degc, inputs.powered), rng, specimen.axis)


def tame_misfit(specimen, scene, whitener):
    """Brings what the factory's equations can't follow below the limit; returns its d."""
    base = specimen.base
    for attempt in range(14):
        columns = gyro.model_columns(gyro.known_effects(base), scene, specimen.thermometers)
        misfit = whitener.distance(base.drift(scene), whitener.basis(list(columns.values())))
        if misfit < MISFIT_LIMIT:
            return misfit
        base.wiggle *= 0.5
        base.shupe_spread *= 0.5
        if attempt >= 3:
            base.shupe *= 0.7
        if attempt >= 6:
            base.polynomial = tuple(0.7 * a for a in base.polynomial)
    raise Redraw("the known effects can't be followed by the model's equations")


# --- rivals -------------------------------------------------------------------------------------------------

def nearest_in_catalogue(whitened, own_name, scene, whitener, basis, places, rng):
    """The catalogue's effect, of this generator's making, that explains most of the waveform: (name, share)."""
    best = ("", 0.0)
    for name in sorted(effects.WAVEFORMS):
        if name in (own_name, "telegraph", "line", "clock_offset", "hysteresis"):
            continue
        for _ in range(2):
            rival = effects.draw(name, rng, places)
            size = 1.0 if rival.linear else SMALL_START[name]
            try:
                other = whitener.projected(rival.wave(scene, size), basis)
            except KeyError:
                continue
            norm = np.linalg.norm(other) * np.linalg.norm(whitened)
            share = float((whitened @ other / norm)**2) if norm > 0 else 0.0
            if share > best[1]:
                best = (name, share)
    return {"name": best[0], "share": round(best[1], 4)}


# --- records ------------------------------------------------------------------------------------------------

def added(hidden):
    """Whether the waveform adds to the rate. A thermometer's lag adds nothing: what the model predicts is late."""
    return hidden.effect.wave is not None and hidden.effect.name != "sensor_lag"


def measured_rate(specimen, scene, hidden, rng):
    """Measured rate of the specimen's axis, the sum of the hidden waveforms, and the true drift beside them."""
    n = len(scene.inputs)
    drift = specimen.base.drift(scene)
    waves = [h.effect.wave(scene, h.size) if added(h) else np.zeros(n) for h in hidden]
    rate = scene.rate + drift + sum(waves, np.zeros(n)) + noise.synthesise_levels(n, specimen.levels, rng)
    for h in hidden:
        if h.effect.name in ("bias_instability", "markov"):
            shape, size, name = h.effect.shape, h.size, h.effect.name
            rate += noise.synthesise(n, lambda f: size**2 * stochastic_density(name, shape, f), rng)
        elif h.effect.name == "rate_random_walk":
            rate += noise.wiener(n, h.size, rng)
        elif h.effect.name == "angle_random_walk":
            rate += h.size * np.sqrt(noise.HOUR_S) * rng.standard_normal(n)
        elif h.effect.name == "quantization":
            # a counter of whole steps: deg/h are arcsec/s
            counts = np.floor(np.cumsum(rate) / h.size + rng.random())
            rate = np.diff(counts, prepend=np.floor(rng.random())) * h.size
            rate[0] = rate[1]
    for h in hidden:
        if h.effect.name == "saturation":
            rate = np.clip(rate, -h.size, h.size)
    return rate, waves, drift


def kept_rows(hidden, n, rng):
    """All rows but those of a record that loses bursts of them."""
    kept = np.ones(n, dtype=bool)
    for h in hidden:
        if h.effect.name == "dropped_samples":
            while np.count_nonzero(~kept) < h.size:
                at = int(rng.integers(60, n - 60))
                length = min(int(np.ceil(rng.exponential(6))), int(h.size - np.count_nonzero(~kept)))
                kept[at:at + length] = False
    return kept


def make_record(specimen, scene, rates, lags, kept, rng):
    """Columns by name, in the formats the project documents; NaN = blank."""
    inputs, n = scene.inputs, len(scene.inputs)
    record = {"time_s": float(rng.integers(0, 5000)) + np.arange(n)}
    for axis, rate in rates.items():
        record[f"rate_{AXES[axis]}_deg_h"] = np.where(inputs.powered, rate, np.nan)
    if not specimen.static:
        for axis in range(3):
            if axis in rates or "cross_reference" not in specimen.missing:
                record[f"reference_{AXES[axis]}_deg_h"] = inputs.rate_deg_h[:, axis]
    for place, thermometer in specimen.thermometers.items():
        extra = replace(thermometer, extra_lag_s=lags.get(place, 0.0))
        record[f"temperature_{place}_degC"] = extra.reading(scene.temperatures, rng)
    if "magnetic" not in specimen.missing:
        for axis in range(3):
            record[f"magnetic_{AXES[axis]}_uT"] = inputs.magnetic_ut[:, axis] + 0.1 * rng.standard_normal(n)
    if "acceleration" not in specimen.missing:
        for axis in range(3):
            record[f"acceleration_{AXES[axis]}_g"] = inputs.acceleration_g[:, axis] + 2e-4 * rng.standard_normal(n)
    if "vibration_g" not in specimen.missing:
        record["vibration_g"] = np.abs(inputs.vibration_g * (1 + 0.01 * rng.standard_normal(n)))
    if "source_current_mA" not in specimen.missing:
        record["source_current_mA"] = inputs.current_ma + 0.01 * rng.standard_normal(n)
    if "supply_V" not in specimen.missing:
        record["supply_V"] = np.where(inputs.powered, inputs.supply_v + 1e-3 * rng.standard_normal(n), 0.0)
    return {name: column[kept] for name, column in record.items()}


def minute_rms(residual, powered):
    """RMS of the means of whole minutes, those with at least half their samples."""
    n = len(residual) // 60 * 60
    held = np.where(powered, residual, 0.0)[:n].reshape(-1, 60).sum(axis=1)
    count = powered[:n].reshape(-1, 60).sum(axis=1)
    means = held[count >= 30] / count[count >= 30]
    return float(np.sqrt(np.mean(means**2)))


# --- the model file -----------------------------------------------------------------------------------------

def round_parameters(values):
    return {key: float(f"{value:.8g}") for key, value in values.items()}


def model_effects(axis, known, values, errors, levels, to_fit):
    """Entries of the model file's effect list, one axis."""
    out = [{"kind": "bias", "axis": axis, "parameters": {"bias_deg_h": values["bias", "bias_deg_h"]},
            "standard_errors": {"bias_deg_h": errors["bias", "bias_deg_h"]}}]
    for effect in known:
        entry = {"kind": effect.kind, "axis": axis}
        if effect.kind not in to_fit:
            entry["parameters"] = {p: values[effect.kind, p] for p in effect.parameters}
            entry["standard_errors"] = {p: errors[effect.kind, p] for p in effect.parameters}
            if effect.kind == "bias_temperature":
                entry["parameters"]["reference_degc"] = gyro.REFERENCE_DEGC
        if effect.inputs:
            entry["inputs"] = effect.inputs
        out.append(entry)
    out.append({"kind": "angle_random_walk", "axis": axis,
                "parameters": {"coefficient_deg_per_sqrt_h": levels.n_deg_per_sqrt_h}})
    if levels.b_deg_h > 0:
        out.append({"kind": "bias_instability", "axis": axis, "parameters": {"coefficient_deg_h": levels.b_deg_h}})
    if levels.k_deg_per_h_1_5 > 0:
        out.append({"kind": "rate_random_walk", "axis": axis,
                    "parameters": {"coefficient_deg_per_h_1_5": levels.k_deg_per_h_1_5}})
    for entry in out:
        for key in ("parameters", "standard_errors"):
            if key in entry:
                entry[key] = round_parameters(entry[key])
    return out


def listed_levels(levels, rng):
    """The factory's noise figures: white noise within some percent, the slow kinds within a sixth."""
    return noise.NoiseLevels(levels.n_deg_per_sqrt_h * np.exp(0.02 * rng.standard_normal()),
                             levels.b_deg_h * np.exp(0.15 * rng.standard_normal()),
                             levels.k_deg_per_h_1_5 * np.exp(0.15 * rng.standard_normal()))


def disturb(values, known, columns, whitener, rng):
    """One or two of the factory's parameters wrong, each by d 8 to 40 (no projection but the mean)."""
    keys = list(columns) + [("bias", "bias_deg_h")]
    changed = []
    for i in rng.permutation(len(keys))[:int(rng.integers(1, 3))]:
        key = keys[i]
        if key[0] == "bias":
            step = rng.choice([-1, 1]) * rng.uniform(0.1, 0.5)
        else:
            step = rng.choice([-1, 1]) * target_distance(rng) / whitener.distance(columns[key], whitener.basis([]))
        changed.append({"name": key[0], "parameter": key[1], "from": values[key] + step, "to": values[key]})
        values[key] += step
    return changed


# --- one case -----------------------------------------------------------------------------------------------

def size_all(names, specimen, scene, columns, levels, hard, rng):
    """Hidden effects at their strengths on the fit record: random ones first, as they make the noise."""
    n = len(scene.inputs)
    variance = noise.density(levels, noise.cosine_frequencies(n))
    hidden = {}
    for name in names:
        if name in effects.STOCHASTIC:
            hidden[name] = size_stochastic(name, levels, target_distance(rng), rng, n)
            variance = variance + hidden[name].variance
    whitener = noise.Whitener(variance)
    known_basis = whitener.basis(columns)
    drawn = {name: effects.draw(name, rng, specimen.places) for name in names
             if name in effects.WAVEFORMS or name in effects.UNKNOWNS or name in effects.EVENTS}
    if "share" in hard:
        drawn = {name: hardships.rough_form(effect, hard["share"], rng) for name, effect in drawn.items()}
    for effect in drawn.values():
        provide(specimen, effect.needs)
    units = {name: e.wave(scene, 1.0 if e.linear else SMALL_START.get(e.name, 1.0)) for name, e in drawn.items()}
    for name in names:
        if name in hidden:
            continue
        basis = known_basis
        others = [unit for other, unit in units.items() if other != name]
        if others and name in units:
            alone = whitener.distance(units[name], known_basis)
            basis = whitener.basis(list(columns) + others)
            if whitener.distance(units[name], basis)**2 < (1 - LARGEST_OVERLAP) * alone**2:
                raise Redraw("two effects that look alike")
        target = hard.get("distance") or target_distance(rng)
        if name == "spikes":
            hidden[name] = size_spikes(target, levels.n_deg_per_sqrt_h * 60, rng, n)
        elif name == "saturation":
            hidden[name] = size_saturation(scene, rng)
        elif name == "dropped_samples":
            hidden[name] = size_dropped(target)
        elif name == "sensor_lag":
            hidden[name] = size_sensor_lag(specimen, scene, whitener, basis, target)
        else:
            hidden[name] = size_waveform(drawn[name], scene, whitener, basis, target, rng)
    return [hidden[name] for name in names], whitener, known_basis


def hidden_truth(h, axis, wave):
    shape = {k: (round(v, 6) if isinstance(v, float) else v) for k, v in h.effect.shape.items()}
    return {"name": h.effect.name, "axis": AXES[axis], "d": round(h.distance, 3), "d_kind": h.distance_kind,
            "rms_deg_h": float(f"{np.std(wave):.6g}"), "size": float(f"{h.size:.6g}"),
            "removable": h.effect.removable, "shape": shape}


def try_case(kind, names, hard, rng):
    hidden_names = [] if kind == "null" else list(names)
    if names == ["model_noise"]:
        hidden_names = ["angle_random_walk"]
    specimen = draw_specimen(rng, hidden_names)
    if "saturation" in hidden_names:
        specimen.static = False
    low, high = rng.uniform(-8, 8), rng.uniform(34, 50)
    asked = {key: hard[key] for key in ("seconds", "rest_or_fast", "slow") if key in hard}
    # another profile, a little inside the first one's temperatures: nothing is extrapolated, but where both are slow
    inside, elsewhere = ((low, high), None) if "slow" not in hard else hardships.slow_ranges(rng, low, high)
    fit = make_scene(specimen, rng, *inside, **asked)
    check = make_scene(specimen, rng, *(elsewhere or (low + rng.uniform(0, 3), high - rng.uniform(0, 3))),
                       second_power_on=bool(rng.random() < 0.7), **asked)
    factory = make_scene(specimen, rng, low, high, static=False, second_power_on=False)
    levels = specimen.levels
    n = len(fit.inputs)
    base_whitener = noise.Whitener(noise.density(levels, noise.cosine_frequencies(n)))
    if specimen.static:
        specimen.base.scale = 0.0
    misfit = tame_misfit(specimen, fit, base_whitener)
    if elsewhere:
        tame_misfit(specimen, check, base_whitener)
    known = gyro.known_effects(specimen.base)
    columns = gyro.model_columns(known, fit, specimen.thermometers)
    if "sensor_lag" in hidden_names and specimen.base.bias_place is None:
        raise Redraw("no bias to lag")
    hidden, whitener, basis = size_all(hidden_names, specimen, fit, list(columns.values()), levels, hard, rng)

    values, errors = gyro.calibrate(specimen.base, known, factory, specimen.thermometers, levels, rng)
    recalibrated = []
    if names == ["recalibration"]:
        recalibrated = disturb(values, known, columns, base_whitener, rng)
    can_fit = [k.kind for k in known if k.kind in ("shupe", "scale_factor") and
               k.kind not in [r["name"] for r in recalibrated]]
    to_fit = [str(rng.choice(can_fit))] if can_fit and rng.random() < 0.15 else []

    lags = {h.effect.shape["place"]: h.size for h in hidden if h.effect.name == "sensor_lag"}
    records, outcomes = [], []
    for scene in (fit, check):
        rate, waves, drift = measured_rate(specimen, scene, hidden, rng)
        rates = {specimen.axis: rate}
        records.append((scene, rates))
        shown = {place: replace(t, extra_lag_s=lags.get(place, 0.0)) for place, t in specimen.thermometers.items()}
        model = sum((values[key] * column for key, column in gyro.model_columns(known, scene, shown).items()
                     if key[0] not in to_fit), np.full(n, values["bias", "bias_deg_h"]))
        before = rate - scene.rate - model
        oracle = rate - scene.rate - drift - sum(waves, np.zeros(n))
        powered = scene.inputs.powered
        outcomes.append({"before_rms_deg_h": minute_rms(before, powered),
                         "oracle_rms_deg_h": minute_rms(oracle, powered),
                         "before_rms_no_mean_deg_h": minute_rms(before - before[powered].mean(), powered),
                         "oracle_rms_no_mean_deg_h": minute_rms(oracle - oracle[powered].mean(), powered)})

    listed = listed_levels(levels, rng)
    entries = model_effects(AXES[specimen.axis], known, values, errors, listed, to_fit)
    if rng.random() < 0.1:
        entries += add_other_axes(specimen, records, rng)
    model = {"format_version": 1, "gyro": "fibre-optic gyro", "gyro_id": f"unit_{int(rng.integers(10**6)):06d}",
             "nominal_rate_hz": 1,
             "probes": [{"name": t.name, "node": t.name, "rate_hz": 1.0 / t.every_s, "lag_s": round(t.lag_s, 2),
                         "noise_degc": round(t.noise_degc, 4), "quantisation_degc": t.step_degc}
                        for t in specimen.thermometers.values()],
             "effects": entries}
    files = [make_record(specimen, scene, rates, lags, kept_rows(hidden, n, rng), rng)
             for scene, rates in records]
    files = [hardships.after(hard.get("name"), record, hidden, rng) for record in files]
    truth = {"class": kind, "kind": names[0] if kind == "null" else "", "axis": AXES[specimen.axis],
             "effects": [hidden_truth(h, specimen.axis, h.effect.wave(fit, h.size) if h.effect.wave else np.zeros(n))
                        for h in hidden],
             "recalibrated": recalibrated, "to_fit": to_fit,
             "noise": {"N": levels.n_deg_per_sqrt_h, "B": levels.b_deg_h, "K": levels.k_deg_per_h_1_5},
             "model_misfit_d": round(misfit, 3), "static": specimen.static, "probes": specimen.places,
             "missing_columns": sorted(specimen.missing), "fit": outcomes[0], "validation": outcomes[1]}
    if names == ["model_noise"]:
        truth["recalibrated"] = [{"name": "angle_random_walk", "parameter": "coefficient_deg_per_sqrt_h",
                                  "from": listed.n_deg_per_sqrt_h,
                                  "to": float(np.hypot(levels.n_deg_per_sqrt_h, hidden[0].size))}]
        truth["effects"] = []
    if hard:
        truth["hardship"] = hard
    add_rivals(truth, hidden, fit, whitener, basis, specimen, rng)
    return Case(model, files[0], files[1] if hard.get("name") != "short" else None, truth)


def add_rivals(truth, hidden, scene, whitener, basis, specimen, rng):
    for h, entry in zip(hidden, truth["effects"]):
        if h.distance_kind != "waveform":
            continue
        whitened = whitener.projected(h.effect.wave(scene, h.size), basis)
        entry["nearest"] = nearest_in_catalogue(whitened, h.effect.name, scene, whitener, basis, specimen.places, rng)
        if truth["class"] == "unknown" and entry["nearest"]["share"] > LARGEST_OVERLAP:
            raise Redraw("an unknown effect that looks like one of the catalogue")


def add_other_axes(specimen, records, rng):
    """Two more axes in which nothing is hidden: bias, its temperature dependence and noise. Returns their entries."""
    entries = []
    for axis in range(3):
        if axis == specimen.axis:
            continue
        levels = gyro.draw_levels(rng, [])
        other = gyro.Base(bias=rng.uniform(-1, 1), bias_place="coil_outer",
                          polynomial=(rng.uniform(-0.5, 0.5), rng.uniform(-0.1, 0.1), 0.0))
        known = gyro.known_effects(other)
        scene = replace(records[0][0], axis=axis)
        n = len(scene.inputs)
        whitener = noise.Whitener(noise.density(levels, noise.cosine_frequencies(n)))
        other_specimen = replace(specimen, base=other, axis=axis, levels=levels)
        tame_misfit(other_specimen, scene, whitener)
        values, errors = gyro.calibrate(other, known, scene, specimen.thermometers, levels, rng)
        for record_scene, rates in records:
            at = replace(record_scene, axis=axis)
            rates[axis] = measured_rate(other_specimen, at, [], rng)[0]
        entries += model_effects(AXES[axis], known, values, errors, listed_levels(levels, rng), [])
    return entries


def make_case(suite, seed, index):
    """Case `index` of a suite; the same arguments give the same case."""
    kind, names, hardship = suites.entries(suite, seed)[index]
    rng = suites.case_rng(suite, seed, index)
    hard = {**hardship, **hardships.draw(hardship["name"], rng)} if hardship else {}
    for attempt in range(1, 201):
        if kind == "double" and attempt % 25 == 0:
            names = suites.draw_pair(rng)  # some pairs look alike in every gyro
        if kind == "single" and "seconds" in hard and attempt % 25 == 0:
            names = [suites.draw_single(rng, "short")]  # not everything shows in twenty minutes
        try:
            case = try_case(kind, names, hard, rng)
        except Redraw:
            continue
        case.truth.update({"case": f"case_{index:03d}", "suite": suite, "seed": seed, "index": index})
        return case
    raise RuntimeError(f"no draw of {kind} {names} fits (suite {suite}, seed {seed}, case {index})")
