"""What results are in a session: a line each, whatever they hold."""

from __future__ import annotations

import pytest

from flexspine import (
    Model,
    Noise,
    Trot,
    examine,
    find_gaits,
    floquet_multipliers,
    load_model,
    load_robot,
    load_walk,
    run_in_space,
    simulate,
    simulate_many,
    stabilize,
    steer,
    stride_map,
    trace_branch,
    trot,
)
from flexspine.models.ground import Ground

LONGEST = 200


@pytest.fixture(scope="module")
def rigid() -> Model:
    return load_model("kamimura2015-rigid")


def test_a_line_tells_of_each(rigid: Model) -> None:
    gait = examine(rigid)
    robot = load_robot("sc618")
    steered = steer(rigid, stabilize(gait), strides=2, noise=Noise(acting=0.001))
    results = [
        rigid,
        rigid.on(Ground.ramp(0.01)),
        simulate(rigid),
        simulate(rigid).trajectory,
        gait,
        floquet_multipliers(gait),
        stride_map(rigid),
        find_gaits(rigid, symmetric=True, starts=3),
        trace_branch(gait, bounds=(4.45, 4.55)),
        simulate_many(rigid, {"height": [0.32, 0.33]}),
        steered,
        robot,
        trot(robot, Trot(seconds=0.5)),
    ]
    for result in results:
        told = repr(result)
        assert told.startswith(f"<{type(result).__name__}"), told
        assert len(told.splitlines()) == 1, told
        assert len(told) < LONGEST, told
    assert "ramp" in repr(results[1])
    assert gait.model.name in repr(gait)
    assert f"{gait.period:.4g} s" in repr(gait)


def test_a_line_tells_of_a_run_in_space() -> None:
    pytest.importorskip("mujoco")
    robot = load_robot("sc618")
    told = repr(run_in_space(robot, load_walk("trot", robot.name), seconds=0.1))
    assert told == "<SpaceRun of sc618, trot: 0.1 s, completed>"
