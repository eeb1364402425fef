"""Which legs of a quadruped step together."""

from __future__ import annotations

from collections.abc import Mapping

from flexspine.errors import ParameterError
from flexspine.models.leg_geometry import Leg

Pairs = tuple[tuple[str, ...], tuple[str, ...]]


def hip_pairs(legs: Mapping[str, Leg]) -> Pairs:
    """The hind pair and the fore pair. Raises `ParameterError` unless there are two of two."""
    hips = sorted({leg.hip for leg in legs.values()})
    at = [[name for name, leg in legs.items() if leg.hip == hip] for hip in hips]
    if [len(names) for names in at] != [2, 2]:
        raise ParameterError(
            f"legs per hip: {', '.join(str(len(names)) for names in at)}",
            "a quadruped gait needs two legs at each of two hips",
        )
    hind, fore = at
    return tuple(hind), tuple(fore)


def diagonal_pairs(legs: Mapping[str, Leg]) -> Pairs:
    """The pairs of a trot: a hind leg and the fore leg of the other side.

    Raises `ParameterError` unless two legs are at each of two hips.
    """
    hind, fore = hip_pairs(legs)
    return (hind[0], fore[1]), (hind[1], fore[0])
