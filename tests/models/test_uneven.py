"""Bounding on ground that is not flat."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from flexspine import (
    Model,
    Run,
    examine,
    find_gaits,
    load_model,
    simulate,
    simulate_many,
    stride_map,
    to_dataset,
)
from flexspine.errors import ParameterError, StateError
from flexspine.models.ground import Ground
from flexspine.parameters import values

Array = NDArray[np.float64]

FLAT = Ground("flat", ((0.3, 0.0), (0.55, 0.0), (7.0, 0.0)))


def touchdowns(run: Run, sides: str = "fh") -> list[tuple[float, float]]:
    """Where feet came down."""
    places = {str(symbol): i for symbol, i in run.trajectory.bound.system.places.items()}
    return [
        (float(event.after.held[places[f"s_{s}"]]), float(event.after.held[places[f"z_{s}"]]))
        for event in run.trajectory.events
        for name in event.names
        if name.endswith("touchdown") and (s := name[0]) in sides
    ]


def test_flat_ground_in_pieces_changes_nothing(flexible: Model) -> None:
    """Some hundred looks at the ground, a passive and unstable gait: still the same six strides."""
    one, other = simulate(flexible, strides=6), simulate(flexible.on(FLAT), strides=6)
    assert one.phases == other.phases
    assert [e.names for e in one.trajectory.events] == [e.names for e in other.trajectory.events]
    assert other.trajectory.end.states == pytest.approx(one.trajectory.end.states, abs=1e-9)


def test_everything_rises_with_the_ground(flexible: Model) -> None:
    raised = Ground("raised", tuple((x, y + 5.0) for x, y in FLAT.points))
    one, other = simulate(flexible, strides=3), simulate(flexible.on(raised), strides=3)
    shift = np.zeros(len(one.trajectory.end.states))
    shift[1] = 5.0
    assert other.trajectory.end.states == pytest.approx(one.trajectory.end.states + shift, abs=1e-9)


@pytest.mark.parametrize("height", [0.008, -0.03])
def test_beyond_a_step_it_goes_on_as_from_another_apex_height(
    flexible: Model, height: float
) -> None:
    """The fore toe is above the face at an apex, so flat runs before and after it tell the rest."""
    before = simulate(flexible, strides=1)
    x = float(before.trajectory.end.states[0])
    face = float(to_dataset(before)["fore_toe_x"][-1])
    lower = {**before.apexes[-1], "height": before.apexes[-1]["height"] - height}
    after = simulate(flexible.with_values(apex=lower), strides=2)
    run = simulate(flexible.on(Ground.step(height, at=face)), strides=3)
    assert run.outcome.completed
    assert run.phases == (*before.phases, *after.phases[1:])
    end, expected = run.trajectory.end, after.trajectory.end
    assert end.time == pytest.approx(before.trajectory.end.time + expected.time, abs=1e-10)
    shift = np.zeros(len(expected.states))
    shift[:2] = x, height
    assert end.states == pytest.approx(expected.states + shift, abs=1e-8)


GROUNDS = {
    "slope": Ground.slope(-1.5, at=0.2),
    "ramp": Ground.ramp(0.01, 1.0, at=0.4),
    "waves": Ground.waves(0.004, 0.7, at=0.3),
    "rough": Ground.rough(0.004, 0.11, 20.0, seed=5, at=0.3),
    "blocks": Ground.blocks(0.004, 0.35, 20.0, seed=0, at=0.3),
}


@pytest.mark.parametrize("kind", GROUNDS)
def test_feet_stand_on_the_ground_and_energy_stays(flexible: Model, kind: str) -> None:
    run = simulate(flexible.on(GROUNDS[kind]), strides=3)
    assert run.outcome.completed, str(run.outcome)
    feet = touchdowns(run)
    assert len(feet) >= 6
    assert np.ptp([y for _, y in feet]) > 1e-3
    for x, y in feet:
        assert y == pytest.approx(GROUNDS[kind].height(x), abs=1e-12)
    data = to_dataset(run)
    total = data["total_energy"].values
    assert np.ptp(total) < 1e-10 * total[0]
    assert float(data["fore_toe_y"].where(data["phase"] == "FS").max()) == pytest.approx(
        max(y for _, y in touchdowns(run, "f")), abs=1e-12
    )


def rigid_run(model: Model, height: Callable[[float], float], until: float) -> Array:
    """The rigid bounder once more: Newton and Euler, DOP853, the slope and all by hand."""
    p = values(model.parameters)
    m, inertia, g = p["body.mass"], p["body.inertia"], p["gravity"]
    sides = ("fore", "hind")
    arm = {"fore": p["fore.hip_offset"], "hind": -p["hind.hip_offset"]}
    k = {s: p[f"{s}.leg.stiffness"] for s in sides}
    l0 = {s: p[f"{s}.leg.rest_length"] for s in sides}
    gamma = model.touchdown

    def hip(q: Array, s: str) -> Array:
        return np.array([q[0] + arm[s] * math.cos(q[2]), q[1] + arm[s] * math.sin(q[2])])

    def toe(q: Array, s: str) -> Array:
        return hip(q, s) + l0[s] * np.array([math.sin(gamma[s]), -math.cos(gamma[s])])

    time, toes = 0.0, dict[str, Array]()
    a = model.apex
    q = np.array([0, a["height"], a["pitch"], a["speed"], 0, a["pitch_rate"]], dtype=float)
    while time < until:

        def field(_: float, q: Array) -> Array:
            force, torque = np.array([0.0, -m * g]), 0.0
            for s, foot in toes.items():
                at = hip(q, s)
                leg = at - foot
                length = float(np.hypot(*leg))
                push = k[s] * (l0[s] - length) * leg / length
                force = force + push
                lever = at - q[:2]
                torque += lever[0] * push[1] - lever[1] * push[0]
            return np.array([*q[3:], *(force / m), torque / inertia])

        events = []
        for s in sides:
            if s in toes:

                def event(_: float, q: Array, s: str = s, foot: Array = toes[s]) -> float:
                    return l0[s] - float(np.hypot(*(hip(q, s) - foot)))
            else:

                def event(_: float, q: Array, s: str = s) -> float:
                    foot = toe(q, s)
                    return float(foot[1]) - height(float(foot[0]))

            event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
            events.append(event)
        got = solve_ivp(
            field, (time, until), q, method="DOP853", rtol=2.3e-14, atol=1e-14, events=events,
            max_step=2e-3,
        )  # fmt: skip
        time, q = float(got.t[-1]), got.y[:, -1]
        for s, times in zip(sides, got.t_events, strict=True):
            if len(times):
                if s in toes:
                    del toes[s]
                else:
                    toes[s] = toe(q, s)
    return q


@pytest.mark.parametrize("kind", ["waves", "slope"])
def test_a_second_implementation_runs_the_same_over_slopes_and_waves(kind: str) -> None:
    model = load_model("kamimura2015-rigid")
    here, wave = 0.3, (0.004, 0.7)
    track = {"waves": Ground.waves(*wave, at=here), "slope": Ground.slope(-1.5, at=here)}[kind]

    def height(x: float) -> float:
        if x < here:
            return 0.0
        if kind == "slope":
            return -math.tan(math.radians(1.5)) * (x - here)
        return wave[0] * math.sin(2 * math.pi * (x - here) / wave[1])

    run = simulate(model.on(track), duration=0.5)
    assert run.outcome.completed
    assert len(touchdowns(run)) >= 3
    places = run.model.state_names
    ours = dict(zip(places, run.trajectory.end.states.tolist(), strict=True))
    theirs = rigid_run(model, height, 0.5)
    names = ("com_x", "com_y", "pitch", "com_x_rate", "com_y_rate", "pitch_rate")
    assert [ours[n] for n in names] == pytest.approx(theirs.tolist(), abs=2e-8)


def test_a_foot_against_a_face_stumbles(flexible: Model) -> None:
    """The fore foot comes down 5 ms before the first touchdown's place, lower than the face."""
    flat = touchdowns(simulate(flexible.on(FLAT)))[0][0]
    run = simulate(flexible.on(Ground.step(0.05, at=flat - 0.02)))
    assert run.outcome.name == "stumbled"
    assert "fore toe against a face" in run.outcome.message
    assert run.trajectory.crossings == ()
    higher = simulate(flexible.on(Ground.step(0.05, at=flat + 0.02)), duration=0.02)
    assert higher.outcome.completed


def test_a_body_against_a_wall_stumbles_and_one_on_a_hill_falls(flexible: Model) -> None:
    wall = simulate(flexible.on(Ground("wall", ((0.5, 0.0), (0.5, 1.0)))))
    assert wall.outcome.name == "stumbled"
    hill = Ground.ramp(0.5, 0.6, at=0.35)
    # Toes come down on the hill or not; what counts is that nothing passes through it.
    run = simulate(flexible.on(hill), strides=3)
    assert run.outcome.name == "fell"
    assert "on the ground" in run.outcome.message
    end = run.trajectory.end
    low = [point for point in run.outcome.message.split() if point in ("hip", "joint", "CoM")]
    assert low
    data = to_dataset(run)
    for point in ("fore_hip", "hind_hip", "spine_joint", "com"):
        clear = data[f"{point}_y"].values - hill.heights(data[f"{point}_x"].values)
        assert clear.min() > -1e-9, point
    assert end.time == pytest.approx(float(data["time"][-1]))


def test_a_peak_between_two_looks_is_not_passed_through(flexible: Model) -> None:
    saw = Ground("saw", ((0.98, 0.0), (1.0, 0.336), (1.0, 0.0)))
    assert not simulate(flexible.on(saw), strides=3).outcome.completed


def test_toes_at_the_start_look_at_the_ground_before_they_land(flexible: Model) -> None:
    """What would be a touchdown on ground at zero is in the air above lower ground."""
    lower = Ground("lower", ((0.0, -0.02),))
    flat = simulate(flexible)
    landing = next(e for e in flat.trajectory.events if "touchdown" in e.names[0]).after
    start = dict(zip(flexible.state_names, landing.states.tolist(), strict=True))
    run = simulate(flexible.on(lower), duration=0.001, state=start)
    assert run.phases == ("DF",)
    high = {**start, "com_y": start["com_y"] + 1e-6}
    one, other = (simulate(flexible.on(lower), duration=0.05, state=s) for s in (start, high))
    assert one.phases == other.phases
    with pytest.raises(StateError, match="on the ground"):
        simulate(flexible.on(Ground("hill", ((0.0, 0.4),))), duration=0.1, state=start)


@pytest.mark.parametrize("far", [1e3, 1e4, 1e5])
def test_kilometres_away_it_bounds_as_here(flexible: Model, far: float) -> None:
    here = simulate(flexible)
    start = dict(zip(flexible.state_names, flexible.apex_state().states.tolist(), strict=True))
    there = simulate(flexible, strides=1, state={**start, "com_x": far})
    assert there.outcome.completed
    assert there.phases == here.phases
    shift = np.zeros(len(start))
    shift[0] = far
    moved = there.trajectory.end.states - shift
    assert moved == pytest.approx(here.trajectory.end.states, abs=1e-9 * far / 1e3)


def test_legs_on_the_ground_at_the_start_stand_on_it(flexible: Model) -> None:
    start = {"com_x": 2.0, "com_y": 0.40, "com_x_rate": 3.0}
    ramp = Ground.ramp(0.1, 2.0, at=1.0)
    run = simulate(flexible.on(ramp), duration=0.001, state=start, toes={"fore": 2.3})
    assert run.phases[0] == "FS"
    data = to_dataset(run)
    assert float(data["fore_toe_y"][0]) == pytest.approx(0.065)


def test_gaits_sweeps_and_derivatives_are_of_flat_ground(flexible: Model) -> None:
    model = flexible.on(Ground.slope(1.0))
    for ask in (examine, stride_map, simulate_many):
        with pytest.raises(ParameterError, match="flat ground"):
            ask(model)
    with pytest.raises(ParameterError, match="flat ground"):
        find_gaits(model, {"energy": 290.0, "height": 0.32, "mean_speed": 4.5}, starts=1)


def test_a_dataset_shows_the_ground_below_the_run(flexible: Model) -> None:
    track = GROUNDS["rough"]
    data = to_dataset(simulate(flexible.on(track)))
    assert data.attrs["ground"] == track.name
    heights = track.heights(data["ground_x"].values)
    assert data["ground_y"].values == pytest.approx(heights)
    assert float(data["ground_x"][0]) < 0 < float(data["com_x"][-1]) < float(data["ground_x"][-1])
    assert "ground_x" not in to_dataset(simulate(flexible))
    assert replace(model := flexible.on(track), ground=None) == flexible.on(None) == flexible
    assert model != flexible
