"""A central pattern generator: coupled phase oscillators, one a leg, and what feet make of them.

``phi_i' = 2 pi f + K sum_j sin(phi_j - phi_i + 2 pi (d_i - d_j))``, where ``d_i`` is the share of a
cycle by which leg i is behind. An amplitude that a critically damped oscillator brings from 0 to 1,
and back to 0 at the end, makes start and stop smooth. During its stance, the first part of its
cycle, a foot moves back evenly under the hip; then it swings forward along a cubic, lifted by a
cosine, without a jump in its velocity.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, pi

import numpy as np

from flexspine.control.leg_pairs import diagonal_pairs, hip_pairs
from flexspine.errors import UnknownNameError
from flexspine.hybrid.compile import Array
from flexspine.models.leg_geometry import Leg
from flexspine.models.model import check_between


@dataclass(frozen=True)
class Rhythm:
    """How legs take turns, in SI units.

    ``offsets`` by leg are the shares of a cycle by which it is behind, ``frequency`` (Hz) is that
    of cycles, ``duty`` the share of its cycle that a leg stands. A foot goes ``stride`` (m) back
    under its hip, at ``height`` (m) below it, and is lifted by ``clearance`` (m). ``coupling``
    (1/s) is how fast phases get into step, ``readiness`` (1/s) how fast the amplitude follows. The
    rhythm stops at ``stop`` (s). ``ahead`` (m) by leg is how far ahead of its hip the middle of a
    foot's way is, if it is not below it. Raises `ParameterError` for numbers that no rhythm has.
    """

    offsets: Mapping[str, float]
    frequency: float = 1.25
    duty: float = 0.6
    stride: float = 0.14
    height: float = 0.33
    clearance: float = 0.04
    coupling: float = 5.0
    readiness: float = 6.0
    stop: float = inf
    ahead: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, low, high in (
            ("frequency", 0, 100), ("duty", 0, 1), ("stride", -1, 1), ("height", 0, 10),
            ("clearance", 0, 1), ("coupling", 0, 1e3), ("readiness", 0, 1e3),
        ):  # fmt: skip
            check_between(f"rhythm.{name}", getattr(self, name), low, high)

    @property
    def speed(self) -> float:
        """How fast feet that stand move back under the hips, in m/s."""
        return self.stride * self.frequency / self.duty


RHYTHMS = ("trot", "bound")


def rhythm(name: str, legs: Mapping[str, Leg], lag: float = 0.5) -> Rhythm:
    """Return the rhythm of a gait: ``trot`` (diagonal pairs) or ``bound`` (hind, then fore pair).

    ``legs`` are those of a robot by name, ``lag`` is the share of a cycle by which the second pair
    is behind the first. Raises `UnknownNameError`, and `ParameterError` unless two legs are at each
    of two hips.
    """
    if name not in RHYTHMS:
        raise UnknownNameError("rhythm", name, RHYTHMS)
    pairs = diagonal_pairs(legs) if name == "trot" else hip_pairs(legs)
    offsets = {leg: number * lag for number, pair in enumerate(pairs) for leg in pair}
    return Rhythm({leg: offsets[leg] for leg in legs})


@dataclass(frozen=True)
class Beat:
    """Where a rhythm is: phases in rad by leg (n,), amplitude (0 to 1) and its rate (1/s)."""

    phases: Array
    amplitude: float
    amplitude_rate: float


@dataclass(frozen=True)
class Cpg:
    """A central pattern generator: the coupled oscillators of a rhythm, one for each leg.

    Arrays over legs (n,) are in the order of the rhythm's ``offsets``.
    """

    rhythm: Rhythm

    @cached_property
    def _lags(self) -> Array:
        return 2 * pi * np.array(list(self.rhythm.offsets.values()))

    def begin(self, phases: Array | None = None) -> Beat:
        """Return a beat at rest with these phases (n,) in rad; in step, if none are given."""
        return Beat(-self._lags if phases is None else np.asarray(phases, dtype=float), 0.0, 0.0)

    def rates(self, phases: Array) -> Array:
        """Return how fast phases (n,) in rad advance, in rad/s, shape (n,)."""
        lead = phases + self._lags  # equal for all legs in step
        pull = np.sin(lead[None, :] - lead[:, None]).sum(axis=1)
        return np.asarray(2 * pi * self.rhythm.frequency + self.rhythm.coupling * pull, dtype=float)

    def advance(self, beat: Beat, time: float, step: float) -> Beat:
        """Return the beat ``step`` s after one at ``time`` (s), by a Runge-Kutta step."""
        one = self.rates(beat.phases)
        two = self.rates(beat.phases + one * step / 2)
        three = self.rates(beat.phases + two * step / 2)
        four = self.rates(beat.phases + three * step)
        phases = beat.phases + (one + 2 * two + 2 * three + four) * step / 6
        # Critically damped towards its aim, in closed form.
        aim, ready = (1.0 if time < self.rhythm.stop else 0.0), self.rhythm.readiness
        off, slope = beat.amplitude - aim, beat.amplitude_rate
        bend, fade = slope + ready * off, np.exp(-ready * step)
        return Beat(
            phases,
            float(aim + (off + bend * step) * fade),
            float((slope - ready * bend * step) * fade),
        )

    def in_stance(self, beat: Beat) -> Array:
        """Return which legs are in the part of their cycle in which they stand, shape (n,)."""
        return np.asarray((beat.phases / (2 * pi)) % 1 < self.rhythm.duty)

    def feet(self, beat: Beat) -> tuple[Array, Array]:
        """Return where feet are from their hips (m) and their velocities (m/s), each (n, 2).

        x forward, y up.
        """
        cycle, duty = self.rhythm, self.rhythm.duty
        share = (beat.phases / (2 * pi)) % 1
        speed = self.rates(beat.phases) / (2 * pi)  # cycles a second
        back = share < duty
        swing = np.where(back, 0.0, (share - duty) / (1 - duty))
        slope = -(1 - duty) / duty  # in strides a swing, at its beginning and its end
        # The cubic from -1/2 to 1/2 with that slope at both ends.
        ahead = -0.5 + slope * swing + 3 * (1 - slope) * swing**2 - 2 * (1 - slope) * swing**3
        rate = slope + 6 * (1 - slope) * (swing - swing**2)
        x = np.where(back, 0.5 - share / duty, ahead)
        x_rate = np.where(back, -1 / duty, rate / (1 - duty)) * speed
        lift = (1 - np.cos(2 * pi * swing)) / 2
        lift_rate = np.where(back, 0.0, pi * np.sin(2 * pi * swing) / (1 - duty)) * speed
        size, growth = beat.amplitude, beat.amplitude_rate
        middle = np.array([cycle.ahead.get(leg, 0.0) for leg in cycle.offsets])
        place = np.stack(
            [middle + cycle.stride * size * x, cycle.clearance * size * lift - cycle.height], axis=1
        )
        velocity = np.stack(
            [
                cycle.stride * (size * x_rate + growth * x),
                cycle.clearance * (size * lift_rate + growth * lift),
            ],
            axis=1,
        )
        return place, velocity

    def with_stop(self, time: float) -> Cpg:
        """Return the same, stopping at a time (s)."""
        return Cpg(replace(self.rhythm, stop=time))
