"""Branches of gaits: followed both ways, through folds, and kept on disk meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flexspine._version import __version__
from flexspine.errors import ParameterError, UnknownNameError
from flexspine.gaits.checkpoint import Checkpoint
from flexspine.gaits.family import BranchPoint, Family
from flexspine.gaits.gait import Gait
from flexspine.gaits.landmarks import Landmark, Segment
from flexspine.gaits.problem import Problem
from flexspine.gaits.tracing import CLOSED_BRANCH, LONGEST_STEP, Tracer, Tracing, land
from flexspine.models.legs import ANGLES

MOST_POINTS = 2000

# Relative; values closer than this differ by rounding alone.
SAME = 1e-12


@dataclass(frozen=True)
class Branch:
    """A branch of gaits, followed in ``over`` from one end to the other.

    ``points`` (each a `BranchPoint`) and ``landmarks`` are in order along it; the two ``ends`` say
    why it ends, or where it was left. ``family`` are the equations that all its gaits solve.
    """

    over: str
    family: Family
    points: tuple[BranchPoint, ...]
    landmarks: tuple[Landmark, ...]
    ends: tuple[str, str]

    def __repr__(self) -> str:
        values = [point.value for point in self.points]
        span = f" from {values[0]:.4g} to {values[-1]:.4g}" if values else ""
        told = f"{len(self.points)} gaits, {len(self.landmarks)} landmarks"
        return f"<Branch over {self.over}{span}: {told}>"

    @property
    def free(self) -> tuple[str, ...]:
        """The parameters that change along it besides ``over``."""
        return tuple(name for name in self.family.problem.free if name != self.over)

    @property
    def gaits(self) -> tuple[Gait, ...]:
        """The gaits of its points."""
        return tuple(point.gait for point in self.points)

    def at(self, value: float) -> list[BranchPoint]:
        """Return the points of the branch at exactly this value of ``over``, SI.

        Several where the branch folds, none where it does not come by.
        """
        found = []
        for first, last in zip(self.points, (*self.points[1:], None), strict=True):
            if abs(first.value - value) <= SAME * abs(value):
                found.append(first)
            elif last is None or abs(last.value - value) <= SAME * abs(value):
                continue
            elif min(first.value, last.value) < value < max(first.value, last.value):
                point = land(self.family, Segment(self.family, first, last), value)
                if point is not None:
                    found.append(point)
        return found


def trace_branch(
    gait: Gait,
    over: str = "mean_speed",
    *,
    bounds: tuple[float, float],
    fixed: Mapping[str, float] | None = None,
    free: Collection[str] = (),
    symmetric: bool | None = None,
    longest_step: float = LONGEST_STEP,
    most_points: int = MOST_POINTS,
    store: str | Path | None = None,
    progress: Callable[[BranchPoint], None] | None = None,
) -> Branch:
    """Follow the branch of a gait in ``over`` both ways, until it ends or leaves ``bounds``.

    ``over`` is ``mean_speed``, ``energy``, an apex coordinate, ``touchdown.fore`` or ``.hind``, or
    a parameter by its dotted name; ``bounds`` are its lowest and highest value. ``fixed`` are the
    quantities kept, by default the gait's energy, apex height and mean speed without ``over``, or,
    for another apex coordinate or a touchdown angle, energy and height. ``free`` are further
    parameters that may change, such as an actuator that makes good what dampers take.
    ``symmetric`` follows symmetric gaits only (by default if the gait is one). ``longest_step`` is
    in natural units along the branch; each direction has ``most_points`` at the most. ``store`` is
    a file that keeps every step; traced again with the same arguments, the branch goes on from
    there. ``progress`` is told every point. SI and radians. By pseudo-arclength: Keller 1977.
    Raises `UnknownNameError`, `ParameterError`, `OutputError`.

    >>> from flexspine import examine, load_model, trace_branch
    >>> gait = examine(load_model("kamimura2015-rigid"))
    >>> branch = trace_branch(gait, bounds=(4.1, 5.0))
    >>> [f"{point.gait.period:.4f} s" for point in branch.at(4.25)]
    ['0.5846 s']
    >>> for landmark in branch.landmarks:
    ...     print(f"{landmark.kind} at {landmark.value:.3f} m/s")
    contact order at 4.580 m/s
    Neimark-Sacker at 4.593 m/s
    fold at 4.595 m/s
    no flight at the apex at 4.595 m/s
    """
    family = family_of(gait, over, fixed, symmetric, free)
    tracer = Tracer(family, bounds, longest_step, most_points)
    start = tracer.start(gait)
    checkpoint = None
    if store is not None:
        settings = {"bounds": bounds, "longest_step": longest_step, "most_points": most_points}
        checkpoint = Checkpoint(Path(store), {**_description(family, gait), **settings})
    halves: list[Tracing] = []
    for way in (-1, 1):
        tracing = Tracing((start if way > 0 else start.turned(),))
        if halves and halves[0].end == CLOSED_BRANCH:
            tracing = replace(tracing, end=CLOSED_BRANCH)
        elif checkpoint is not None:
            tracing = checkpoint.resume(way, family, tracing)
        for state in tracer.go(tracing):
            if checkpoint is not None:
                checkpoint.add(way, tracing, state)
            if progress is not None and len(state.points) > len(tracing.points):
                progress(state.points[-1])
            tracing = state
        halves.append(tracing)
    return join(family, *halves)


def _description(family: Family, gait: Gait) -> dict[str, Any]:
    """All that decides what a branch looks like."""
    problem = family.problem
    return {
        "flexspine": __version__,
        "over": family.over,
        "fixed": problem.fixed,
        "free": problem.free,
        "symmetric": problem.symmetric,
        "strides": problem.strides,
        "tolerance": problem.tolerance,
        **gait.model.record(),
    }


def family_of(
    gait: Gait,
    over: str,
    fixed: Mapping[str, float] | None,
    symmetric: bool | None,
    free: Collection[str] = (),
) -> Family:
    """The family that a gait belongs to. Raises `UnknownNameError` and `ParameterError`."""
    known = {*gait.model.apex, *ANGLES, "mean_speed", "energy"}
    parameters = gait.model.parameter_names[: -len(ANGLES)]
    if over not in known and over not in parameters:
        raise UnknownNameError("quantity or parameter", over, {*known, *parameters})
    own = gait.quantities
    if over not in (*own, *parameters):
        del own["mean_speed"]
    kept = {
        name: value for name, value in (own if fixed is None else fixed).items() if name != over
    }
    unknown = (*(() if over in known else (over,)), *free)
    for name in unknown:
        if unknown.count(name) > 1:
            raise ParameterError(f"'{name}' is asked for twice", "name it once")
    reversible = gait.model.keeping(unknown).features.reversible
    mirrored = gait.symmetric and reversible if symmetric is None else symmetric
    problem = Problem(
        gait.model,
        kept,
        free=unknown,
        symmetric=mirrored,
        strides=gait.strides,
        tolerance=gait.tolerance,
    )
    if over not in ("mean_speed", "energy") and over not in problem.unknowns:
        raise ParameterError(
            f"'{over}' does not change along symmetric gaits", "follow general ones"
        )
    if problem.surplus != 1:
        few = problem.surplus > 1
        told = (
            f"{', '.join(kept) or 'nothing'} kept along {over} are too {'few' if few else 'many'}"
        )
        remedy = "keep energy, height and mean_speed, without the one that is followed"
        if few and free:
            remedy = "keep more, such as touchdown.fore, or set fewer parameters free"
        elif not few and not problem.system.section.conserved:
            remedy = "set free what makes good the energy lost, such as legs.extension"
        raise ParameterError(f"{told} quantities", remedy)
    return Family(problem, over)


def join(family: Family, backward: Tracing, forward: Tracing) -> Branch:
    """Make one branch of both directions."""
    points = [point.turned() for point in reversed(backward.points[1:])]
    return Branch(
        over=family.over,
        family=family,
        points=(*points, *forward.points),
        landmarks=(*reversed(backward.marks), *forward.marks),
        ends=(backward.end or "left unfinished", forward.end or "left unfinished"),
    )
