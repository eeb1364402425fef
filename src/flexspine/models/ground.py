"""Ground that is not flat: its height over the distance, and the pieces that it is made of."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import isfinite, pi, radians, sin, tan
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexspine.errors import InputError, ParameterError
from flexspine.hybrid.compile import Array
from flexspine.parameters import check_seed, is_number, shortened

# m; before it the ground is level, so that a run begins as it would on flat ground.
BEGINS = 1.0

# m; further away nothing about the ground is told at once. Events are found to a share of the
# largest guard, so guards that tell how far a piece still goes are kept small.
SIGHT = 1.0

# More points than this are a slip of the pen (some 100 MB), not a wish.
MOST_POINTS = 1_000_000

# m, m/m; beyond these no height or slope means anything. What is steeper is a face.
HIGHEST, STEEPEST_SLOPE = 1e3, 100.0

# m; shorter or longer pieces and waves mean nothing either.
SHORTEST, LONGEST = 1e-3, 1e6


class Piece(NamedTuple):
    """Ground from ``start`` to ``end`` (m): a line of ``slope`` from height ``level`` (m) at the
    start, and on it a sinusoid of this ``amplitude`` (m).
    """

    start: float
    end: float
    level: float
    slope: float
    amplitude: float


@dataclass(frozen=True)
class Ground:
    """Lines between ``points`` (x, y) in m, with slopes ``before`` and ``after`` beyond them.

    Two points at the same x are a vertical face. Slopes are in m/m, uphill positive. From the last
    point on there may be a sinusoid of ``amplitude`` and ``wavelength`` (m) besides. ``name`` is
    for people. Raises `ParameterError` for points that are out of order, too steep or too many.
    """

    name: str
    points: tuple[tuple[float, float], ...]
    before: float = 0.0
    after: float = 0.0
    amplitude: float = 0.0
    wavelength: float = 1.0

    def __post_init__(self) -> None:
        if not 1 <= len(self.points) <= MOST_POINTS:
            raise ParameterError(
                f"ground of {len(self.points)} points is not usable",
                f"give from 1 to {MOST_POINTS}",
            )
        if not (np.all(np.isfinite(self.xs)) and np.all(np.abs(self.ys) <= HIGHEST)):
            raise ParameterError(
                f"ground '{self.name}' has a point that is no place, or too high",
                f"give heights up to {HIGHEST:g} m",
            )
        if np.any(np.diff(self.xs) < 0):
            raise ParameterError(f"ground '{self.name}' goes back", "give points in order of x")
        self._check_faces()
        _check("slope", self.before, -STEEPEST_SLOPE, STEEPEST_SLOPE)
        _check("slope", self.after, -STEEPEST_SLOPE, STEEPEST_SLOPE)
        _check("wavelength", self.wavelength, SHORTEST, LONGEST)
        steepest = STEEPEST_SLOPE / self.wave_number
        _check("amplitude", self.amplitude, -steepest, steepest)

    def _check_faces(self) -> None:
        length, rise = np.diff(self.xs), np.diff(self.ys)
        if np.any((length[1:] == 0) & (length[:-1] == 0)):
            raise ParameterError(
                f"ground '{self.name}' has more than two points at one x", "give two for a face"
            )
        if np.any((length > 0) & (np.abs(rise) > STEEPEST_SLOPE * length)):
            raise ParameterError(
                f"ground '{self.name}' is steeper than {STEEPEST_SLOPE:g} to 1 somewhere",
                "give both points the same x for a vertical face",
            )

    @cached_property
    def xs(self) -> Array:
        """Where the points are, shape (n,), in m."""
        return np.array([x for x, _ in self.points], dtype=float)

    @cached_property
    def ys(self) -> Array:
        """How high the points are, shape (n,), in m."""
        return np.array([y for _, y in self.points], dtype=float)

    @property
    def wave_number(self) -> float:
        """Wave number of the sinusoid, in rad/m; it rises from zero at the last point."""
        return 2 * pi / self.wavelength

    def height(self, x: float, *, ahead: bool = True) -> float:
        """Return the height at x, in m; at a vertical face that of what lies ahead, or behind."""
        piece = self.piece(x, ahead=ahead)
        wave = piece.amplitude * sin(self.wave_number * (x - float(self.xs[-1])))
        return piece.level + piece.slope * (x - piece.start) + wave

    def heights(self, x: ArrayLike) -> Array:
        """Return the heights at places x of any shape, in m."""
        places = np.asarray(x, dtype=float)
        return np.array([self.height(float(each)) for each in places.ravel()]).reshape(places.shape)

    def piece(self, x: float, *, ahead: bool = True) -> Piece:
        """Return the piece at x, or where two meet the one ahead or behind, as far as in sight."""
        xs, ys = self.xs, self.ys
        right = int(np.searchsorted(xs, x, side="right" if ahead else "left"))
        amplitude = 0.0
        if right == 0:
            low, high, base, slope = -np.inf, xs[0], (xs[0], ys[0]), self.before
        elif right == len(xs):
            low, high, base, slope = xs[-1], np.inf, (xs[-1], ys[-1]), self.after
            amplitude = self.amplitude
        else:
            low, high, base = xs[right - 1], xs[right], (xs[right - 1], ys[right - 1])
            slope = (ys[right] - base[1]) / (high - low)
        start, end = max(float(low), x - SIGHT), min(float(high), x + SIGHT)
        level = float(base[1] + slope * (start - base[0]))
        return Piece(start, end, level, float(slope), amplitude)

    def top(self, x: float) -> float:
        """Return the height of the highest ground in sight of x, or a little more, in m."""
        first = np.searchsorted(self.xs, x - SIGHT, side="left")
        last = np.searchsorted(self.xs, x + SIGHT, side="right")
        sides = ((x + way * SIGHT, ahead) for way in (-1, 1) for ahead in (True, False))
        ends = [self.height(place, ahead=ahead) for place, ahead in sides]
        return float(max(*ends, *self.ys[first:last])) + 2 * abs(self.amplitude)

    def outline(self, start: float, end: float) -> Array:
        """Return points (k, 2) along the ground from ``start`` to ``end`` in m, to draw it."""
        inner = (self.xs > start) & (self.xs < end)
        before = [(start, self.height(start))]
        after = [(end, self.height(end, ahead=False))]
        if self.amplitude and end > self.xs[-1]:
            fine = np.arange(max(start, float(self.xs[-1])), end, self.wavelength / 40)[1:]
            after = [*zip(fine, self.heights(fine), strict=True), *after]
        points = np.column_stack([self.xs[inner], self.ys[inner]])
        return np.array([*before, *map(tuple, points), *after], dtype=float)

    @classmethod
    def step(cls, height: float, at: float = BEGINS) -> Ground:
        """Make one step up by ``height`` m (down if negative), its face at x = ``at``."""
        _check("height", height, -HIGHEST, HIGHEST)
        return cls(f"step of {height:g} m", ((at, 0.0), (at, height)))

    @classmethod
    def stairs(
        cls, height: float, length: float = 1.0, count: int = 5, at: float = BEGINS
    ) -> Ground:
        """Make ``count`` steps by ``height`` m, each ``length`` m after the one before."""
        _check("height", height, -HIGHEST, HIGHEST)
        _check("length", length, SHORTEST, LONGEST)
        _check("count", count, 1, MOST_POINTS / 2)
        if count != int(count):
            raise ParameterError(f"count = {count:g} of steps is not usable", "give a whole number")
        faces = range(int(count))
        points = [(at + length * k, height * (k + up)) for k in faces for up in (0, 1)]
        name = f"{int(count)} steps of {height:g} m, {length:g} m apart"
        return cls(name, tuple(points))

    @classmethod
    def ramp(cls, height: float, length: float = 1.0, at: float = BEGINS) -> Ground:
        """Make a ramp from x = ``at``: up by ``height`` m over ``length`` m, and level again."""
        _check("height", height, -HIGHEST, HIGHEST)
        _check("length", length, SHORTEST, LONGEST)
        return cls(f"ramp of {height:g} m over {length:g} m", ((at, 0.0), (at + length, height)))

    @classmethod
    def slope(cls, degrees: float, at: float = BEGINS) -> Ground:
        """Make a slope from x = ``at`` on, uphill by ``degrees``, downhill if negative."""
        _check("angle", degrees, -80, 80)
        return cls(f"slope of {degrees:g} degrees", ((at, 0.0),), after=tan(radians(degrees)))

    @classmethod
    def waves(cls, amplitude: float, wavelength: float = 1.0, at: float = BEGINS) -> Ground:
        """Make a sinusoid from x = ``at`` on, of ``amplitude`` and ``wavelength`` in m."""
        _check("amplitude", amplitude, -HIGHEST, HIGHEST)
        _check("wavelength", wavelength, SHORTEST, LONGEST)
        name = f"waves of {amplitude:g} m, {wavelength:g} m long"
        return cls(name, ((at, 0.0),), amplitude=amplitude, wavelength=wavelength)

    @classmethod
    def rough(
        cls,
        height: float,
        spacing: float = 0.3,
        length: float = 100.0,
        seed: int = 0,
        at: float = BEGINS,
    ) -> Ground:
        """Make lines between heights drawn evenly up to ``height`` m, to either side of level.

        They are ``spacing`` m apart, from x = ``at`` on over ``length`` m. The same seed draws the
        same ground.
        """
        heights = _drawn(height, spacing, length, seed)
        points = [(at, 0.0), *((at + spacing * (k + 1), y) for k, y in enumerate(heights))]
        name = f"rough ground of {height:g} m, {spacing:g} m apart, seed {seed}"
        return cls(name, tuple(points))

    @classmethod
    def blocks(
        cls,
        height: float,
        spacing: float = 0.3,
        length: float = 100.0,
        seed: int = 0,
        at: float = BEGINS,
    ) -> Ground:
        """Make level blocks, as high as drawn evenly up to ``height`` m, to either side of level.

        They are ``spacing`` m long, from x = ``at`` on over ``length`` m. The same seed draws the
        same ground.
        """
        before, points = 0.0, []
        for k, y in enumerate(_drawn(height, spacing, length, seed)):
            points += [(at + spacing * k, before), (at + spacing * k, y)]
            before = y
        name = f"blocks of {height:g} m, {spacing:g} m long, seed {seed}"
        return cls(name, tuple(points))

    @classmethod
    def read(cls, path: str | Path) -> Ground:
        """Read points of the ground from CSV, with columns x and y in m. Raises `InputError`."""
        file = Path(path)
        try:
            with file.open(newline="", encoding="utf-8-sig") as lines:
                points = tuple(_points(file, csv.reader(lines)))
        except (OSError, UnicodeDecodeError, csv.Error) as failure:
            reason = getattr(failure, "strerror", None) or failure
            raise InputError(f"'{file}' cannot be read ({reason})", "give a CSV file") from failure
        if not points:
            raise InputError(f"'{file}' has no points", "write x,y in metres, one to a line")
        return cls(file.name, points)


def _check(what: str, value: float, low: float, high: float) -> None:
    if not (is_number(value) and low <= value <= high):
        raise ParameterError(
            f"{what} = {shortened(value)} of the ground is not usable",
            f"give a number from {low:g} to {high:g}",
        )


def _drawn(height: float, spacing: float, length: float, seed: int) -> list[float]:
    _check("height", height, 0, HIGHEST)
    _check("spacing", spacing, SHORTEST, LONGEST)
    _check("length", length, 0, LONGEST)
    if spacing > length:
        raise ParameterError(
            f"spacing = {spacing:g} m is more than the ground is long, {length:.4g} m",
            "give less, or longer ground",
        )
    check_seed(seed)
    count = int(length / spacing)
    if count > MOST_POINTS / 2:
        raise ParameterError(f"{count} pieces of ground are too many", "make them longer, or fewer")
    drawn: list[float] = (height * np.random.default_rng(seed).uniform(-1, 1, count)).tolist()
    return drawn


def _points(file: Path, rows: Iterable[list[str]]) -> Iterable[tuple[float, float]]:
    for number, row in enumerate(rows, 1):
        if not row or (number == 1 and [cell.strip() for cell in row] == ["x", "y"]):
            continue
        try:
            x, y = map(float, row)
            if not (isfinite(x) and isfinite(y)):
                raise ValueError
        except ValueError:
            raise InputError(
                f"line {number} of '{file}' is not two numbers", "write x,y in metres on each"
            ) from None
        yield x, y
