"""Forces of a standing robot: statics of the whole body, and optima that nobody betters."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import fsolve, minimize

from flexspine import load_robot
from flexspine.control.distribution import Aim, ForceFamily, Verdict, force_family

Array = NDArray[np.float64]

ROBOT = load_robot("sc618").linkage
TOES = [foot.name for foot in ROBOT.feet]
WEIGHT = ROBOT.mass * 9.81
FRICTION = 0.8


@pytest.fixture(scope="module")
def standing() -> Array:
    """On level ground with bent knees; the second and fourth leg reach a little further back."""
    up, lean = np.pi / 2, 0.55
    q = np.zeros(12)
    q[0] = up + 0.35
    turns = {"knee_1": up - lean - q[0], "hip_1": lean - up, "hip_2": -2 * up + 0.1,
             "hip_3": -up - lean, "knee_3": 0.9, "hip_4": -up - lean + 0.1}  # fmt: skip
    for name, turn in turns.items():
        q[ROBOT.place[name]] = turn

    def heights(knees: Array) -> list[float]:
        q[ROBOT.place["knee_2"]], q[ROBOT.place["knee_4"]] = knees
        return [float(ROBOT.foot(q, toe)[1]) for toe in ("toe_2", "toe_4")]

    fsolve(heights, [0.9, 0.9], xtol=1e-14)
    assert max(abs(ROBOT.foot(q, toe)[1]) for toe in TOES) < 1e-12
    return q


@pytest.mark.parametrize(
    ("feet", "locked", "dimension"),
    [
        (["toe_1", "toe_3"], [], 0),
        (["toe_2", "toe_4"], [], 0),
        (["toe_1", "toe_2", "toe_3"], [], 2),
        (TOES, [], 4),
        (["toe_1", "toe_3"], ["spine"], 1),
        (TOES, ["spine"], 5),
    ],
)
def test_feet_and_a_locked_spine_leave_as_many_free_as_they_add(
    standing: Array, feet: list[str], locked: list[str], dimension: int
) -> None:
    family = force_family(ROBOT, standing, feet, locked=locked)
    assert family.exists
    assert family.dimension == dimension
    verdict = family.choose(Aim.TORQUE, FRICTION).verdict
    assert verdict is (Verdict.FAMILY if dimension else Verdict.UNIQUE)


@pytest.mark.parametrize("feet", [["toe_1", "toe_2"], ["toe_3", "toe_4"], ["toe_1"]])
def test_nobody_stands_on_one_hip_with_a_spine_that_gives(standing: Array, feet: list[str]) -> None:
    found = force_family(ROBOT, standing, feet).choose(Aim.TORQUE, FRICTION)
    assert found.verdict is Verdict.NONE
    assert found.torques is found.forces is None


def members(family: ForceFamily, aim: Aim) -> list[tuple[Array, Array]]:
    """The chosen member, and the first one."""
    found = family.choose(aim, FRICTION)
    assert found.torques is not None
    assert found.forces is not None
    first = family.first[: family.motors], family.first[family.motors :].reshape(-1, 2)
    return [(found.torques, found.forces), first]


@pytest.mark.parametrize("aim", list(Aim))
@pytest.mark.parametrize("feet", [["toe_1", "toe_3"], TOES[:3], TOES], ids="+".join)
def test_feet_carry_the_weight_under_the_centre_of_mass(
    standing: Array, feet: list[str], aim: Aim
) -> None:
    """No horizontal force in all, the weight, and no moment about the centre of mass."""
    com = ROBOT.com(standing)
    for _, forces in members(force_family(ROBOT, standing, feet), aim):
        assert forces.sum(axis=0) == pytest.approx([0.0, WEIGHT], abs=1e-9)
        arms = [ROBOT.foot(standing, toe) - com for toe in feet]
        moment = sum(arm[0] * f[1] - arm[1] * f[0] for arm, f in zip(arms, forces, strict=True))
        assert moment == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("feet", [["toe_1", "toe_3"], TOES], ids="+".join)
def test_a_knee_bears_the_moment_of_its_shank(standing: Array, feet: list[str]) -> None:
    """What is below a knee is held by it alone: foot, shank and the ground under them."""
    for torques, forces in members(force_family(ROBOT, standing, feet), Aim.TORQUE):
        force = dict(zip(feet, forces, strict=True))
        for leg, column in (("3", 5), ("1", 0)):
            shank, toe = f"shank_{leg}", ROBOT.foot(standing, f"toe_{leg}")
            knee = ROBOT.point(standing, shank, 0.25 if leg == "1" else 0.0)
            middle = ROBOT.point(standing, shank, 0.125)
            x, y = force[f"toe_{leg}"]
            arm = toe - knee
            moment = arm[0] * (y - 0.1796 * 9.81) - arm[1] * x
            moment -= (middle - knee)[0] * 0.264 * 9.81
            # Leg 1 is walked upwards: its motor turns the thigh against the shank.
            sign = 1.0 if leg == "1" else -1.0
            assert torques[column] == pytest.approx(sign * moment, abs=1e-9)


def objective(family: ForceFamily, aim: Aim, numbers: Array) -> float:
    found = family.first + family.directions @ numbers
    torques, forces = found[: family.motors], found[family.motors :].reshape(-1, 2)
    if aim is Aim.TORQUE:
        return float(torques @ torques)
    if aim is Aim.SPLIT:
        normals = forces[:, 1]
        return float(((normals - normals.mean()) ** 2).sum())
    return -margin(forces)


def margin(forces: Array) -> float:
    return float((FRICTION * forces[:, 1] - np.abs(forces[:, 0])).min())


@pytest.mark.parametrize("aim", list(Aim))
@pytest.mark.parametrize("feet", [TOES[:3], TOES], ids="+".join)
def test_no_other_member_is_better(standing: Array, feet: list[str], aim: Aim) -> None:
    """Neither what another solver finds nor any of many members about it."""
    family = force_family(ROBOT, standing, feet)
    found = family.choose(aim, FRICTION)
    assert found.forces is not None
    assert found.margin == pytest.approx(margin(found.forces), abs=1e-9)
    assert found.margin >= -1e-9
    whole = np.concatenate([found.torques, found.forces.ravel()])
    mine = np.linalg.lstsq(family.directions, whole - family.first, rcond=None)[0]
    best = objective(family, aim, mine)

    def inside(numbers: Array) -> float:
        forces = (family.first + family.directions @ numbers)[family.motors :].reshape(-1, 2)
        return margin(forces)

    other = minimize(
        lambda x: objective(family, aim, x), np.zeros(family.dimension), method="SLSQP",
        constraints={"type": "ineq", "fun": inside}, options={"maxiter": 500},
    )  # fmt: skip
    assert best <= other.fun + 1e-6 * max(1.0, abs(other.fun))
    rng = np.random.default_rng(0)
    for size in (1e-3, 0.1, 10.0):
        for step in rng.normal(0, size, (200, family.dimension)):
            if inside(mine + step) >= 0:
                assert objective(family, aim, mine + step) >= best - 1e-6 * max(1.0, abs(best))


def test_a_wanted_split_is_kept_where_it_can_be(standing: Array) -> None:
    """Shares between two feet of one hip are free, those between the hips follow from the CoM."""
    family = force_family(ROBOT, standing, TOES)
    equal = family.choose(Aim.SPLIT, FRICTION)
    assert equal.forces is not None
    hind = equal.forces[:2, 1].sum() / WEIGHT
    fore = 1 - hind
    wanted = [0.8 * hind, 0.2 * hind, 0.3 * fore, 0.7 * fore]
    found = family.choose(Aim.SPLIT, FRICTION, wanted)
    assert found.forces is not None
    # The toes of a hip are not at one place, so that shares between hips move a little.
    assert found.forces[:, 1] / WEIGHT == pytest.approx(wanted, abs=0.03)
    again = family.choose(Aim.SPLIT, FRICTION, (found.forces[:, 1] / WEIGHT).tolist())
    assert again.forces is not None
    assert again.forces[:, 1] == pytest.approx(found.forces[:, 1], abs=1e-6)


def test_on_ice_it_cannot_stand_on_two_feet(standing: Array) -> None:
    found = force_family(ROBOT, standing, ["toe_1", "toe_3"]).choose(Aim.TORQUE, 0.0)
    assert found.verdict is Verdict.NOT_STANDING


def test_torques_shift_ground_forces_at_rest(standing: Array) -> None:
    """With three feet and more the same posture is held with different forces."""
    family = force_family(ROBOT, standing, TOES)
    normals = [members(family, aim)[0][1][:, 1] for aim in Aim]
    apart = max(np.abs(one - other).max() for one in normals for other in normals)
    assert apart > 1.0
