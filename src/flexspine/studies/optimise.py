"""The best gaits at a speed, with a spine of one stiffness and with one of a stiffness by phase.

Best is what a Pareto front has: gaits of which none is better in both of two objectives. Every gait
with a constant stiffness is one with a stiffness by phase as well, so that front is never worse.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexspine._version import __version__
from flexspine.errors import FlexspineError, InputError, ParameterError, UnknownNameError
from flexspine.gaits.continuation import trace_branch
from flexspine.gaits.gait import Gait
from flexspine.gaits.gait_record import gait_record
from flexspine.gaits.search import find_gaits
from flexspine.models.actuation import ACTUATORS, SPINE_SHIFTS, STRIDE_PHASES
from flexspine.models.simulation import check_count
from flexspine.parameters import check_seed, check_whole, is_number
from flexspine.studies.design import Design, Ranges
from flexspine.studies.following import SAME, STEP
from flexspine.studies.frontier import Found, Frontier
from flexspine.studies.objectives import COST, OBJECTIVES, PEAK_GRF
from flexspine.studies.pareto import Front, certify, told
from flexspine.studies.rounds import Progress, Rounds
from flexspine.workers.local import LocalWorkers

CONSTANT, BY_PHASE = "constant", "by phase"
SPINES = (CONSTANT, BY_PHASE)

# What varies, SI. The least damping is a percent of the critical one of the published spine, as
# without any a passive gait costs nothing.
RANGES: Ranges = {
    "spine.stiffness": (100.0, 1000.0),
    "spine.damping": (0.2, 2.0),
    "legs.extension": (0.0, 0.05),
}

# By which share of itself stiffness may differ from that around the apex, in other phases.
SHIFT = (-0.5, 0.5)

MINIMISED = (PEAK_GRF, COST)
POINTS, DRAWS = 12, 12

# How many gaits of one random design are followed up: all of the few that vary little.
FOLLOWED = {CONSTANT: 12, BY_PHASE: 3}

# Limits from least to most are set by factors where they are further apart than this factor.
WIDE = 10.0


class NoGaitError(FlexspineError):
    """There is no gait of the kind that was asked for. Exit code 1."""

    code = "no_gait"


@dataclass(frozen=True)
class Optimisation:
    """Pareto fronts of gaits, by kind of spine: ``constant`` stiffness and stiffness ``by phase``.

    ``reference`` is the given gait, carried to the speed. Of the two objectives in ``minimise``
    the second one had limits. ``ranges`` are what was varied, low and high (SI) by name, by kind of
    spine. The ``points`` of each of the ``fronts`` are gaits with their stability, in order of the
    second objective.
    """

    reference: Gait
    minimise: tuple[str, str]
    ranges: Mapping[str, Ranges]
    seed: int
    fronts: Mapping[str, Front]

    @property
    def told(self) -> str | None:
        """What stiffness by phase buys, in a sentence; None if there is one front only."""
        if len(self.fronts) < len(SPINES):
            return None
        return told(self.fronts[CONSTANT], self.fronts[BY_PHASE])


def optimise(
    gait: Gait,
    speed: float | None = None,
    *,
    minimise: Sequence[str] = MINIMISED,
    ranges: Ranges = RANGES,
    shift: tuple[float, float] = SHIFT,
    spines: Sequence[str] = SPINES,
    points: int = POINTS,
    draws: int = DRAWS,
    seed: int = 0,
    store: str | Path | None = None,
    processes: int = 1,
    progress: Progress | None = None,
) -> Optimisation:
    """Find the gaits at a mean speed that are best in two objectives, with both kinds of spines.

    ``speed`` is in m/s, by default the gait's own. ``minimise`` names the objectives: two of
    ``peak_grf``, ``cost_of_transport`` and ``spectral_radius``. ``ranges`` are low and high (SI) of
    parameters, and of what else need not stay as it is in the gait: ``energy``, ``height`` and
    other apex coordinates, touchdown angles. ``shift`` is how far the stiffness may differ in other
    phases from that around the apex, relative. ``spines`` are the kinds to do. ``points`` are
    limits of the second objective for which the least first one is looked for, ``draws`` random
    designs to start from besides the given gait. ``store`` is a file that keeps every finished
    piece: the same call goes on from it. The same seed finds the same fronts, whatever
    ``processes``. ``progress`` is told what is done and which share of it, 0 to 1. By the epsilon
    constraint method: Haimes, Lasdon, Wismer 1971. Raises `InputError`, and `NoGaitError` where
    there is no gait to start from.
    """
    check_count("points", points)
    _check(minimise, spines, draws, seed)
    pair = minimise[0], minimise[1]
    reference = at_speed(gait, speed, ranges)
    # In one order, whoever gave them, as unknowns are in theirs.
    varied = {CONSTANT: dict(sorted(ranges.items()))}
    varied[BY_PHASE] = {**varied[CONSTANT], **by_phase(shift)}
    designs = {
        spine: Design(reference.model, varied[spine], reference.tolerance)
        for spine in SPINES
        if spine in spines
    }
    about = {
        "flexspine": __version__,
        "gait": gait_record(reference),
        "minimise": pair,
        "ranges": {spine: design.ranges for spine, design in designs.items()},
        "points": points,
        "draws": draws,
        "seed": seed,
    }
    with LocalWorkers(check_count("processes", processes)) as crew:
        rounds = Rounds(crew, None if store is None else Path(store), about, progress)
        frontiers = [Frontier(spine, designs[spine], pair, rounds) for spine in designs]
        found = _search(frontiers, points, draws, seed)
    fronts = {}
    for (spine, design), best in zip(designs.items(), found, strict=True):
        if progress is not None:
            progress(f"{spine}: certifying", 0.0)
        models = [design.animal(np.array(each.point)) for each in best]
        certified = [certify(model, reference.tolerance) for model in models]
        fronts[spine] = Front.of(spine, pair, certified)
    if not any(front.points for front in fronts.values()):
        raise NoGaitError(
            "no gait could be led to where all that varies is in its range",
            "give wider ranges, more draws, or another gait to start from",
        )
    return Optimisation(reference, pair, {spine: varied[spine] for spine in designs}, seed, fronts)


def by_phase(shift: tuple[float, float]) -> Ranges:
    """Ranges of the stiffness in all phases but the flight around the apex, which has its own."""
    return {f"spine.stiffness_shift.{phase}": shift for phase in STRIDE_PHASES[1:]}


def at_speed(gait: Gait, speed: float | None, ranges: Ranges) -> Gait:
    """A gait carried to a mean speed; if it ends before, another one of its energy and height.

    Raises `ParameterError` and `NoGaitError`.
    """
    if gait.flaw is not None:
        raise ParameterError(f"there is no gait to start from: {gait.flaw}", "find one first")
    if speed is None or abs(speed - gait.mean_speed) <= SAME * abs(speed):
        return gait
    if not (is_number(speed) and speed > 0):
        raise ParameterError(f"speed = {speed} is not usable", "give a number above zero")
    actuators = [name for name in ranges if name in ACTUATORS and name not in SPINE_SHIFTS]
    free = [] if gait.model.features.conservative else actuators[:1]
    bounds = min(speed, gait.mean_speed), max(speed, gait.mean_speed)
    branch = trace_branch(gait, bounds=bounds, free=free, longest_step=STEP)
    met = [point.gait for point in branch.at(speed)]
    if not met and not free:
        met = list(find_gaits(gait.model, {**gait.quantities, "mean_speed": speed}))
    if not met:
        end = branch.ends[speed > gait.mean_speed]
        raise NoGaitError(f"no gait at {speed:g} m/s: {end}", "try another speed, energy or height")
    return met[0]


def _check(minimise: Sequence[str], spines: Sequence[str], draws: int, seed: int) -> None:
    for name in minimise:
        if name not in OBJECTIVES:
            raise UnknownNameError("objective", name, OBJECTIVES)
    if len(minimise) != 2 or minimise[0] == minimise[1]:
        raise InputError("a front is one of two objectives", "minimise two different ones")
    for name in spines:
        if name not in SPINES:
            raise UnknownNameError("kind of spine", name, SPINES)
    check_whole("draws", draws, 0)
    check_seed(seed)


def _search(frontiers: Sequence[Frontier], points: int, draws: int, seed: int) -> list[list[Found]]:
    """The gaits of all fronts. Each kind of spine hands on what it knows.

    A constant stiffness is one by phase too, and next to a gait with a stiffness by phase there may
    be one with a constant stiffness.
    """
    for frontier in frontiers:
        frontier.begin(draws, seed, FOLLOWED[frontier.name])
        frontier.ends(frontier.starts)
    narrow, wide = frontiers[0], frontiers[-1]
    if narrow is not wide:
        narrow.ends(wide.restricted(narrow.design, wide.known))
        wide.ends(wide.learn(narrow, narrow.extremes))
    spans = [frontier.span for frontier in frontiers if frontier.known]
    if not spans:
        return [[] for _ in frontiers]
    common = _spaced(*spans[0], points)
    wide.within(_around(common, wide.span, points))
    if narrow is wide:
        return [wide.bests(common)]
    narrow.within(common, wide.restricted(narrow.design, wide.bests(common)))
    best = narrow.bests(common)
    wide.learn(narrow, best)
    limits = _around([found.values[1] for found in best] or common, wide.span, points)
    wide.within(limits)
    # The same in the other direction, to compare at equal values of either objective.
    others = [found.values[0] for found in best] or [wide.extremes[0].values[0]]
    wide.within(others, goal=1)
    return [best, list(dict.fromkeys([*wide.bests(limits), *wide.bests(others, goal=1)]))]


def _around(common: list[float], span: tuple[float, float], points: int) -> list[float]:
    """The same limits, and more of them where a front reaches further."""
    low, high = span
    below = _spaced(low, common[0], 1 + points // 4)[:-1] if low < common[0] else []
    above = _spaced(common[-1], high, 1 + points // 2)[1:] if high > common[-1] else []
    return [*below, *common, *above]


def _spaced(low: float, high: float, count: int) -> list[float]:
    """Limits from low to high."""
    if not low < high or count == 1:
        return [high]
    if low > 0 and high > WIDE * low:
        return [*np.geomspace(low, high, count).tolist()]
    return [*np.linspace(low, high, count).tolist()]
