"""Laws of torques at one instant: what the robot does under them, by its equations of motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize, nnls

from flexspine import load_robot
from flexspine.control.laws import JointSprings, LeastResidual, SevenOutputs, Situation, Tracking
from flexspine.mechanics.linkage import Linkage
from flexspine.mechanics.stance import constrained
from flexspine.models.locking import locked
from tests.control import own_walk as own

Array = NDArray[np.float64]

ROBOT = load_robot("sc618")
FLEXIBLE, LOCKED = ROBOT.linkage, locked(ROBOT, "spine").linkage
FRICTION = 0.8


def standing(linkage: Linkage, shift: Sequence[float] = (0.03, -0.04, 0.02, -0.05)) -> Array:
    """All toes on the ground, ``shift`` ahead of their hips, 0.33 m below them."""
    legs = {
        toe: own.leg_angles(np.array([ahead, -0.33]))
        for toe, ahead in zip(own.TOES, shift, strict=True)
    }
    q = np.zeros(linkage.size)
    q[0] = legs["toe_1"][1] + np.pi
    for motor, angle in zip(own.MOTORS, joints := own.joints_for(legs), strict=True):
        q[linkage.place[motor]] = angle
    assert len(joints) == 8
    return q


def situation(
    linkage: Linkage, feet: tuple[str, ...] = ("toe_1", "toe_4"), seed: int = 0, size: float = 1.0
) -> Situation:
    """Standing on some feet, moving a little, off what is wanted by a little."""
    rng = np.random.default_rng(seed)
    q = standing(linkage)
    rates = rng.normal(0, 0.2 * size, linkage.size)
    jacobian = linkage.foot_jacobian(q, feet)
    rates -= np.linalg.pinv(jacobian) @ jacobian @ rates
    motors = linkage.actuation.T
    joints = np.stack(
        [
            motors @ q + rng.normal(0, 0.003 * size, 8),
            motors @ rates + rng.normal(0, 0.03 * size, 8),
            rng.normal(0, 0.5 * size, 8),
        ]
    )
    swings = [toe[-1] for toe in own.TOES if toe not in feet]
    turned = linkage.to_absolute
    links = {
        link: np.array([turned[linkage.place[link]] @ q, turned[linkage.place[link]] @ rates, 0.0])
        + rng.normal(0, 0.01 * size, 3)
        for leg in swings
        for link in (f"thigh_{leg}", f"shank_{leg}")
    }
    com = np.stack([linkage.com(q), linkage.com_jacobian(q) @ rates, np.zeros(2)])
    return Situation(
        linkage=linkage,
        q=q,
        rates=rates,
        feet=feet,
        regular=True,
        joints=joints,
        links=links,
        com=com + rng.normal(0, 0.002 * size, (3, 2)),
        trunk=("hind_trunk", "fore_trunk") if linkage is FLEXIBLE else ("hind_trunk",),
        friction=FRICTION,
        limit=inf,
    )


def wanted(now: Situation, stiffness: float = 400.0, damping: float = 40.0) -> Array:
    """What joints are to accelerate by, from the law ``e'' + K_d e' + K_p e = 0``."""
    places = [now.linkage.place[motor] for motor in own.MOTORS]
    angle, rate, acceleration = now.joints
    off, drift = angle - now.q[places], rate - now.rates[places]
    found: Array = acceleration + damping * drift + stiffness * off
    return found


def moved(now: Situation, torques: Array) -> tuple[Array, Array]:
    """Accelerations of the motors' joints, and forces on the feet, while these stay."""
    found = constrained(now.linkage, now.q, now.rates, now.feet, torques)
    return found.accelerations[[now.linkage.place[m] for m in own.MOTORS]], found.forces


def residual(now: Situation, torques: Array) -> float:
    return float(((moved(now, torques)[0] - wanted(now)) ** 2).sum())


def slacks(now: Situation, torques: Array) -> Array:
    """Of friction cones and limits; none is below zero where all are obeyed."""
    forces = moved(now, torques)[1]
    grip = now.friction * forces[:, 1]
    cones = [grip - forces[:, 0], grip + forces[:, 0]]
    if now.limit < inf:
        cones += [now.limit - torques, now.limit + torques]
    return np.concatenate(cones)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("feet", own.DIAGONALS)
def test_tracked_joints_accelerate_as_wanted(feet: tuple[str, str], seed: int) -> None:
    now = situation(FLEXIBLE, feet, seed)
    assert moved(now, Tracking().torques(now))[0] == pytest.approx(wanted(now), abs=1e-8)
    other = Tracking(100.0, 7.0)
    aim = wanted(now, 100.0, 7.0)
    assert moved(now, other.torques(now))[0] == pytest.approx(aim, abs=1e-8)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("feet", own.DIAGONALS)
def test_the_least_residual_is_none_where_tracking_is_possible(
    feet: tuple[str, str], seed: int
) -> None:
    now = situation(FLEXIBLE, feet, seed)
    exact = Tracking().torques(now)
    assert slacks(now, exact).min() > 0, "no cone may be active here"
    assert LeastResidual().torques(now) == pytest.approx(exact, abs=1e-3)
    assert residual(now, LeastResidual().torques(now)) < 1e-9


CASES: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "low limits": (("toe_1", "toe_4"), {"limit": 8.0}),
    "lower limits": (("toe_2", "toe_3"), {"limit": 11.0}),
    "little friction": (("toe_1", "toe_4"), {"friction": 0.01}),
    "no friction": (("toe_2", "toe_3"), {"friction": 0.0}),
    "both": (("toe_1", "toe_4"), {"friction": 0.02, "limit": 10.0}),
    "one hip": (("toe_1", "toe_2"), {}),
    "fore hip, limits": (("toe_3", "toe_4"), {"limit": 9.0}),
    "three feet": (("toe_1", "toe_2", "toe_4"), {"limit": 12.0}),
    "four feet": (own.TOES, {}),
    "four feet, limits": (own.TOES, {"limit": 5.0, "friction": 0.1}),
}


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("linkage", [FLEXIBLE, LOCKED], ids=["flexible", "locked"])
def test_no_torques_within_limits_and_cones_come_closer(
    linkage: Linkage, case: str, seed: int
) -> None:
    """A convex problem is solved where its gradient is a sum of those of active constraints."""
    feet, changes = CASES[case]
    now = replace(situation(linkage, feet, seed), **changes)
    found = LeastResidual().torques(now)
    assert np.isfinite(found).all()
    slack = slacks(now, found)
    assert slack.min() > -1e-6
    # All is affine in torques: differences are derivatives.
    zero, axes = np.zeros(8), np.eye(8)
    gain = np.array([moved(now, axis)[0] - moved(now, zero)[0] for axis in axes]).T
    slopes = np.array([slacks(now, axis) - slacks(now, zero) for axis in axes]).T
    gradient = gain.T @ (moved(now, found)[0] - wanted(now))
    active = slopes[slack < 1e-5]
    # Torques that serve no end are to be small, which counts for a hundred-millionth.
    gradient += 1e-8 * found
    weights, missed = nnls(active.T, gradient) if len(active) else (zero, np.linalg.norm(gradient))
    scale = np.linalg.norm(gain.T @ (moved(now, zero)[0] - wanted(now)))
    assert missed < 1e-6 * scale, weights
    # And another solver, from several starts, finds no better one.
    for start in (found, 0.5 * found, zero):
        other = minimize(
            lambda t: residual(now, t),
            start,
            jac=lambda t: 2 * gain.T @ (moved(now, t)[0] - wanted(now)),
            constraints={"type": "ineq", "fun": lambda t: slacks(now, t), "jac": lambda _: slopes},
            method="SLSQP",
            options={"maxiter": 200, "ftol": 1e-10},
        )
        if slacks(now, other.x).min() > -1e-9:
            assert residual(now, found) <= other.fun + 1e-6 * (1 + other.fun)


def test_limits_and_ice_are_felt() -> None:
    """What tells that the cases above are no idle ones: something has to give way."""
    for case in ("low limits", "little friction", "both", "one hip", "four feet, limits"):
        feet, changes = CASES[case]
        now = replace(situation(FLEXIBLE, feet), **changes)
        assert residual(now, LeastResidual().torques(now)) > 1e-2, case


def test_impossible_limits_are_an_error_of_their_own() -> None:
    """Feet whose rates differ so that no torque under 0.001 N m keeps them on the ground."""
    now = situation(FLEXIBLE, own.TOES, size=1.0)
    fast = replace(now, rates=now.rates * 100, limit=1e-3, friction=0.01)
    with pytest.raises(np.linalg.LinAlgError, match="limits"):
        LeastResidual().torques(fast)


def test_a_foot_that_slides_hands_tracking_over_to_the_least_residual() -> None:
    now = replace(situation(FLEXIBLE, ("toe_1", "toe_2")), regular=False)
    torques = Tracking(100.0, 7.0).torques(now)
    assert torques == pytest.approx(LeastResidual(100.0, 7.0).torques(now), abs=0)
    assert slacks(now, torques).min() > -1e-6
    with pytest.raises(np.linalg.LinAlgError):
        Tracking().torques(replace(now, regular=True))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("gains", [(400.0, 40.0), (90.0, 11.0)])
@pytest.mark.parametrize("feet", own.DIAGONALS)
@pytest.mark.parametrize("linkage", [FLEXIBLE, LOCKED], ids=["flexible", "locked"])
def test_seven_outputs_accelerate_as_wanted(
    linkage: Linkage, feet: tuple[str, str], gains: tuple[float, float], seed: int
) -> None:
    """By Newton's law for the centre of mass, and by the angles of the links for all else."""
    now = situation(linkage, feet, seed)
    torques = SevenOutputs(*gains).torques(now)
    found = constrained(linkage, now.q, now.rates, feet, torques)
    stiffness, damping = gains

    def course(aim: Array, place: Array, rate: Array) -> Array:
        back: Array = aim[2] + stiffness * (aim[0] - place) + damping * (aim[1] - rate)
        return back

    com = course(now.com, linkage.com(now.q), linkage.com_jacobian(now.q) @ now.rates)
    pushed = found.forces.sum(axis=0) / linkage.mass - [0.0, 9.81]
    assert pushed == pytest.approx(com, abs=1e-9)
    turned = linkage.to_absolute
    angles, rates, gained = turned @ now.q, turned @ now.rates, turned @ found.accelerations
    trunk = [linkage.place[link] for link in now.trunk]
    pitch = course(np.zeros(3), angles[trunk].mean(), rates[trunk].mean())
    assert gained[trunk].mean() == pytest.approx(float(pitch), abs=1e-8)
    assert len(now.links) == 4
    for link, aim in now.links.items():
        place = linkage.place[link]
        expected = course(aim, angles[place], rates[place])
        assert gained[place] == pytest.approx(float(expected), abs=1e-8)
    assert found.forces[0, 0] == pytest.approx(found.forces[1, 0], abs=1e-9)
    assert abs(found.forces[0, 0]) > 1e-3


@pytest.mark.parametrize("feet", [("toe_1", "toe_2"), own.TOES, own.TOES[:1]], ids=len)
def test_seven_outputs_are_finite_on_any_feet(feet: tuple[str, ...]) -> None:
    torques = SevenOutputs().torques(situation(FLEXIBLE, feet))
    assert np.isfinite(torques).all()
    assert np.abs(torques).max() < 1e3


def test_springs_and_dampers_pull_by_what_joints_are_off() -> None:
    """Joint by joint, knee_1 first: 300 N m/rad and 4 N m s/rad, or what is given."""
    now = situation(FLEXIBLE)
    for law, k, c in ((JointSprings(), 300.0, 4.0), (JointSprings(20.0, 0.5), 20.0, 0.5)):
        torques = law.torques(now)
        for i, motor in enumerate(own.MOTORS):
            place = FLEXIBLE.place[motor]
            off, drift = now.joints[0, i] - now.q[place], now.joints[1, i] - now.rates[place]
            assert torques[i] == pytest.approx(k * off + c * drift, abs=1e-12)
