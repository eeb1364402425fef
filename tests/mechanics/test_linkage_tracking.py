"""Motors that accelerate as wanted, in symbols, against the same solved in numbers."""

from __future__ import annotations

import heyoka as hy
import numpy as np
import pytest
import sympy as sp

from flexspine import load_robot
from flexspine.hybrid.lowering import Lowering
from flexspine.mechanics.linkage_motion import LinkageMotion, Standing
from flexspine.mechanics.linkage_tracking import follow
from flexspine.mechanics.stance import tracked

ROBOT = load_robot("sc618").linkage
MOTORS = [joint.name for joint in ROBOT.joints if joint.actuated]


@pytest.mark.parametrize("feet", [[], ["toe_3"], ["toe_1", "toe_4"], ["toe_2", "toe_3"]], ids=str)
def test_the_robot_follows_as_in_numbers(feet: list[str]) -> None:
    motion = LinkageMotion(ROBOT)
    wanted = {name: sp.Symbol(f"w_{name}") for name in MOTORS}
    anchors = {name: sp.symbols(f"x_{name} y_{name}") for name in feet}
    found = follow(motion, [Standing(name, anchors[name]) for name in feet], wanted)
    inputs = [*motion.coordinates, *motion.rates, *wanted.values()]
    inputs += [part for anchor in anchors.values() for part in anchor]
    variables = [hy.expression(f"v{i}") for i in range(len(inputs))]
    known = dict(zip(inputs, variables, strict=True))
    lower = Lowering(known, tuple(motion.values), found.definitions, 0)
    outputs = [*found.accelerations, *(found.torques[name] for name in MOTORS)]
    outputs += [part for name in feet for part in found.forces[name]]
    outputs += [] if found.closeness is None else [found.closeness]
    function = hy.cfunc([lower(each) for each in outputs], vars=variables, compact_mode=True)
    numbers = np.array([float(c.xreplace(motion.values)) for c in lower.coefficients])
    rng = np.random.default_rng(3)
    to = ROBOT.to_absolute
    for _ in range(50):
        q, rates = rng.uniform(-1.5, 1.5, 12), rng.normal(0, 2, 12)
        jacobian = ROBOT.foot_jacobian(q, feet)
        if feet:
            rates -= np.linalg.pinv(jacobian) @ (jacobian @ rates)
        aims = rng.normal(0, 20, 8)
        places = np.array([ROBOT.foot(q, name) for name in feet]).ravel()
        answer = function(np.concatenate([to @ q, to @ rates, aims, places]), pars=numbers)
        expected = tracked(ROBOT, q, rates, feet, aims)
        size = max(1, np.abs(expected.accelerations).max())
        np.testing.assert_allclose(answer[:12], to @ expected.accelerations, atol=1e-10 * size)
        most = max(1, np.abs(expected.torques).max())
        np.testing.assert_allclose(answer[12:20], expected.torques, atol=1e-10 * most)
        if feet:
            most = np.abs(expected.forces).max()
            forces = answer[20 : 20 + 2 * len(feet)].reshape(-1, 2)
            np.testing.assert_allclose(forces, expected.forces, atol=1e-10 * most)
        if len(feet) == 2:
            hind, fore = (ROBOT.foot(q, name) for name in feet)
            spine = ROBOT.point(q, "hind_trunk", 0.3)
            (a, b), (c, d) = fore - hind, spine - hind
            assert abs(answer[-1]) == pytest.approx(abs(a * d - b * c), rel=1e-9)


def test_feet_of_one_hip_and_three_feet_are_refused() -> None:
    motion = LinkageMotion(ROBOT)
    wanted = {name: sp.Symbol(f"w_{name}") for name in MOTORS}
    standing = [Standing(name, (sp.S.Zero, sp.S.Zero)) for name in ("toe_1", "toe_2", "toe_3")]
    with pytest.raises(ValueError, match="3 feet hold"):
        follow(motion, standing, wanted)
    with pytest.raises(ValueError, match="2 feet at one hip hold"):
        follow(motion, standing[:2], wanted)
