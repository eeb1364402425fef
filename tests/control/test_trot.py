"""A robot that trots: its plan, its joints, its ground and its energy, each worked out anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
import xarray as xr
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from flexspine import load_robot
from flexspine.control.trot import Trot, trot
from flexspine.control.walk_plan import Pace
from flexspine.errors import ParameterError, UnknownNameError
from flexspine.hybrid.trajectory import Arc
from flexspine.mechanics.stance import passive_forces
from flexspine.models.locking import locked
from flexspine.models.robot_run import RobotRun, robot_dataset
from tests.control import own_walk as own

Array = NDArray[np.float64]

ROBOT = load_robot("sc618")
LINKAGE = ROBOT.linkage
LOCKED = locked(ROBOT, "spine")
PUSHED_AT = 3.1
TICKS = 640  # of a clock, 400 times a second


@cache
def tracking(speed: float = 0.3) -> RobotRun:
    """Under computed torque: twenty seconds at the usual speed, twelve at others."""
    return trot(ROBOT, Trot(seconds=20.0 if speed == 0.3 else 12.0, gait=Pace(speed=speed)))


@cache
def pushed() -> RobotRun:
    return trot(ROBOT, Trot(seconds=4.6, push=1.0, push_time=PUSHED_AT))


@cache
def sampled() -> RobotRun:
    return trot(ROBOT, Trot(seconds=TICKS / 400, rate=400.0))


@cache
def limited() -> RobotRun:
    return trot(ROBOT, Trot(seconds=TICKS / 400, rate=400.0, limit=15.0))


@cache
def springs() -> RobotRun:
    return trot(ROBOT, Trot(seconds=3.8, controller="pd"))


@cache
def dataset(make: Callable[[], RobotRun], interval: float = 1e-3) -> xr.Dataset:
    return robot_dataset(make(), interval=interval)


RUNS = {"tracking": tracking, "pushed": pushed, "sampled": sampled, "springs": springs}


def rate_at(arc: Arc, times: Array) -> Array:
    """How fast the states of an arc change, from its power series."""
    step = np.searchsorted(arc.times, times, side="right") - 1
    step = step.clip(0, len(arc.series) - 1)
    since, found = times - arc.times[step], np.zeros((len(times), arc.series.shape[1]))
    for power in range(arc.series.shape[2] - 1, 0, -1):
        found = found * since[:, None] + power * arc.series[step, :, power]
    return found


def starts_of_steps(run: RobotRun) -> list[tuple[float, int]]:
    """When steps begin, and the number of the first arc in each."""
    place = run.bound.system.places[sp.Symbol("step", real=True)]
    found: list[tuple[float, int]] = []
    for number, arc in enumerate(run.trajectory.arcs):
        if arc.held[place] == len(found):
            found.append((arc.start, number))
    return found


def plan(run: RobotRun, asked: own.Asked | None = None) -> list[own.Step]:
    """What is asked of the joints, step by step, with feet where they came down."""
    times: list[float] = []
    places: list[dict[str, float]] = []
    for step, (time, number) in enumerate(starts_of_steps(run)):
        state = run.trajectory.arcs[number](np.array([time]))[0]
        here = {t: float(p[0]) for t, p in own.feet(state[:10], state[10:12]).items()}
        landed = own.DIAGONALS[step % 2] if step else own.TOES
        times.append(time)
        places.append((places[-1] if step else {}) | {toe: here[toe] for toe in landed})
    return own.steps_of(asked or own.Asked(), times, places)


def known_arcs(run: RobotRun) -> Iterator[tuple[own.Step, Arc, float]]:
    """Arcs of 20 ms and more on exactly the feet that are to stand, and how long swings last."""
    steps, starts = plan(run), np.array([time for time, _ in starts_of_steps(run)])
    for arc in run.trajectory.arcs:
        step = steps[int(np.searchsorted(starts, arc.start, side="right")) - 1]
        end = min(arc.end, step.start + step.asked.stance)
        stands = " + ".join(own.DIAGONALS[step.number % 2])
        if arc.mode == stands and end - arc.start > 0.02:
            yield step, arc, end


def off(step: own.Step, arc: Arc, times: Array) -> tuple[Array, Array]:
    """What joints are off what is asked of them, and how fast that changes."""
    states = arc(times)
    angles, rates = step.joints(times)
    return own.wrapped(angles - own.bends(states[:, :10])), rates - own.bends(states[:, 12:22])


# What the walk is like as a whole.


@pytest.mark.parametrize("speed", [0.2, 0.3, 0.4])
def test_a_trot_keeps_feet_down_and_torques_small(speed: float) -> None:
    run = tracking(speed)
    assert run.outcome.completed, run.outcome
    assert run.trajectory.duration == (20.0 if speed == 0.3 else 12.0)
    data = robot_dataset(run, interval=1e-3)
    forces, stands = data["grf"].values, data["stands"].values > 0
    assert (stands.sum(axis=1) == 2).all()
    assert forces[stands][:, 1].min() >= 40
    assert np.abs(forces[~stands]).max() == 0
    assert (np.abs(forces[stands][:, 0]) / forces[stands][:, 1]).max() <= 0.15
    assert np.abs(data["torque"].values).max() <= 20
    assert 0 < data["event_impulse"].values[..., 1].max() <= 0.05
    assert np.abs(data["slides"].values).max() == 0


def test_feet_that_stand_stay_where_they_are() -> None:
    """From where a foot was when it came down, by the places of all links in turn."""
    run = tracking()
    for arc in run.trajectory.arcs:
        states = arc(np.linspace(arc.start, arc.end, 50))
        places = own.feet(states[:, :10], states[:, 10:12])
        for toe in arc.mode.split(" + "):
            assert np.abs(places[toe] - places[toe][0]).max() <= 1e-10
            assert np.abs(places[toe][:, 1]).max() <= 1e-10


@pytest.mark.parametrize("speed", [0.2, 0.3, 0.4])
def test_the_steady_speed_is_what_was_asked_for(speed: float) -> None:
    """Over ten whole pairs of steps at the end of the run."""
    starts = [time for time, _ in starts_of_steps(tracking(speed))]
    times = np.array([starts[-21], starts[-1]])
    x = robot_dataset(tracking(speed), times=times)["com"].values[:, 0]
    assert (x[1] - x[0]) / (times[1] - times[0]) == pytest.approx(speed, rel=1e-4)
    assert len(starts) == pytest.approx(tracking(speed).trajectory.duration / 0.4, abs=1)


def test_the_same_walk_is_the_same_to_the_last_bit() -> None:
    one, other = (trot(ROBOT, Trot(seconds=1.2)).trajectory for _ in range(2))
    assert one.end.states.tobytes() == other.end.states.tobytes()
    assert [e.time for e in one.events] == [e.time for e in other.events]


def test_a_push_is_made_good_within_a_second() -> None:
    run, step = pushed(), plan(pushed())[-1]
    assert run.outcome.completed
    usual = max(
        float(np.abs(off(each, arc, np.linspace(arc.start, end, 50))[0]).max())
        for each, arc, end in known_arcs(tracking())
    )
    data = dataset(pushed)
    error = np.abs(data["angle"].sel(joint=data["motor"].values).values - data["reference"].values)
    times = data["time"].values
    assert error[times > PUSHED_AT].max() > 20 * usual
    assert error[times > PUSHED_AT + 1.2].max() < 2 * usual
    assert step.speed == pytest.approx(0.3, rel=1e-3)


@pytest.mark.parametrize("name", RUNS)
def test_pushes_and_what_the_ground_gives_back_are_changes_of_momentum(name: str) -> None:
    """At every impact, of however many feet; feet in the air have no share in it.

    Bounces of 1e-14 m and less are left out: at 100 m/s^2 that is a speed of 1.4e-6 m/s of a foot
    whose share of the mass is below 1 kg. Where both feet land at once there are none.
    """
    left_out = 1e-10 if name == "tracking" else 1.4e-6
    run, largest, pushes = RUNS[name](), 0.0, 0
    ends = {arc.end: arc for arc in run.trajectory.arcs if arc.end > arc.start}
    for event in run.trajectory.events:
        if not event.names[0].endswith(("touchdown", "push")) or event.time not in ends:
            continue
        velocities = []
        for states in (ends[event.time](np.array([event.time]))[0], event.after.states):
            q, rates = LINKAGE.to_relative @ states[:12], LINKAGE.to_relative @ states[12:24]
            velocities.append(LINKAGE.com_jacobian(q) @ rates)
        impulses = run.impulses(event)
        change = LINKAGE.mass * (velocities[1] - velocities[0])
        given = [1.0 * event.names.count("push"), 0.0]
        assert change == pytest.approx(impulses.sum(axis=0) + given, abs=left_out)
        heights = [LINKAGE.foot(q, toe)[1] for toe in own.TOES]
        assert (np.abs(impulses[np.array(heights) > 1e-6]) == 0).all()
        largest = max(largest, float(np.abs(change).max()))
        pushes += event.names.count("push")
    assert largest > 1e-3
    assert pushes == (name == "pushed")


@pytest.mark.parametrize("name", RUNS)
def test_energy_is_what_motors_bring_and_dampers_and_impacts_take(name: str) -> None:
    """Work and loss integrated anew, by Gauss's rule on every step of the integrator."""
    run, spine = RUNS[name](), LINKAGE.place["spine"]
    until = 4 if name == "pushed" else 2
    nodes, weights = np.polynomial.legendre.leggauss(12)
    arcs = [arc for arc in run.trajectory.arcs if arc.start < until and arc.end > arc.start]
    spans = [(a, b) for arc in arcs for a, b in zip(arc.times[:-1], arc.times[1:], strict=True)]
    low, high = np.array(spans).T
    grid = ((low + high)[:, None] + (high - low)[:, None] * nodes) / 2
    shares = (high - low)[:, None] * weights / 2
    kept = grid.ravel()
    data = robot_dataset(run, times=kept)
    rates = data["angle_rate"].sel(joint=data["motor"].values).values
    bending = data["angle_rate"].sel(joint="spine").values
    power = (data["torque"].values * rates).sum(axis=1) - 2.0 * bending**2
    for foot in range(4):  # what slides loses
        slides = data["slides"].values[:, foot] != 0
        if slides.any():
            q, speed = _coordinates(run, kept)
            along = (LINKAGE.foot_jacobian(q, [own.TOES[foot]])[:, 0] * speed).sum(axis=1)
            power += slides * along * data["grf"].values[:, foot, 0]
    work = float(power @ shares.ravel())

    def energy(states: Array) -> float:
        q, speed = LINKAGE.to_relative @ states[:12], LINKAGE.to_relative @ states[12:24]
        bend = q[spine] + 0.05
        weight = LINKAGE.mass * 9.81 * LINKAGE.com(q)[1]
        return float(LINKAGE.kinetic_energy(q, speed) + weight + 240 * bend**2 / 2)

    jumps = 0.0
    for arc, after in pairwise(arcs):
        jumps += energy(after.series[0, :, 0]) - energy(arc(np.array([arc.end]))[0])
    whole = energy(arcs[-1](np.array([arcs[-1].end]))[0]) - energy(arcs[0].series[0, :, 0])
    assert whole == pytest.approx(work + jumps, abs=1e-9)
    end = robot_dataset(run, times=np.array([arcs[0].start, np.nextafter(arcs[-1].end, 0)]))
    told = end["motor_work"] - end["dissipated_energy"] - end["impact_loss"]
    assert float(told[1] - told[0]) == pytest.approx(whole, abs=1e-9)
    assert float(end["impact_loss"][1]) == pytest.approx(-jumps, abs=1e-9)
    assert abs(jumps) > 1e-6


def _coordinates(run: RobotRun, times: Array) -> tuple[Array, Array]:
    n = run.robot.linkage.size
    states = np.zeros((len(times), 2 * n + 3))
    for arc, part in run.trajectory.pieces(times):
        states[part] = arc(times[part])
    back = run.robot.linkage.to_relative.T
    return states[:, :n] @ back, states[:, n : 2 * n] @ back


# The plan.


def test_joints_are_asked_to_put_feet_where_the_plan_has_them() -> None:
    """From what is asked of joints to feet, with the trunk level at the height of the hips."""
    run, seen = tracking(), 0.0
    for step in plan(run)[:12]:
        times = step.start + np.linspace(1e-6, 0.399, 40)
        asked = robot_dataset(run, times=times)["reference"]
        a = {name: asked.sel(motor=name).values for name in own.MOTORS}
        thigh_1 = -a["hip_1"]
        thigh_2 = thigh_1 + a["hip_2"]
        x, _ = step.body(times)
        hip = {t: np.stack([x + own.HIPS[t], np.full_like(x, 0.33)], axis=-1) for t in own.TOES}
        up, down = own.THIGH * own.direction(thigh_1), own.THIGH * own.direction(thigh_2)
        found = {
            "toe_1": hip["toe_1"] - up - own.SHANK * own.direction(thigh_1 - a["knee_1"]),
            "toe_2": hip["toe_2"] + down + own.SHANK * own.direction(thigh_2 + a["knee_2"]),
        }
        for leg in "34":
            thigh = a[f"hip_{leg}"]
            found[f"toe_{leg}"] = (
                hip[f"toe_{leg}"]
                + own.THIGH * own.direction(thigh)
                + own.SHANK * own.direction(thigh + a[f"knee_{leg}"])
            )
        for toe in own.TOES:
            assert found[toe] == pytest.approx(step.foot(toe, times)[0], abs=1e-10)
            seen = max(seen, float(found[toe][:, 1].max()))
    assert seen > 0.04


def test_hips_stay_level_at_the_height_that_was_asked_for() -> None:
    data = dataset(tracking)
    spine = data["angle"].sel(joint="spine").values
    assert np.abs(spine).max() < 1e-4
    hind = data["link_start"].sel(link="hind_trunk").values
    fore = data["link_end"].sel(link="fore_trunk").values
    assert np.abs(hind[:, 1] - 0.33).max() < 1e-4
    assert np.abs(fore[:, 1] - 0.33).max() < 1e-4


def test_knees_stay_behind_the_lines_from_hips_to_feet() -> None:
    data = dataset(tracking)
    for leg, toe in zip("1234", own.TOES, strict=True):
        first = leg == "1"  # which is counted from its toe upwards
        knee = data["link_end" if first else "link_start"].sel(link=f"shank_{leg}").values
        hip = data["link_end" if first else "link_start"].sel(link=f"thigh_{leg}").values
        foot = data["foot"].sel(foot_name=toe).values
        down, out = foot - hip, knee - hip
        assert (down[:, 0] * out[:, 1] - down[:, 1] * out[:, 0]).max() < -1e-3


@pytest.mark.parametrize("speed", [0.2, 0.4])
def test_feet_come_straight_down_at_the_landing_speed(speed: float) -> None:
    """At the ends of all swings but the first, which ends where the next step begins."""
    count = 0
    for arc in tracking(speed).trajectory.arcs[2:]:
        state = arc(np.array([arc.end]))[0]
        rates = own.foot_rates(state[:10], state[12:22], state[22:24])
        for toe in set(own.TOES) - set(arc.mode.split(" + ")):
            if arc.end < 12:
                assert rates[toe] == pytest.approx([0.0, -0.05], abs=2e-5)
                count += 1
    assert count > 50


def test_feet_land_ahead_of_their_hips_by_half_a_stance() -> None:
    """At 0.3 m/s a hip passes over its foot half-way through the 0.4 s that this stands."""
    run = tracking()
    for step in plan(run)[10:20]:
        for toe in own.DIAGONALS[step.number % 2]:
            ahead = step.stood[toe] - float(step.x) - own.HIPS[toe]
            assert ahead == pytest.approx(0.3 * 0.4 / 2, abs=1e-5)


def test_feet_swing_as_high_as_asked_for() -> None:
    def low(s: float) -> float:
        lift = np.sin(np.pi * s) ** 2 * (1 - s**2) / own.HIGHEST
        return -(0.04 * lift + 0.05 * 0.4 * s**2 * (1 - s))

    highest = -minimize_scalar(
        low, bounds=(0.3, 0.7), method="bounded", options={"xatol": 1e-9}
    ).fun
    assert 0.04 < highest < 0.043
    heights = dataset(tracking)["foot"].values[2000:, :, 1]
    assert heights.max(axis=0) == pytest.approx(np.full(4, highest), abs=1e-5)


# The law.


@pytest.mark.parametrize("make", [tracking, pushed])
def test_errors_fade_as_a_critically_damped_spring_would_have_it(
    make: Callable[[], RobotRun],
) -> None:
    """``e'' + 40 e' + 400 e = 0``: ``e = (e_0 + (e_0' + 20 e_0) t) exp(-20 t)``."""
    count, largest = 0, 0.0
    for step, arc, end in known_arcs(make()):
        times = np.linspace(arc.start, end, 60)
        error, rate = off(step, arc, times)
        t = (times - arc.start)[:, None]
        expected = (error[0] + (rate[0] + 20 * error[0]) * t) * np.exp(-20 * t)
        assert error == pytest.approx(expected, abs=1e-10)
        count, largest = count + 1, max(largest, float(np.abs(error).max()))
    assert count >= (50 if make is tracking else 10)
    assert largest > (1e-5 if make is tracking else 1e-3)


def test_other_gains_make_other_errors_fade() -> None:
    """Stiffness 100 and damping 8: an error swings at ``sqrt(84)`` within ``exp(-4 t)``."""
    run = trot(ROBOT, Trot(seconds=1.5, stiffness=100.0, damping=8.0, push=1.0, push_time=0.6))
    turn, largest = np.sqrt(84.0), 0.0
    for step, arc, end in known_arcs(run):
        times = np.linspace(arc.start, end, 60)
        error, rate = off(step, arc, times)
        t = (times - arc.start)[:, None]
        swing = error[0] * np.cos(turn * t) + (rate[0] + 4 * error[0]) / turn * np.sin(turn * t)
        assert error == pytest.approx(swing * np.exp(-4 * t), abs=1e-10)
        largest = max(largest, float(np.abs(error).max()))
    assert largest > 1e-3


@pytest.mark.parametrize("name", [*RUNS, "limited"])
def test_forces_and_torques_are_those_that_the_motion_needs(name: str) -> None:
    """``D q'' + h = B t + J^T F`` with ``q''`` from the power series of the motion."""
    run = {**RUNS, "limited": limited}[name]()
    worst = 0.0
    for arc in run.trajectory.arcs[:: max(1, len(run.trajectory.arcs) // 100)]:
        times = np.linspace(arc.start, arc.end, 7)[1:-1]
        if arc.end - arc.start < 1e-5:
            continue
        data = robot_dataset(run, times=times)
        back = LINKAGE.to_relative.T
        q, rates = (part @ back for part in np.split(arc(times)[:, :24], 2, axis=1))
        gains = rate_at(arc, times)[:, 12:24] @ back
        inertial = (LINKAGE.mass_matrix(q) @ gains[..., None])[..., 0]
        forces = data["grf"].values.reshape(len(times), -1, 1)
        pushes = np.swapaxes(LINKAGE.foot_jacobian(q, own.TOES), -1, -2) @ forces
        turned = data["torque"].values @ LINKAGE.actuation.T
        missing = inertial + passive_forces(LINKAGE, q, rates) - turned - pushes[..., 0]
        scale = max(1.0, float(np.abs(data["grf"].values).max()) / 100)
        worst = max(worst, float(np.abs(missing).max()) / scale)
    assert worst < 1e-7


def test_half_as_stiff_a_spine_shifts_torques_but_no_joint() -> None:
    """The straight spine's moment ``k rest`` falls by 6 N m; what holds it up falls with it.

    Cut at the spine: a horizontal force on the fore foot that stands, opposite to that on the
    hind one, brings the moment, by the arm of the hips' height. It turns the hips that stand by
    as much and their knees by the force times their height; legs that swing are left alone. All
    signs follow from the balance of generalized forces at one instant.
    """
    soft = ROBOT.with_values({"spine.stiffness": 120.0})
    times = np.linspace(0.013, 1.993, 199)
    stiff, other = (
        robot_dataset(trot(robot, Trot(seconds=2.0)), times=times) for robot in (ROBOT, soft)
    )
    assert np.abs(stiff["angle"].values - other["angle"].values).max() < 1e-10
    bend = stiff["angle"].sel(joint="spine").values
    moment = -120.0 * (bend + 0.05)  # what the feet have to bring about, counter-clockwise
    change = {m: (other["torque"] - stiff["torque"]).sel(motor=m).values for m in own.MOTORS}
    force = {
        t: (other["grf"] - stiff["grf"]).sel(foot_name=t).values for t in own.TOES
    }  # x forward, y up
    stands = stiff["stands"].values > 0
    hind = np.where(stands[:, 0], force["toe_1"][:, 0], force["toe_2"][:, 0])
    fore = np.where(stands[:, 2], force["toe_3"][:, 0], force["toe_4"][:, 0])
    assert hind == pytest.approx(-fore, abs=1e-7)
    assert all(np.abs(each[:, 1]).max() < 0.01 for each in force.values())
    assert fore == pytest.approx(moment / 0.33, rel=2e-3)
    knees = {t: stiff["link_start"].sel(link=f"shank_{t[-1]}").values[:, 1] for t in own.TOES[1:]}
    knees["toe_1"] = stiff["link_end"].sel(link="shank_1").values[:, 1]
    for place, (toe, knee) in enumerate(zip(own.TOES, ("knee_1", "knee_2", "knee_3", "knee_4"),
                                            strict=True)):  # fmt: skip
        expected = stands[:, place] * np.abs(fore) * knees[toe]
        assert np.abs(change[knee]) == pytest.approx(expected, abs=0.01)
    for hip, place in (("hip_2", 1), ("hip_3", 2), ("hip_4", 3)):
        expected = stands[:, place] * np.abs(moment)
        assert np.abs(change[hip]) == pytest.approx(expected, abs=0.01)
    assert np.abs(change["hip_1"]) == pytest.approx(np.abs(moment), abs=0.01)
    for i in range(20, 199, 40):
        feet = [toe for place, toe in enumerate(own.TOES) if stands[i, place]]
        q = np.zeros(12)
        q[0] = stiff["link_angle"].values[i, 0]
        q[[LINKAGE.place[str(j)] for j in stiff["joint"].values]] = stiff["angle"].values[i]
        unknown = np.hstack([LINKAGE.actuation, LINKAGE.foot_jacobian(q, feet).T])
        needed = np.zeros(12)
        needed[LINKAGE.place["spine"]] = moment[i]
        solved = np.linalg.solve(unknown, needed)
        mine = [*(change[m][i] for m in own.MOTORS), *np.ravel([force[t][i] for t in feet])]
        assert mine == pytest.approx(solved, abs=1e-6)


def test_the_guard_of_a_straight_line_is_the_area_between_feet_and_spine() -> None:
    """The square of the cross product, less that of the least, 1e-3 m^2, in any posture."""
    run, rng = tracking(), np.random.default_rng(1)
    for arc in run.trajectory.arcs[:2]:
        bound = run.bound.mode(arc.mode)
        jump = bound.code.by_name["feet and spine in line"]
        assert jump.guard.ends is not None
        assert jump.guard.ends.name == "singular"
        state = arc(np.array([arc.start + 0.1]))[0]
        values = []
        for turn in (0.0, 0.3, 1.0, 2.0):
            posture = state.copy()
            posture[:10] += rng.normal(0, turn, 10)
            places = own.feet(posture[:10], posture[10:12])
            spine = own.ends(posture[:10], posture[10:12])["hind_trunk"]
            hind, fore = (places[toe] - spine for toe in arc.mode.split(" + "))
            area = hind[0] * fore[1] - hind[1] * fore[0]
            value = bound.evaluate(posture, arc.held)[jump.value]
            assert value == pytest.approx(area**2 - 1e-6, abs=1e-12)
            values.append(area)
        assert values[0] == pytest.approx(0.6 * 0.33, rel=0.05)


# A computer with a clock.


@pytest.mark.parametrize("make", [sampled, limited])
def test_torques_change_at_ticks_of_the_clock_only(make: Callable[[], RobotRun]) -> None:
    """Four times between every two ticks of 2.5 ms."""
    ticks = np.arange(TICKS)[:, None] / 400
    times = (ticks + np.array([2e-5, 0.8e-3, 1.6e-3, 2.48e-3])).ravel()
    torque = robot_dataset(make(), times=times)["torque"].values.reshape(TICKS, 4, 8)
    assert (torque == torque[:, :1]).all()
    changed = np.abs(np.diff(torque[:, 0], axis=0)).max(axis=1) > 0
    assert changed.mean() > 0.99


def test_sampled_joints_stay_close_to_what_they_are_asked_for() -> None:
    """Within 3e-3 rad, while feet land, too."""
    data = dataset(sampled)
    error = np.abs(data["angle"].sel(joint=data["motor"].values).values - data["reference"].values)
    assert 1e-4 < error.max() < 3e-3


def test_limits_of_torques_are_never_exceeded_and_reached() -> None:
    torque = dataset(limited)["torque"].values
    assert np.abs(dataset(sampled)["torque"].values).max() > 15
    assert np.abs(torque).max() == 15.0


def test_a_slow_clock_shakes_stiff_joints_out_of_control() -> None:
    """With 800 N m/rad on 1e-3 kg m^2 joints swing far more often than a hundred times a second."""
    run = trot(ROBOT, Trot(seconds=2.0, controller="pd", stiffness=800.0, rate=100.0))
    assert run.outcome.name == "out_of_control"
    assert "too fast" in run.outcome.message
    assert "sample more often" in run.outcome.advice


@pytest.mark.parametrize("body", ["flexible", "locked"])
@pytest.mark.parametrize("controller", ["com", "pd"])
def test_it_trots_with_a_flexible_and_a_locked_spine(controller: str, body: str) -> None:
    robot = ROBOT if body == "flexible" else LOCKED
    asked = Trot(seconds=2.4, controller=controller)
    run = springs() if (controller, body) == ("pd", "flexible") else trot(robot, asked)
    assert run.outcome.completed, run.outcome
    data = robot_dataset(run, times=np.linspace(0, 2.4, 241))
    assert data["com"].values[:, 1].min() > 0.29
    late = data["time"].values > 1.6
    speed = np.polyfit(data["time"].values[late], data["com"].values[late, 0], 1)[0]
    assert speed == pytest.approx(0.3, rel=0.02)
    if body == "flexible":
        assert np.ptp(data["angle"].sel(joint="spine").values) > 1e-3
    else:
        assert "spine" not in data["joint"].values


def test_springs_pull_joints_by_what_they_are_off() -> None:
    """``t = 300 (to be - is) + 4 (to be' - is')``, the wanted rate by differences."""
    run, checked = springs(), 0
    h = 1e-5
    for step in plan(run)[3:9]:
        times = step.start + np.array([0.1, 0.2, 0.3])
        grid = (times[:, None] + [-h, 0.0, h]).ravel()
        data = robot_dataset(run, times=grid)
        asked = data["reference"].values.reshape(3, 3, 8)
        mine, _ = step.joints(times)
        assert own.wrapped(asked[:, 1] - mine) == pytest.approx(np.zeros((3, 8)), abs=1e-9)
        rate = (asked[:, 2] - asked[:, 0]) / (2 * h)
        here = data.isel(time=slice(1, None, 3)).sel(joint=data["motor"].values)
        expected = 300 * (asked[:, 1] - here["angle"].values)
        expected += 4 * (rate - here["angle_rate"].values)
        assert here["torque"].values == pytest.approx(expected, abs=1e-5)
        checked += 1
    assert checked == 6


# What cannot be asked for.

NAN, INF = float("nan"), float("inf")

REFUSED = {
    "limits without a clock": (Trot(limit=10.0), "10 N m", "rate"),
    "speed beyond sense": (Trot(gait=Pace(speed=-11.0)), "gait.speed = -11", "above -10"),
    "no number": (Trot(gait=Pace(speed=NAN)), "gait.speed = nan", "above -10"),
    "hips too high": (Trot(gait=Pace(height=0.5)), "gait.height = 0.5", "lower the hips"),
    "hips all but too high": (Trot(gait=Pace(height=0.41)), "gait.height = 0.41", "lower the hips"),
    "hips too low": (Trot(gait=Pace(height=0.05)), "gait.height = 0.05", "raise the hips"),
    "feet at the hips": (Trot(gait=Pace(clearance=0.24)), "takes 0.09 m", "gait.clearance"),
    "feet thrown up": (Trot(gait=Pace(landing=5.0)), "takes 0.09 m", "gait.landing"),
    "a push before time": (Trot(push=1.0, push_time=-1.0), "push_time = -1", "above 0"),
    "a push after all": (Trot(seconds=2.0, push=1.0, push_time=3.0), "push_time = 3", "below 2"),
    "a push at no time": (Trot(push=1.0, push_time=NAN), "push_time = nan", "above 0"),
    "hips in the ground": (Trot(gait=Pace(height=-0.1)), "gait.height = -0.1", "above 0"),
    "no steps": (Trot(gait=Pace(ramp=0)), "gait.ramp = 0", "whole number"),
    "half a step": (Trot(gait=Pace(ramp=2.5)), "gait.ramp = 2.5", "whole number"),  # type: ignore[arg-type]
    "no time": (Trot(seconds=0.0), "seconds = 0", "above 0"),
    "endless": (Trot(seconds=INF), "seconds = inf", "above 0"),
    "endless steps": (Trot(gait=Pace(stance=INF)), "gait.stance = inf", "above 0"),
    "no landing": (Trot(gait=Pace(landing=0.0)), "gait.landing = 0", "above 0"),
    "no clock": (Trot(rate=NAN), "rate = nan", "above 0"),
    "negative limit": (Trot(rate=400.0, limit=-1.0), "limit = -1", "above 0"),
    "negative stiffness": (Trot(stiffness=-4.0), "stiffness = -4", "above 0"),
    "a push of no size": (Trot(push=NAN), "push = nan", "above -1000"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_asked_for_is_refused_with_value_and_remedy(case: str) -> None:
    asked, told, remedy = REFUSED[case]
    with pytest.raises(ParameterError) as refused:
        trot(ROBOT, asked)
    assert told in refused.value.message
    assert remedy in refused.value.remedy


def test_unknown_controllers_are_refused_with_a_guess() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'tracking'"):
        trot(ROBOT, Trot(controller="trakcing"))


def test_tracking_every_joint_of_a_locked_robot_is_refused_with_what_works() -> None:
    """Eight joints and four contacts hold twelve numbers, but there are eleven."""
    with pytest.raises(ParameterError, match="overdetermined") as refused:
        trot(LOCKED, Trot(seconds=1.0))
    assert "com" in refused.value.remedy


def test_a_robot_without_legs_is_refused() -> None:
    with pytest.raises(ParameterError, match="0 legs"):
        trot(replace(ROBOT, legs={}), Trot(seconds=1.0))


def test_a_robot_with_two_legs_has_no_diagonals() -> None:
    legs = {name: leg for name, leg in ROBOT.legs.items() if name.endswith("1")}
    with pytest.raises(ParameterError) as refused:
        trot(replace(ROBOT, legs=legs), Trot(seconds=1.0))
    assert refused.value.remedy


def test_steps_that_are_too_long_end_out_of_reach() -> None:
    run = trot(ROBOT, Trot(seconds=2.0, gait=Pace(speed=3.0)))
    assert run.outcome.name == "out_of_reach"
    end = np.array(run.trajectory.end.time)
    step = plan(run, own.Asked(speed=3.0))[-1]
    x, _ = step.body(end)
    reach = [np.hypot(*(step.foot(t, end)[0] - [x + own.HIPS[t], 0.33])) for t in own.TOES]
    assert max(reach) == pytest.approx(0.999 * 0.41, abs=1e-9)


def test_the_settings_are_kept_with_the_run() -> None:
    settings = tracking().settings
    assert settings["controller"] == "tracking"
    assert settings["rate"] is None
    assert {k: v for k, v in settings.items() if k.startswith("gait.")} == {
        f"gait.{k}": v for k, v in asdict(Pace()).items() if k != "stop"
    } | {"gait.stop": None}
    assert trot(ROBOT, Trot(seconds=0.01, controller="qp")).settings["rate"] == 400.0
