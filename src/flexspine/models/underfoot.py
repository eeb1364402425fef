"""What an animal's equations know of ground that is not flat.

Each point that may meet the ground holds the piece that it is over; where that ends, the next one
is looked up, which is an event. Points of the body, far above, hold how high the ground rises in
sight instead, until they come as low as that.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np
import sympy as sp

from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import Array, CompiledSystem
from flexspine.hybrid.outcome import Outcome, OutcomeKind
from flexspine.hybrid.system import Arming, Guard
from flexspine.hybrid.trajectory import HybridState
from flexspine.models.ground import SIGHT, Ground, Piece

STUMBLED = OutcomeKind(
    "stumbled",
    "a foot or the body met a vertical face; lower it, or meet it elsewhere in a stride, as legs "
    "keep their length in the air",
)

# m; a piece that ends so far behind is none: the ground has to be looked up.
LOST = 10 * SIGHT

# m; this far above the ground is on it.
TOUCHING = 1e-9

# Of the sinusoid that lies on some pieces: where it begins, and its wave number.
WAVES_FROM, WAVE_NUMBER = sp.symbols("x_w q_w", real=True)


class OnGround(BoundSystem):
    """A system with its numbers on some ground."""

    def __init__(self, compiled: CompiledSystem, parameters: Array, ground: Ground | None) -> None:
        super().__init__(compiled, parameters)
        self.ground = ground


class Underfoot(NamedTuple):
    """The piece of ground below a point: its letters."""

    point: str
    start: sp.Symbol
    end: sp.Symbol
    level: sp.Symbol
    slope: sp.Symbol
    amplitude: sp.Symbol

    @classmethod
    def of(cls, point: str) -> Underfoot:
        """The letters of a point, such as ``fore toe``."""
        tag = point.replace(" ", "_")
        letters = (sp.Symbol(f"{letter}_{tag}", real=True) for letter in "abysA")
        return cls(point, *letters)

    @property
    def held(self) -> tuple[sp.Symbol, ...]:
        """The letters of the piece, in its order."""
        return self[1:]

    def height(self, x: sp.Expr) -> sp.Expr:
        """Height of the ground at x, in m."""
        wave = self.amplitude * sp.sin(WAVE_NUMBER * (x - WAVES_FROM))
        return self.level + self.slope * (x - self.start) + wave

    def edges(self, x: sp.Expr) -> tuple[Guard, Guard]:
        """The point comes to either end of its piece."""
        ahead = Guard(
            f"{self.point} looks ahead",
            self.end - x,
            arming=Arming.LEVEL,
            decide=partial(_looks, self, True),
            timed=True,
            quiet=True,
        )
        behind = Guard(
            f"{self.point} looks behind",
            x - self.start,
            decide=partial(_looks, self, False),
            timed=True,
            quiet=True,
        )
        return ahead, behind

    def lost(self, x: sp.Expr) -> dict[sp.Symbol, sp.Expr]:
        """Resets after which the ground at x is looked up."""
        return {self.end: x - LOST}


TOES = {side: Underfoot.of(f"{side} toe") for side in ("fore", "hind")}


def clearance(below: Underfoot, x: sp.Expr, y: sp.Expr, ends: OutcomeKind) -> Guard:
    """A point of the body comes down to the ground, which ends the run."""
    return Guard(
        f"{below.point} on the ground",
        y - below.height(x),
        arming=Arming.LEVEL,
        decide=partial(_comes_low, below, ends),
        quiet=True,
    )


def begin(
    ground: Ground, held: Array, places: Mapping[sp.Symbol, int], x: float, points: list[Underfoot]
) -> None:
    """Write into held variables that the ground below these points has to be looked up."""
    held[places[WAVES_FROM]] = ground.xs[-1]
    held[places[WAVE_NUMBER]] = ground.wave_number
    lose(held, places, x, points)


def lose(
    held: Array, places: Mapping[sp.Symbol, int], x: float, points: Iterable[Underfoot]
) -> None:
    """Write into held variables that the ground below these points, about x, is not known."""
    for below in points:
        held[places[below.end]] = x - LOST


def _ground(bound: BoundSystem) -> Ground:
    assert isinstance(bound, OnGround)
    assert bound.ground is not None
    return bound.ground


def _where(below: Underfoot, bound: BoundSystem, point: HybridState) -> tuple[float, float]:
    """Where a point of the animal is."""
    if below.point == "CoM":
        return float(point.states[0]), float(point.states[1])
    tag = below.point.replace(" ", "_")
    table = bound.observe(point.mode, point.states[None], point.held)
    return float(table[f"{tag}_x"][0]), float(table[f"{tag}_y"][0])


def clearances(
    bound: OnGround, point: HybridState, points: Iterable[Underfoot]
) -> Iterator[tuple[str, float]]:
    """How high points of the body, not toes, are above the ground, in m."""
    ground = _ground(bound)
    for below in points:
        if below not in TOES.values():
            x, y = _where(below, bound, point)
            yield below.point, y - ground.height(x)


def _looks(
    below: Underfoot, ahead: bool, bound: BoundSystem, point: HybridState
) -> HybridState | Outcome:
    """Look up the next piece. A face that rises past the point stops the animal."""
    ground, places = _ground(bound), bound.system.places
    x, y = _where(below, bound, point)
    start, end = (float(point.held[places[s]]) for s in (below.start, below.end))
    known = x - end < LOST / 2
    at = x if not known else end if ahead else start
    if known:
        passed, next_ = ground.height(at, ahead=not ahead), ground.height(at, ahead=ahead)
        if passed < y < next_:
            where = f"{below.point} against a face at x = {at:.6g} m, t = {point.time:.6g} s"
            return Outcome(STUMBLED, where)
    piece = ground.piece(at, ahead=ahead)
    if below not in TOES.values() and y > (top := ground.top(at)):
        piece = Piece(at - SIGHT, at + SIGHT, top, 0.0, 0.0)
    return _over(below, piece, bound, point)


def _comes_low(
    below: Underfoot, ends: OutcomeKind, bound: BoundSystem, point: HybridState
) -> HybridState | Outcome:
    """Tell whether a point of the body is on the ground, or as low as ground in sight."""
    ground = _ground(bound)
    x, y = _where(below, bound, point)
    if y - ground.height(x) <= TOUCHING:
        return Outcome(ends, f"{below.point} on the ground at t = {point.time:.6g} s")
    return _over(below, ground.piece(x), bound, point)


def _over(below: Underfoot, piece: Piece, bound: BoundSystem, point: HybridState) -> HybridState:
    held = point.held.copy()
    held[[bound.system.places[symbol] for symbol in below.held]] = np.array(piece)
    return point._replace(held=held)
