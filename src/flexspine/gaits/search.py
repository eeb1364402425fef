"""Find gaits: seeded random starts, Newton, and every distinct solution examined."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from flexspine.errors import ParameterError
from flexspine.gaits.gait import Gait, examine
from flexspine.gaits.newton import solve
from flexspine.gaits.problem import Problem
from flexspine.gaits.starts import Sampler
from flexspine.hybrid.compile import Array
from flexspine.models.legs import SIDES
from flexspine.models.model import Model
from flexspine.models.simulation import DEFAULT_TOLERANCE, check_count
from flexspine.parameters import check_seed, is_number, values

# Natural units; gaits closer than this are one.
DISTINCT = 1e-6

# Where a family just begins or folds, two solutions meet: the equations are nearly singular, and
# the residual leaves a solution open to the square root of itself.
SINGULAR, DOUBLE_ROOT = 1e-3, 1e-4

DEFAULT_STARTS = 100

ADVICE = {
    "fell": "the animal fell: give a height and speed nearer to a known gait, or more starts",
    "no_apex": "no apex came back: lower the energy or the height",
    "stalled": "the iteration stalled where no gait is near: give more starts, or other values",
    "left_bounds": "the iteration left the bounds: widen them",
    "refuted": "half a stride closed but the whole did not, mostly by a second touchdown: this "
    "family ends before these values",
}
OTHER = "look at the outcome of a run near these values"


@dataclass(frozen=True)
class Search:
    """What a search has found: a sequence of distinct gaits, and how each start fared.

    ``gaits`` are symmetric ones first. ``tally`` counts starts by ``found`` or the reason that
    there is nothing: ``fell``, ``no_apex`` and other outcomes, ``stalled``, ``left_bounds``,
    ``refuted``. ``dropped`` counts drawn points by the outcome that made them no starts at all.
    ``out_of_reach`` tells why there can be no gait, if that is known.
    """

    gaits: tuple[Gait, ...]
    tally: Mapping[str, int]
    dropped: Mapping[str, int]
    out_of_reach: str = ""

    def __repr__(self) -> str:
        return f"<Search: {len(self)} gaits from {self.advice}>"

    def __iter__(self) -> Iterator[Gait]:
        return iter(self.gaits)

    def __len__(self) -> int:
        return len(self.gaits)

    def __getitem__(self, index: int) -> Gait:
        return self.gaits[index]

    @property
    def advice(self) -> str:
        """What became of the starts and, if no gait was found, what to try."""
        told = f"{sum(self.tally.values())} starts: {_counted(self.tally)}"
        if self.dropped:
            told += f"; drawn and dropped before: {_counted(self.dropped)}"
        if self.gaits or not self.tally:
            return told
        if self.out_of_reach:
            return f"{told}; {self.out_of_reach}"
        worst = max(self.tally, key=lambda name: self.tally[name])
        return f"{told}; {ADVICE.get(worst, OTHER)}"


def find_gaits(
    model: Model,
    fixed: Mapping[str, float] | None = None,
    *,
    free: Mapping[str, tuple[float, float]] | None = None,
    symmetric: bool | None = None,
    starts: int = DEFAULT_STARTS,
    seed: int = 0,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable[[float], None] | None = None,
) -> Search:
    """Find all gaits of a model with some quantities fixed, from seeded random starts.

    ``fixed`` maps names to values: ``energy`` (J), ``mean_speed`` (m/s), apex coordinates such as
    ``height``, ``touchdown.fore`` or ``touchdown.hind``; all other apex coordinates and touchdown
    angles are unknown. Without it, energy, height and mean speed are those of the model's own
    gait. ``free`` are parameters that become unknown too, with the range to start in. A
    ``symmetric`` gait is its own mirror image in time; None looks for symmetric and general ones.
    ``starts`` of them are drawn for either kind. ``bounds`` narrow or widen where unknowns may lie,
    low and high by name. SI and radians. The same seed finds the same gaits. ``progress`` is told
    the share that is done, 0 to 1. Raises `UnknownNameError`, and `ParameterError` where the fixed
    quantities do not single out isolated gaits.

    >>> from flexspine import find_gaits, load_model
    >>> model = load_model("kamimura2015-rigid")
    >>> fixed = {"energy": 290, "height": 0.32, "mean_speed": 4.5}
    >>> search = find_gaits(model, fixed, symmetric=True, starts=20)
    >>> for gait in search:
    ...     print(gait.family, f"{gait.period:.4f} s")
    fore-first DF-FS-DF-HS-DF 0.3908 s
    hind-first DF-HS-DF-FS-DF 0.3911 s
    """
    wanted = _own_values(model, tolerance) if fixed is None else dict(fixed)
    ranges = {**(bounds or {}), **(free or {})}
    _check_request(model, free or {}, starts, seed)
    problems = pose_problems(
        model, wanted, free=free, symmetric=symmetric, bounds=bounds, tolerance=tolerance
    )
    tally: Counter[str] = Counter()
    dropped: Counter[str] = Counter()
    found: list[Gait] = []
    for number, problem in enumerate(problems):
        sampler = Sampler(problem, np.random.default_rng(seed), ranges)
        for count in range(starts):
            _try(problem, sampler, found, tally)
            if progress is not None:
                progress((number + (count + 1) / starts) / len(problems))
        dropped.update(sampler.dropped)
    found.sort(key=lambda gait: (not gait.symmetric, gait.family, gait.model.touchdown["fore"]))
    return Search(tuple(found), dict(tally), dict(dropped), _out_of_reach(model, wanted))


def _out_of_reach(model: Model, wanted: Mapping[str, float]) -> str:
    """Why no gait can be as wanted, if energy tells: at that speed motion alone has more."""
    energy, speed = wanted.get("energy"), wanted.get("mean_speed")
    if energy is None or speed is None or "energy" not in model.system.section.conserved:
        return ""
    least = model.mass * speed**2 / 2
    if energy >= least:
        return ""
    why = f"there is none: at {speed:g} m/s kinetic energy alone is {least:.4g} J"
    return f"{why}; give more energy or less speed"


def pose_problems(
    model: Model,
    fixed: Mapping[str, float],
    *,
    free: Mapping[str, tuple[float, float]] | None = None,
    symmetric: bool | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
) -> list[Problem]:
    """What `find_gaits` solves: symmetric gaits, general ones, or both. Raises as it does."""
    kinds = [symmetric] if symmetric is not None else [True, False]
    named = {*fixed, *(bounds or {}), *(free or {})}
    if symmetric is None and not _symmetry_allows(model.keeping(free or ()), named):
        kinds = [False]
    problems = [
        Problem(model, fixed, free=tuple(free or ()), symmetric=kind, tolerance=tolerance)
        for kind in kinds
    ]
    for problem in problems:
        _check_count(problem)
    return problems


def _symmetry_allows(model: Model, names: set[str]) -> bool:
    """Whether a model has symmetric gaits in which these names mean something."""
    reversal = model.system.reversal
    if reversal is None or not model.alike:
        return False
    decided = model.system.section.coordinates.keys() - reversal.coordinates.keys()
    return not any(name in decided or name.split(".")[0] in SIDES for name in names)


def _check_request(
    model: Model, free: Mapping[str, tuple[float, float]], starts: int, seed: int
) -> None:
    given = values(model.parameters)
    for name, (low, high) in free.items():
        if not (is_number(low) and is_number(high)):
            raise ParameterError(f"'{name}' from {low} to {high} is no range", "give two numbers")
        if low <= 0 < given.get(name, 0.0) and name not in model.may_vanish:
            raise ParameterError(
                f"'{name}' from {low:g} to {high:g} would vanish", "give a range above zero"
            )
    check_count("starts", starts)
    check_seed(seed)


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in sorted(counts.items()))


def _own_values(model: Model, tolerance: float) -> dict[str, float]:
    """Energy, height and mean speed of the model's own gait."""
    own = examine(model, tolerance=tolerance)
    if own.flaw is not None:
        raise ParameterError(
            f"the start of '{model.name}' is no gait ({own.flaw})",
            "say what is fixed: energy, height and mean_speed",
        )
    return own.quantities


def _check_count(problem: Problem) -> None:
    surplus = problem.surplus
    if surplus > 0:
        freed = "touchdown.fore, or set fewer parameters free"
        raise ParameterError(
            f"gaits with fixed {_listed(problem.fixed)} come in families of {surplus} dimension"
            + "s" * (surplus > 1),
            f"fix more, such as {freed if problem.free else 'energy, height and mean_speed'}",
        )
    if surplus < 0:
        raise ParameterError(
            f"{_listed(problem.fixed)} are {-surplus} too many to fix"
            + ("" if problem.system.section.conserved else ", as this animal loses energy"),
            "fix fewer, or set a parameter free",
        )


def _listed(names: Mapping[str, float]) -> str:
    return ", ".join(sorted(names)) or "nothing"


def _try(problem: Problem, sampler: Sampler, found: list[Gait], tally: Counter[str]) -> None:
    """Solve from one start and keep what is new."""
    attempt = solve(problem, sampler.draw(), bounds=sampler.limits)
    if not attempt.solved:
        tally[attempt.reason or ""] += 1
        return
    if not sampler.contains(attempt.point):
        tally["left_bounds"] += 1
        return
    gait = confirm(problem, attempt.point)
    if gait is None:
        tally["refuted"] += 1
        return
    tally["found"] += 1
    apart = DISTINCT
    if attempt.linear is not None and _nearly_singular(attempt.linear.matrix):
        apart = DOUBLE_ROOT
    if not any(same_orbit(gait, other, apart) for other in found):
        found.append(gait)


def _size(model: Model, name: str) -> float:
    """What a difference of a parameter is measured by."""
    own = abs(model.numbers[name])
    return max(own, model.scales.get(name, 1.0)) if name in model.may_vanish else own


def _nearly_singular(matrix: Array) -> bool:
    return float(np.linalg.svd(matrix, compute_uv=False)[-1]) < SINGULAR


def confirm(problem: Problem, point: Array) -> Gait | None:
    """Simulate a solution anew; None if it does not come back, or is no gait at all."""
    try:
        gait = examine(problem.at(point), strides=problem.strides, tolerance=problem.tolerance)
    except ParameterError:
        return None
    return gait if gait.flaw is None else None


def same_orbit(one: Gait, other: Gait, apart: float = DISTINCT) -> bool:
    """Whether two gaits of one animal are the same orbit, perhaps seen from different apexes.

    ``apart`` is how far apart distinct ones are, in natural units.
    """
    angles = [abs(one.model.touchdown[s] - other.model.touchdown[s]) for s in one.model.touchdown]
    if max(angles) > apart:
        return False
    parameters, others = values(one.model.parameters), values(other.model.parameters)
    if any(abs(parameters[n] - others[n]) > DISTINCT * _size(one.model, n) for n in parameters):
        return False
    start = one.orbit[0]
    return bool(np.any(np.max(np.abs(other.orbit - start), axis=1) < apart))
