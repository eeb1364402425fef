"""The motion of a planar linkage whose motors' angles accelerate as wanted, in symbols.

With the motors' accelerations given, only the first link, the joints without motor and the base
are left to move. Their equations know no motors: ``P^T (D a + ...) = P^T J^T F`` with the columns
``P`` of those coordinates. With two feet of different hips on the ground these are as many as the
contacts hold, and the motion is a matter of kinematics alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from flexspine.mechanics.elimination import solve
from flexspine.mechanics.linkage import Linkage
from flexspine.mechanics.linkage_motion import LinkageMotion, Point, Standing, dot


@dataclass(frozen=True)
class TrackedMotion:
    """Accelerations of the motion's coordinates, forces by foot and torques by joint.

    All in terms of ``definitions``, in their order. ``closeness`` vanishes where the feet and a
    joint without motor are in line, so that torques are unbounded; it is None where that cannot
    be.
    """

    definitions: dict[sp.Symbol, sp.Expr]
    accelerations: list[sp.Expr]
    forces: dict[str, Point]
    torques: dict[str, sp.Expr]
    closeness: sp.Expr | None


def follow(
    motion: LinkageMotion, feet: Sequence[Standing], wanted: Mapping[str, sp.Expr]
) -> TrackedMotion:
    """Find the torques with which motors accelerate as ``wanted``, and what else happens.

    Raises `ValueError` where feet hold what the motors are to move: more than two of them, or two
    at the same hip.
    """
    linkage = motion.linkage
    free = _free_columns(linkage)
    count = len(free)
    if 2 * len(feet) > count:
        raise ValueError(f"{len(feet)} feet hold what the motors are to move")
    definitions = dict(motion.definitions)
    given = _given(linkage, wanted, definitions)
    matrix, applied = motion.mass_matrix(), motion.forces({})
    left = [applied[i] - dot(matrix.row(i), given) for i in range(len(given))]
    order = list(range(count))[::-1]  # the base first, which couples to all the same way
    shares = [free[p] for p in order]
    rows, bias = motion.foot_rows([foot.name for foot in feet])
    held = [[sp.Add(*(rows[r, a] for a in share)) for share in shares] for r in range(rows.rows)]
    closeness = _closeness(held, order)
    if closeness == 0:
        raise ValueError("2 feet at one hip hold what the motors are to move")
    small = sp.Matrix(
        count,
        count,
        lambda i, j: sp.Add(*(matrix[a, b] for a in shares[i] for b in shares[j])),
    )
    columns = [[sp.Add(*(left[a] for a in share)) for share in shares], *held]
    more, (alone, *spread) = solve(small, columns, "law_")
    definitions |= more
    settling = [part for foot in feet for part in motion.settling(foot)]
    needed = [
        settling[r] - bias[r] - dot(rows.row(r), given) - dot(held[r], alone)
        for r in range(rows.rows)
    ]
    sizes: Sequence[sp.Expr] = ()
    if feet:
        response = sp.Matrix(len(held), len(held), lambda i, j: dot(held[i], spread[j]))
        more, (sizes,) = solve(response, [needed], "law_feet_")
        definitions |= more
    shared = [
        (share, sp.Add(alone[i], *(spread[r][i] * sizes[r] for r in range(len(held)))))
        for i, share in enumerate(shares)
    ]
    accelerations = _accelerations(motion, given, shared, definitions)
    missing = [
        dot(matrix.row(i), accelerations) - applied[i] - dot(rows.col(i), sizes)
        for i in range(len(linkage.links))
    ]
    torques = _torques(linkage, wanted, missing, definitions)
    forces = {foot.name: (sizes[2 * i], sizes[2 * i + 1]) for i, foot in enumerate(feet)}
    return TrackedMotion(definitions, accelerations, forces, torques, closeness)


def _given(
    linkage: Linkage, wanted: Mapping[str, sp.Expr], definitions: dict[sp.Symbol, sp.Expr]
) -> list[sp.Expr]:
    """Accelerations of all coordinates from the motors alone; adds their definitions."""
    given: list[sp.Expr] = []
    for number, link in enumerate(linkage.links):
        driven = [wanted[name] for name in _on_the_way(linkage, number) if name in wanted]
        symbol = sp.Symbol(f"law_given_{link.name}", real=True)
        definitions[symbol] = sp.Add(*driven)
        given.append(symbol if driven else sp.S.Zero)
    return [*given, sp.S.Zero, sp.S.Zero]


def _accelerations(
    motion: LinkageMotion,
    given: Sequence[sp.Expr],
    shared: Sequence[tuple[list[int], sp.Expr]],
    definitions: dict[sp.Symbol, sp.Expr],
) -> list[sp.Expr]:
    """Accelerations of all coordinates, those without motor included; adds their definitions."""
    found: list[sp.Expr] = []
    for number, coordinate in enumerate(motion.coordinates):
        symbol = sp.Symbol(f"{coordinate.name}_wanted", real=True)
        moves = (move for share, move in shared if number in share)
        definitions[symbol] = sp.Add(given[number], *moves)
        found.append(symbol)
    return found


def _torques(
    linkage: Linkage,
    wanted: Mapping[str, sp.Expr],
    missing: Sequence[sp.Expr],
    definitions: dict[sp.Symbol, sp.Expr],
) -> dict[str, sp.Symbol]:
    """Torques by joint from the moments that the links lack; adds their definitions."""
    lacks: list[sp.Symbol] = []
    for link, moment in zip(linkage.links, missing, strict=True):
        symbol = sp.Symbol(f"law_missing_{link.name}", real=True)
        definitions[symbol] = moment
        lacks.append(symbol)
    torques: dict[str, sp.Symbol] = {}
    for name in wanted:
        torques[name] = sp.Symbol(f"torque_{name}", real=True)
        beyond = (lack for i, lack in enumerate(lacks) if name in _on_the_way(linkage, i))
        definitions[torques[name]] = sp.Add(*beyond)
    return torques


def _free_columns(linkage: Linkage) -> list[list[int]]:
    """Which absolute coordinates each coordinate without motor moves, the base last."""
    n = len(linkage.links)
    passive = [joint.name for joint in linkage.joints if not joint.actuated]
    columns = [list(range(n))]
    columns += [[i for i in range(n) if name in _on_the_way(linkage, i)] for name in passive]
    return [*columns, [n], [n + 1]]


def _on_the_way(linkage: Linkage, number: int) -> set[str]:
    """The joints between the first link and another."""
    joints = {joint.link: joint.name for joint in linkage.joints}
    found = set()
    link = linkage.links[number]
    while link.parent is not None:
        if link.name in joints:
            found.add(joints[link.name])
        link = linkage.links[linkage.place[link.parent]]
    return found


def _closeness(held: list[list[sp.Expr]], order: list[int]) -> sp.Expr | None:
    """The determinant of what two feet hold of the coordinates without motor."""
    if len(held) != len(order):
        return None
    angles = [i for i, p in enumerate(order) if p < len(order) - 2]
    apart = sp.Matrix(2, 2, lambda i, j: held[2 + i][angles[j]] - held[i][angles[j]])
    return apart.det()
