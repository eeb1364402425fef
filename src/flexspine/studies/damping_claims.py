"""The claim about what damping and compliance cost, judged by damped gaits: 8."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flexspine.gaits.family import BranchPoint
from flexspine.gaits.gait import Gait
from flexspine.studies.comparison import NO_DIFFERENCE, peak
from flexspine.studies.damping import DAMPING, STIFFNESS, DampedBranch, DampingStudy, cost
from flexspine.studies.spines import FLEXIBLE
from flexspine.studies.verdict import DEPENDS, Verdict, decided


@dataclass(frozen=True)
class CostCase:
    """What one branch says: whether it ``bears`` the claim out, in words and numbers, by gaits."""

    bears: bool
    finding: str
    numbers: dict[str, Any]
    runs: dict[str, Gait]


def damping_verdict(study: DampingStudy) -> Verdict:
    """Claim 8.

    It holds where the most damped gait of a branch is the dearest, and where the most compliant
    is not the cheapest.
    """
    cases = [_of_damping(branch) for branch in study.over_damping if _leads_on(branch)]
    cases += [_of_stiffness(branch) for branch in study.over_stiffness]
    bears = [case.bears for case in cases]
    verdict = decided(bears, [not borne for borne in bears])
    told = [case.finding for case in cases] or ["no speed at which to damp a gait"]
    if verdict == DEPENDS:
        told.append(
            "dampers take what the swing of the spine gives them, which grows neither with damping "
            "nor with compliance throughout"
        )
    return Verdict(
        8,
        "too much compliance or damping costs energy",
        verdict,
        "; ".join(told),
        {key: value for case in cases for key, value in case.numbers.items()},
        {name: gait for case in cases for name, gait in case.runs.items()},
    )


def dearest_at_its_end(costs: Sequence[float]) -> bool:
    """Whether of gaits in order of their damping the last one costs most."""
    return costs[-1] >= max(costs) * (1 - NO_DIFFERENCE)


def costly_when_soft(costs: Sequence[float]) -> bool:
    """Whether of gaits in order from the softest on that one costs more than another."""
    return costs[0] > min(costs) * (1 + NO_DIFFERENCE)


def _leads_on(branch: DampedBranch) -> bool:
    """Whether it has damped gaits."""
    return any(point.value > 0 for point in branch.points)


def _of_damping(branch: DampedBranch) -> CostCase:
    """Up to the greatest damping, where the branch ends or folds."""
    points = branch.branch.points
    most = max(range(len(points)), key=lambda at: points[at].value)
    costs = [branch.cost_at(at) for at in branch.measured(0, most)]
    undamped, end = points[0], points[most]
    dearest, bears = branch.extreme(max, 0, most), dearest_at_its_end(costs)
    text = (
        f"at {branch.speed:g} m/s, k_t = {branch.kept:g} N m/rad and with {branch.actuator} the "
        f"cost of transport rises to {cost(dearest.gait):.4f} at c_t = {dearest.value:.2g} N m "
        f"s/rad (peak GRF {peak(dearest.gait):.0f} N, undamped {peak(undamped.gait):.0f} N; "
        f"spectral radius {_radius(dearest):.2f}, undamped {_radius(undamped):.2f})"
    )
    if not bears:
        text += (
            f" and falls to {costs[-1]:.4f} at {end.value:.4g}, where the spine swings by "
            f"{swing(end.gait):.1g} rad, undamped {swing(undamped.gait):.2g} rad"
        )
    elif end is points[-1]:
        text += ", where the gait ends"
    else:
        text += ", where the branch folds"
    numbers: dict[str, Any] = {"stiffness": branch.kept}
    for name, point in (("undamped", undamped), ("dearest", dearest), ("end", end)):
        numbers[name] = {
            "damping": point.value,
            branch.actuator: point.gait.model.numbers[branch.actuator],
            **_measures(point),
        }
    key = f"damping at {branch.speed:g} m/s with {branch.actuator}"
    runs = {damped_name(branch, point): point.gait for point in (dearest, end)}
    return CostCase(bears, text, {key: numbers}, runs)


def _of_stiffness(branch: DampedBranch) -> CostCase:
    """From the softest gait on, on the side that the published ones are on."""
    points = branch.branch.points
    softest = min(range(len(points)), key=lambda at: points[at].value)
    costs = [branch.cost_at(at) for at in branch.measured(softest)]
    cheapest = branch.extreme(min, softest)
    text = (
        f"at {branch.speed:g} m/s, c_t = {branch.kept:g} N m s/rad and with {branch.actuator} it "
        f"is least, {cost(cheapest.gait):.4f}, at k_t = {cheapest.value:.0f} N m/rad"
    )
    numbers: dict[str, Any] = {"damping": branch.kept}
    runs: dict[str, Gait] = {}
    for name, point in (
        ("softest", points[softest]),
        ("cheapest", cheapest),
        ("stiffest", points[-1]),
    ):
        numbers[name] = {"stiffness": point.value, **_measures(point)}
        runs[damped_name(branch, point)] = point.gait
        if point is not cheapest:
            text += f", {cost(point.gait):.4f} at the {name}, {point.value:.0f} N m/rad"
    key = f"stiffness at {branch.speed:g} m/s and c_t = {branch.kept:g}"
    return CostCase(costly_when_soft(costs), text, {key: numbers}, runs)


def _measures(point: BranchPoint) -> dict[str, float]:
    return {
        "cost_of_transport": cost(point.gait),
        "peak_grf": peak(point.gait),
        "spectral_radius": _radius(point),
        "swing": swing(point.gait),
    }


def swing(gait: Gait) -> float:
    """By how much the spine's angle changes within a stride, in rad."""
    low, high = gait.summary.spine_range or (0.0, 0.0)
    return high - low


def damped_name(branch: DampedBranch, point: BranchPoint) -> str:
    """The name of a damped gait, such as ``flexible-260-damped-4.15-by-extension-at-4.5``."""
    numbers, by = point.gait.model.numbers, branch.actuator.rpartition(".")[2]
    return (
        f"{FLEXIBLE}-{numbers[STIFFNESS]:.6g}-damped-{numbers[DAMPING]:.4g}-by-{by}"
        f"-at-{branch.speed:g}"
    )


def _radius(point: BranchPoint) -> float:
    return point.stability.spectral_radius
