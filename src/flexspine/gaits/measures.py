"""Measures of a run: forces, duty factors, stride length, energies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from flexspine.hybrid.compile import Array
from flexspine.hybrid.trajectory import Arc, HybridState
from flexspine.models.bounder import works
from flexspine.models.dataset import sample, sample_times
from flexspine.models.legs import SIDES, STANCE_PHASES
from flexspine.models.simulation import Run
from flexspine.parameters import values

# Forces are analytic within a step of the integrator and vary little there: this degree
# represents them to rounding error.
_DEGREE = 12

# Chebyshev points of the second kind hold the ends of each step; from samples there to a series.
_NODES = chebyshev.chebpts2(_DEGREE + 1)
_INTERPOLATE = np.linalg.inv(chebyshev.chebvander(_NODES, _DEGREE))

# From samples at those points to the mean: Clenshaw-Curtis quadrature.
_MEAN = np.array([0.0 if k % 2 else 1 / (1 - k**2) for k in range(_DEGREE + 1)]) @ _INTERPOLATE

# The slope of a Chebyshev series at 1; at -1 every other sign changes.
_POWERS = np.arange(_DEGREE + 1)
_SLOPES = _POWERS.astype(float) ** 2

# Of the unit interval; a root this far off the real line is no turning point.
_REAL = 1e-9

# s; shorter runs than this are sampled at their ends.
_SHORTEST_INTERVAL = 1e-9


class Work(NamedTuple):
    """What an actuator has done, in J: the sum of all it gave, and that less what it took back."""

    positive: float
    net: float


class Turn(NamedTuple):
    """A time (s) at which a quantity turns round, its value there, whether it is a least one."""

    time: float
    value: float
    least: bool


@dataclass(frozen=True)
class Summary:
    """The measures of a run. Lengths in m, times in s, forces in N per pair of legs, angles in rad.

    Those of a stride (``period`` to ``froude``) are of the last completed one, or None;
    ``duty_factor`` is by leg, ``froude`` is v^2 / (g l) with the mean speed of the stride and the
    mean rest length of the legs. Peaks by leg, ``spine_range`` (least and largest spine angle),
    ``work`` by actuator and ``cost_of_transport`` are over the whole run; the last is all positive
    work by weight and distance, None without a distance. ``energy`` has the ``initial`` one (J) and
    the ``relative_drift``: the largest change, over it, of total and dissipated energy less the
    work of actuators.
    """

    period: float | None
    stride_length: float | None
    stride_frequency: float | None
    duty_factor: dict[str, float] | None
    froude: float | None
    distance: float
    mean_speed: float | None
    peak_grf: dict[str, float]
    peak_grf_vertical: dict[str, float]
    spine_range: tuple[float, float] | None
    energy: dict[str, float | None]
    work: dict[str, Work]
    cost_of_transport: float | None


def summarize(run: Run, profile: Profile | None = None) -> Summary:
    """Measure a run of a bounder: its last stride, its forces, its energy.

    ``profile`` spares making that of the run anew.
    """
    trajectory = run.trajectory
    given = values(run.model.parameters)
    moved = float(trajectory.end.states[0] - trajectory.start.states[0])
    stride = _last_stride(run)
    period = length = froude = duty = None
    if stride is not None:
        period = stride[1].time - stride[0].time
        length = float(stride[1].states[0] - stride[0].states[0])
        leg = sum(given[f"{side}.leg.rest_length"] for side in SIDES) / 2
        froude = (length / period) ** 2 / (given["gravity"] * leg)
        duty = {side: _stance_time(run, side, *stride) / period for side in SIDES}
    profile = profile or Profile(run)
    work, weight = _work(run, profile), run.model.mass * given["gravity"]
    given_by_all = sum(each.positive for each in work.values())
    spine = None
    if "spine.stiffness" in given and trajectory.arcs:
        low, high = profile.range("spine_angle")
        spine = (low, high)
    return Summary(
        period=period,
        stride_length=length,
        stride_frequency=None if period is None else 1 / period,
        duty_factor=duty,
        froude=froude,
        distance=moved,
        mean_speed=moved / trajectory.duration if trajectory.duration > 0 else None,
        peak_grf={side: profile.range(f"{side}_grf")[1] for side in SIDES},
        peak_grf_vertical={side: profile.range(f"{side}_grf_y")[1] for side in SIDES},
        spine_range=spine,
        energy=_energy(run),
        work=work,
        cost_of_transport=given_by_all / (weight * abs(moved)) if moved else None,
    )


def _work(run: Run, profile: Profile) -> dict[str, Work]:
    """What each actuator has done, by the name of its work."""
    start, end = run.trajectory.start.states, run.trajectory.end.states
    places = run.model.system.places
    return {
        name: Work(profile.rise(name), float(end[places[symbol]] - start[places[symbol]]))
        for name, symbol in works(run.model.features).items()
    }


def _last_stride(run: Run) -> tuple[HybridState, HybridState] | None:
    points = run.section_points
    return (points[-2], points[-1]) if len(points) > 1 else None


def _stance_time(run: Run, side: str, start: HybridState, end: HybridState) -> float:
    return sum(
        min(arc.end, end.time) - max(arc.start, start.time)
        for arc in run.trajectory.arcs
        if arc.mode in STANCE_PHASES[side] and arc.end > start.time and arc.start < end.time
    )


class Profile:
    """Ranges and means of observables and states over a recorded run, to rounding error."""

    def __init__(self, run: Run) -> None:
        self._begins = [arc.times[:-1] for arc in run.trajectory.arcs]
        self._steps = [np.diff(arc.times) for arc in run.trajectory.arcs]
        self._tables = [_nodal(run, arc) for arc in run.trajectory.arcs]

    def range(self, name: str) -> tuple[float, float]:
        """Return smallest and largest value; zero for a run without length."""
        pairs = [_range(table[name]) for table in self._tables if name in table]
        if not pairs:
            return 0.0, 0.0
        return min(low for low, _ in pairs), max(high for _, high in pairs)

    def mean(self, name: str) -> float:
        """Return the mean over time, zero where there is no such quantity."""
        duration = sum(float(steps.sum()) for steps in self._steps)
        if not duration:
            return 0.0
        pairs = zip(self._steps, self._tables, strict=True)
        parts = (steps @ table[name] @ _MEAN for steps, table in pairs if name in table)
        return float(sum(parts)) / duration

    def rise(self, name: str) -> float:
        """Return the sum of all by which a state grows, at events too."""
        found, last = 0.0, None
        for table in self._tables:
            for row in table[name]:
                values_ = _turning_values(row)
                found += float(np.maximum(np.diff(values_), 0.0).sum())
                if last is not None:
                    found += max(float(values_[0]) - last, 0.0)
                last = float(values_[-1])
        return found

    def first(self, name: str) -> float:
        """Return the value at the start."""
        return float(self._tables[0][name][0, 0])

    def turns(self, name: str) -> list[Turn]:
        """Return where it turns round within arcs, in order."""
        found: list[Turn] = []
        for begin, steps, table in zip(self._begins, self._steps, self._tables, strict=True):
            for start, step, row in zip(begin, steps, table[name], strict=True):
                slopes = np.diff(row)
                if not slopes.min() < 0 < slopes.max():
                    continue
                series = _INTERPOLATE @ row
                at = _turning_points(series)
                values_ = chebyshev.chebval(at, series)
                bends = chebyshev.chebval(at, chebyshev.chebder(series, 2))
                times = start + step * (at + 1) / 2
                rows = zip(times.tolist(), values_.tolist(), (bends > 0).tolist(), strict=True)
                found += [Turn(*each) for each in rows]
        return found


def _nodal(run: Run, arc: Arc) -> dict[str, Array]:
    """Every quantity at the Chebyshev points of each step of an arc, shape (steps, points)."""
    begin, step = arc.times[:-1], np.diff(arc.times)
    times = (begin[:, None] + step[:, None] * (_NODES + 1) / 2).ravel()
    states = arc(times)
    table = dict(zip(run.model.state_names, states.T, strict=True))
    table |= run.trajectory.observe(arc, states)
    return {name: column.reshape(len(step), -1) for name, column in table.items()}


def _range(table: Array) -> tuple[float, float]:
    lows, highs = table.min(axis=1), table.max(axis=1)
    low, high = float(lows.min()), float(highs.max())
    spread = highs - lows
    for row in np.flatnonzero((highs > high - spread) & (spread > 0)):
        high = max(high, _polished(table[row], 1.0))
    for row in np.flatnonzero((lows < low + spread) & (spread > 0)):
        low = min(low, -_polished(table[row], -1.0))
    return low, high


def _turning_values(samples: Array) -> Array:
    """The values of the interpolant at its ends, and between them wherever it turns round."""
    ends = samples[[0, -1]]
    steps = np.diff(samples)
    if not (steps.min() < 0 < steps.max()):
        return ends
    between = _turns(_INTERPOLATE @ samples)
    return np.concatenate([ends[:1], between, ends[1:]])


def _turns(series: Array) -> Array:
    """The values of a Chebyshev series where it turns round, in order."""
    return np.asarray(chebyshev.chebval(_turning_points(series), series), dtype=float)


def _turning_points(series: Array) -> Array:
    """Where a Chebyshev series turns round, in order."""
    turns = chebyshev.chebroots(chebyshev.chebder(series))
    inside: Array = turns.real[(np.abs(turns.imag) < _REAL) & (np.abs(turns.real) <= 1)]
    return np.sort(inside)


def _polished(samples: Array, sign: float) -> float:
    """The largest value of ``sign`` times the interpolant of the samples."""
    series = _INTERPOLATE @ (sign * samples)
    top = int(np.argmax(sign * samples))
    largest = float(sign * samples[top])
    if top in (0, _DEGREE):
        # An end that is the largest sample, and not left upwards: the end it is.
        outward = -1.0 if top == 0 else 1.0
        if outward * (_SLOPES * outward ** (_POWERS + 1)) @ series >= 0:
            return largest
    return float(max([*_turns(series), largest]))


def _energy(run: Run) -> dict[str, float | None]:
    if not run.trajectory.arcs:
        return {"initial": None, "relative_drift": None}
    interval = max(run.trajectory.duration / 1000, _SHORTEST_INTERVAL)
    table = sample(run, sample_times(run.trajectory, interval))
    balance = table["total_energy"] + table["dissipated_energy"]
    for name in works(run.model.features):
        balance = balance - table[name]
    initial = float(balance[0])
    drift = float(np.max(np.abs(balance - initial)))
    return {"initial": initial, "relative_drift": drift / abs(initial) if initial else None}
