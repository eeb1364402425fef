"""The numbers of a walk in space, found by a seeded search.

Many walks are drawn over the ranges of their numbers (a scrambled Sobol sequence), the best of them
are varied by normal deviates that get narrower from round to round (an evolution strategy with
elite parents). What is least is `cost`: falls first, then what a walk is off the wanted speed, what
it takes, how hard feet hit, how much it rolls and turns.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from flexspine._version import __version__
from flexspine.control.cpg import RHYTHMS
from flexspine.control.gains import Gains, Walk
from flexspine.engines.space_measures import SpaceSummary, summarize_space
from flexspine.engines.space_run import SpaceRun, run_in_space
from flexspine.errors import FlexspineError, ParameterError, UnknownNameError
from flexspine.hybrid.compile import Array
from flexspine.models.model import Source, check_between
from flexspine.models.robot import Robot
from flexspine.models.simulation import check_count
from flexspine.models.space import SpaceRobot
from flexspine.parameters import build, values
from flexspine.studies.rounds import Progress, Rounds
from flexspine.workers.local import LocalWorkers

# What is drawn, SI.
RANGES: dict[str, tuple[float, float]] = {
    "gait.speed": (0.1, 1.2),
    "gait.frequency": (1.0, 3.5),
    "gait.duty": (0.35, 0.7),
    "gait.height": (0.28, 0.37),
    "gait.clearance": (0.01, 0.07),
    "gait.lag": (0.35, 0.65),
    "gait.hind_ahead": (-0.06, 0.06),
    "gait.fore_ahead": (-0.06, 0.06),
    "gait.readiness": (1.0, 6.0),
    "servo.stiffness": (100.0, 400.0),
    "servo.damping": (0.8, 2.2),
}

# What is not.
KEPT = {"servo.out_stiffness": 200.0, "servo.out_damping": 1.5}

# A trot's pairs are half a stride apart.
TIED = {"trot": {"gait.lag": 0.5}}

# s, rad: how long walks are tried, and how badly joints are read off, so that no walk is taken that
# a little noise ends.
SECONDS, SENSING = 8.0, 0.005

DRAWS, ROUNDS, CHILDREN, PARENTS = 128, 6, 24, 6

# Of the ranges: how far children are from their parents in the first round and in the last.
WIDTHS = 0.15, 0.02

# More than any walk that does not fall.
FALL = 1000.0

# m/s; slower walks are compared with this much.
SLOWEST = 0.05


class NoWalkError(FlexspineError):
    """No walk lasts. Exit code 1."""

    code = "no_gait"


@dataclass(frozen=True)
class Tuning:
    """What a search for the numbers of a walk has found.

    ``walk`` is the best one, with its ``run``, its ``summary`` and its ``cost``; ``history`` are
    the least costs after the first draws and after every round. ``tried`` walks were tried,
    ``lasting`` of them did not fall.
    """

    walk: Walk
    run: SpaceRun
    summary: SpaceSummary
    cost: float
    history: tuple[float, ...]
    tried: int
    lasting: int


def cost(summary: SpaceSummary, lasted: float, wanted: float, weight: float) -> float:
    """What is to be least of a walk that should go at a ``wanted`` speed (m/s).

    ``lasted`` is the share of its time after which it fell. The terms: ten times the relative error
    of the speed, the cost of transport, the peak normal force per weight, the mean impact per
    weight, and ten times each of roll (rad), turn (rad/s) and tracking error (rad).
    """
    known = (
        summary.speed, summary.cost_of_transport, summary.peak_normal, summary.impact,
        summary.roll, summary.turning, summary.error,
    )  # fmt: skip
    if None in known:
        return FALL * (2 - lasted)
    speed, transport, peak, impact, roll, turning, error = (float(each or 0.0) for each in known)
    off = abs(speed - wanted) / max(abs(wanted), SLOWEST)
    total = (
        10 * (off + roll + abs(turning) + error) + min(transport, 50.0) + (peak + impact) / weight
    )
    return min(total, FALL)


def tune(
    robot: Robot,
    rhythm: str,
    speed: float = 0.4,
    *,
    seconds: float = SECONDS,
    draws: int = DRAWS,
    rounds: int = ROUNDS,
    children: int = CHILDREN,
    seed: int = 0,
    processes: int = 1,
    store: Path | None = None,
    progress: Progress | None = None,
) -> Tuning:
    """Search for the numbers of a walk in space at a speed (m/s); the same for one seed.

    ``rhythm`` is ``trot`` or ``bound``. Walks last ``seconds`` (s); ``draws`` of them are drawn
    over all ranges, and in each of some ``rounds`` so many ``children`` about the best ones.
    ``store`` is a file that keeps what is tried; the same call goes on with it. ``processes`` share
    the work without a change to the result. ``progress`` is told what is done and which share of
    it, 0 to 1. Raises `NoWalkError` if all fall, `UnknownNameError`, `ParameterError`, and
    `MachineError` without a MuJoCo that will do.
    """
    if rhythm not in RHYTHMS:
        raise UnknownNameError("rhythm", rhythm, RHYTHMS)
    check_between("speed", speed, -5, 5)
    check_between("seconds", seconds, 0.5, 600)
    for name, count in (("draws", draws), ("rounds", rounds), ("children", children)):
        check_count(name, count)
    SpaceRobot(robot)
    ranges = {n: r for n, r in RANGES.items() if n not in TIED.get(rhythm, {})}
    asked = {
        "flexspine": __version__, "robot": dict(robot.numbers), "rhythm": rhythm, "speed": speed,
        "seconds": seconds, "draws": draws, "rounds": rounds, "children": children, "seed": seed,
        "ranges": [[name, *ends] for name, ends in ranges.items()],
    }  # fmt: skip
    one = partial(try_walk, robot, rhythm, speed, seconds)
    with LocalWorkers(check_count("processes", processes)) as crew:
        pool = Rounds(crew, store, asked, progress)
        shares = _sobol(len(ranges), draws, seed)
        costs = np.array(pool.do("drawing", one, _works(ranges, shares, seed)))
        history = [float(costs.min())]
        for number in range(rounds):
            drawn = _children(shares, costs, number / max(rounds - 1, 1), children, seed + number)
            works = _works(ranges, drawn, seed)
            found = pool.do(f"round {number + 1} of {rounds}", one, works)
            shares, costs = np.concatenate([shares, drawn]), np.concatenate([costs, found])
            history.append(float(costs.min()))
    lasting = int((costs < FALL).sum())
    if not lasting:
        raise NoWalkError(
            f"none of {len(costs)} walks lasted {seconds:g} s, with whole strides to judge it by",
            "draw more of them, let them walk longer, or ask for another speed",
        )
    best, told = int(costs.argmin()), f"found by a search with seed {seed} at {speed:g} m/s"
    walk = _walk(rhythm, _numbers(ranges, shares[best]), told)
    run = run_in_space(robot, walk, seconds, sensing=SENSING, seed=seed)
    return Tuning(
        walk, run, summarize_space(run), float(costs[best]), tuple(history), len(costs), lasting
    )


def try_walk(
    robot: Robot, rhythm: str, wanted: float, seconds: float, work: tuple[dict[str, float], int]
) -> float:
    """The cost of a walk with these numbers and this seed."""
    numbers, seed = work
    try:
        walk = _walk(rhythm, numbers, "tried")
        run = run_in_space(robot, walk, seconds, sensing=SENSING, seed=seed)
    except ParameterError:
        return 2 * FALL  # feet out of reach
    weight = robot.linkage.mass * robot.linkage.gravity
    return cost(summarize_space(run), run.duration / seconds, wanted, weight)


def _walk(rhythm: str, numbers: Mapping[str, float], source: str) -> Walk:
    made = {**KEPT, **TIED.get(rhythm, {}), **numbers}
    return Walk(rhythm, rhythm, build(Gains, made), Source(title=rhythm.title(), source=source))


def _numbers(ranges: Mapping[str, tuple[float, float]], share: Array) -> dict[str, float]:
    """Numbers at shares of their ranges, to four digits, as files have them."""
    return {
        name: float(f"{low + (high - low) * part:.4g}")
        for (name, (low, high)), part in zip(ranges.items(), share.tolist(), strict=True)
    }


def _works(
    ranges: Mapping[str, tuple[float, float]], shares: Array, seed: int
) -> list[tuple[dict[str, float], int]]:
    return [(_numbers(ranges, share), seed) for share in shares]


def _sobol(size: int, count: int, seed: int) -> Array:
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of lengths that are no powers of two
        drawn: Array = qmc.Sobol(size, rng=np.random.default_rng(seed)).random(count)
    return drawn


def _children(shares: Array, costs: Array, progress: float, count: int, seed: int) -> Array:
    """Points about the best ones so far, narrower as rounds go by."""
    rng = np.random.default_rng((seed, len(shares)))
    best = shares[np.argsort(costs, kind="stable")[:PARENTS]]
    width = WIDTHS[0] * (WIDTHS[1] / WIDTHS[0]) ** progress
    parents = best[rng.integers(len(best), size=count)]
    drawn: Array = np.clip(parents + rng.normal(0, width, parents.shape), 0, 1)
    return drawn


def walk_file(tuning: Tuning) -> str:
    """The walk as a TOML file."""
    numbers = values(tuning.walk.gains)
    lines = [
        f'title = "{tuning.walk.source.title}"',
        f'rhythm = "{tuning.walk.rhythm}"',
        f'source = "{tuning.walk.source.source}"',
    ]
    for table in ("gait", "servo"):
        lines += ["", f"[{table}]"]
        for name, value in numbers.items():
            if name.startswith(f"{table}."):
                lines.append(f"{name.removeprefix(f'{table}.')} = {value!r}")
    return "\n".join(lines) + "\n"
