# SPDX-License-Identifier: Apache-2.0
"""Heat in the gyro: the heat equation through the coil by finite volumes, and the thermometers.

The coil is a slab across its winding (depth 0 = outer layer, 1 = inner layer) whose outer face touches the
case and whose inner face leaks some heat to the board; the case exchanges heat with the chamber's air.
Crank-Nicolson in time, one step a second. Temperatures in °C, times in s.
"""
from dataclasses import dataclass

import numpy as np

CELLS = 20


@dataclass
class ThermalBody:
    """Time constants in seconds say all; capacities are relative to the coil's (1)."""
    coil_diffusion_s: float = 300.0  # L²/(pi² alpha) of the coil
    contact_s: float = 300.0         # coil's capacity over the conductance case - outer face
    case_s: float = 400.0            # case's capacity over the conductance air - case
    board_s: float = 250.0           # board's capacity over the conductance case - board
    case_capacity: float = 2.5
    board_capacity: float = 0.35
    board_rise_degc: float = 6.0     # of the powered board above the case, steady state
    inner_leak: float = 0.2          # conductance inner face - board over that of case - outer face


def draw_body(rng):
    """A body of the size of a fist; each unit differs."""
    return ThermalBody(coil_diffusion_s=rng.uniform(300, 900), contact_s=rng.uniform(150, 400),
                       case_s=rng.uniform(250, 600), board_s=rng.uniform(120, 400),
                       case_capacity=rng.uniform(1.5, 4), board_rise_degc=rng.uniform(3, 9),
                       inner_leak=rng.uniform(0.1, 0.6))


def slab_laplacian(cells, diffusion_s):
    """Conductances between neighbouring cells of an insulated slab of capacity 1, as the matrix of dT/dt.

    dT_i/dt = (alpha/dx²)(T_(i-1) - 2 T_i + T_(i+1)) with alpha/L² = 1/(pi² diffusion_s).
    """
    exchange = cells**2 / (np.pi**2 * diffusion_s)
    laplacian = np.zeros((cells, cells))
    for i in range(cells - 1):
        laplacian[i, i] -= exchange
        laplacian[i, i + 1] += exchange
        laplacian[i + 1, i + 1] -= exchange
        laplacian[i + 1, i] += exchange
    return laplacian


def stepper(jacobian, sources, interval_s):
    """Crank-Nicolson of dT/dt = J T + S u: T' = A T + B (u + u')/2."""
    identity = np.eye(len(jacobian))
    left = np.linalg.inv(identity - 0.5 * interval_s * jacobian)
    return left @ (identity + 0.5 * interval_s * jacobian), left @ (interval_s * sources)


def integrate(jacobian, sources, inputs, initial, interval_s):
    """States at every sample, shape (n, states); `inputs` has shape (n, number of sources)."""
    advance, drive = stepper(jacobian, sources, interval_s)
    pushed = np.empty((len(inputs), len(jacobian)))
    pushed[0] = 0.0
    pushed[1:] = 0.5 * (inputs[1:] + inputs[:-1]) @ drive.T
    states = np.empty_like(pushed)
    state = np.array(initial, dtype=float)
    states[0] = state
    for k in range(1, len(inputs)):
        state = advance @ state + pushed[k]
        states[k] = state
    return states


def body_equations(body):
    """J and S of the whole body: states case, coil cells outer to inner, board; inputs air, board power."""
    coil = slice(1, 1 + CELLS)
    board = CELLS + 1
    jacobian = np.zeros((CELLS + 2, CELLS + 2))
    jacobian[coil, coil] = slab_laplacian(CELLS, body.coil_diffusion_s)
    capacity = np.full(CELLS + 2, 1.0 / CELLS)
    capacity[0] = body.case_capacity
    capacity[board] = body.board_capacity
    face = 1.0 / body.contact_s
    board_to_case = body.board_capacity / body.board_s

    def couple(i, j, conductance):
        jacobian[i, i] -= conductance / capacity[i]
        jacobian[i, j] += conductance / capacity[i]
        jacobian[j, j] -= conductance / capacity[j]
        jacobian[j, i] += conductance / capacity[j]

    couple(0, 1, face)
    couple(CELLS, board, face * body.inner_leak)
    couple(0, board, board_to_case)
    sources = np.zeros((CELLS + 2, 2))
    jacobian[0, 0] -= 1.0 / body.case_s
    sources[0, 0] = 1.0 / body.case_s
    sources[board, 1] = board_to_case * body.board_rise_degc / capacity[board]
    return jacobian, sources, capacity


@dataclass
class Temperatures:
    """True temperatures at each second."""
    coil: np.ndarray   # (n, CELLS), outer to inner
    board: np.ndarray  # (n,)

    def at_depth(self, depth):
        """Coil temperature at a depth of 0 (outer face) to 1 (inner face)."""
        position = np.clip(depth * CELLS - 0.5, 0, CELLS - 1)
        low = min(int(position), CELLS - 2)
        part = position - low
        return (1 - part) * self.coil[:, low] + part * self.coil[:, low + 1]

    def weighted(self, weight):
        """Integral of weight(depth) T(depth) over depth; the weights are given per cell."""
        return self.coil @ weight / CELLS


def solve(body, air_degc, powered):
    """Temperatures of a gyro that has taken on the air's first temperature before it is powered on."""
    jacobian, sources, _ = body_equations(body)
    inputs = np.column_stack([air_degc, powered.astype(float)])
    states = integrate(jacobian, sources, inputs, np.full(len(jacobian), air_degc[0]), 1.0)
    return Temperatures(coil=states[:, 1:1 + CELLS], board=states[:, CELLS + 1])


def hub_mean(face_degc, slowest_s, interval_s=10):
    """Mean temperature of a hub behind the inner face: a slab of its own, insulated at its far side.

    Its slowest mode has the time constant slowest_s = 4 L²/(pi² alpha). The hub's own heat does not flow back.
    """
    cells = 12
    diffusion_s = slowest_s / 4.0
    jacobian = slab_laplacian(cells, diffusion_s)
    at_face = 2 * cells**2 / (np.pi**2 * diffusion_s)
    jacobian[0, 0] -= at_face
    sources = np.zeros((cells, 1))
    sources[0, 0] = at_face
    coarse = face_degc[::interval_s, None]
    states = integrate(jacobian, sources, coarse, np.full(cells, face_degc[0]), float(interval_s))
    return np.interp(np.arange(len(face_degc)), np.arange(0, len(face_degc), interval_s), states.mean(axis=1))


def first_order_lag(values, lag_s):
    """What a thermometer of this lag shows, one sample a second, in equilibrium at the start."""
    if lag_s <= 0:
        return values.copy()
    keep = np.exp(-1.0 / lag_s)
    shown = np.empty_like(values)
    level = values[0]
    for k, value in enumerate(values.tolist()):
        level = value + (level - value) * keep
        shown[k] = level
    return shown


@dataclass
class Thermometer:
    """Where a probe sits and what it adds."""
    name: str
    depth: float          # in the coil; negative: on the board
    lag_s: float
    noise_degc: float
    step_degc: float
    every_s: int          # seconds between readings
    extra_lag_s: float = 0.0  # glued badly: a second lag behind the first

    def true(self, temperatures):
        return temperatures.board if self.depth < 0 else temperatures.at_depth(self.depth)

    def shown(self, temperatures):
        """Without noise and rounding."""
        lagged = first_order_lag(self.true(temperatures), self.lag_s)
        return first_order_lag(lagged, self.extra_lag_s)

    def reading(self, temperatures, rng):
        """As recorded: noise, then rounding; NaN between readings."""
        shown = self.shown(temperatures)
        noisy = shown + self.noise_degc * rng.standard_normal(len(shown))
        rounded = np.round(noisy / self.step_degc) * self.step_degc
        rounded[np.arange(len(shown)) % self.every_s != 0] = np.nan
        return rounded
