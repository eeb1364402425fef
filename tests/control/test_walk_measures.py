"""Measures of a walk, each worked out anew from the run or known beforehand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp
import xarray as xr
from numpy.typing import NDArray
from scipy.integrate import simpson

from flexspine import load_robot
from flexspine.control.trot import Trot, trot
from flexspine.control.walk_measures import WalkSummary, summarize_walk
from flexspine.control.walk_plan import Pace
from flexspine.control.walk_record import walk_record
from flexspine.models.robot_run import RobotRun, robot_dataset
from tests.control import own_walk as own

Array = NDArray[np.float64]

ROBOT = load_robot("sc618")


@cache
def tracking() -> RobotRun:
    return trot(ROBOT, Trot(seconds=8.0))


@cache
def springs() -> RobotRun:
    """Feet slide now and then."""
    return trot(ROBOT, Trot(seconds=4.4, controller="pd"))


@cache
def pushed() -> RobotRun:
    return trot(ROBOT, Trot(seconds=4.6, push=1.0, push_time=3.1))


RUNS = {"tracking": tracking, "springs": springs, "pushed": pushed}
MAKE = pytest.mark.parametrize("make", RUNS.values(), ids=RUNS)

Make = Callable[[], RobotRun]


@cache
def summary(make: Make) -> WalkSummary:
    return summarize_walk(make())


@cache
def data(make: Make) -> xr.Dataset:
    """At other times than every millisecond."""
    times = np.linspace(0, make().trajectory.duration, 9013)
    return robot_dataset(make(), times=times)


def step_times(run: RobotRun) -> Array:
    """When steps after the first begin."""
    place = run.bound.system.places[sp.Symbol("step", real=True)]
    numbers = np.array([arc.held[place] for arc in run.trajectory.arcs])
    starts = np.array([arc.start for arc in run.trajectory.arcs])
    found: Array = starts[1:][np.diff(numbers) > 0]
    return found


@MAKE
def test_steps_are_counted(make: Make) -> None:
    assert summary(make).steps == len(step_times(make()))
    if make is tracking:
        assert summary(make).steps == 20


@MAKE
def test_distance_is_that_of_the_centre_of_mass(make: Make) -> None:
    """By the moments of all links and toes at the first and the last instant."""
    arcs = make().trajectory.arcs
    places = []
    for state in (arcs[0].series[0, :, 0], make().trajectory.end.states):
        end = own.ends(state[:10], state[10:12])
        base = state[10:12]
        mass, moment = 0.0, np.zeros(2)
        for link, parent in own.PARENTS.items():
            start = base if parent is None else end[parent]
            weight = {"t": 0.16896, "s": 0.264}.get(link[0], 8.1)
            mass, moment = mass + weight, moment + weight * (start + end[link]) / 2
        for place in own.feet(state[:10], state[10:12]).values():
            mass, moment = mass + 0.1796, moment + 0.1796 * place
        places.append(moment / mass)
    assert summary(make).distance == pytest.approx(places[1][0] - places[0][0], abs=1e-9)


@MAKE
def test_speed_and_cost_are_of_whole_pairs_of_steps_in_the_second_half(make: Make) -> None:
    """Work by Simpson's rule on a fine grid, every motor's negative work counted as positive.

    Steps end between samples, which moves the ends by a millisecond out of seconds.
    """
    run, late = make(), step_times(make())
    late = late[late >= run.trajectory.duration / 2]
    late = late[(len(late) + 1) % 2 :]
    assert len(late) % 2 == 1
    times = np.linspace(late[0], late[-1], 20001)
    fine = robot_dataset(run, times=times)
    x = fine["com"].values[:, 0]
    distance = x[-1] - x[0]
    assert summary(make).speed == pytest.approx(distance / (late[-1] - late[0]), rel=1e-3)
    rates = fine["angle_rate"].sel(joint=fine["motor"].values).values
    work = simpson(np.abs(fine["torque"].values * rates), x=times, axis=0).sum()
    weight = (2 * 8.1 + 4 * (0.16896 + 0.264 + 0.1796)) * 9.81
    assert summary(make).cost_of_transport == pytest.approx(work / weight / distance, rel=5e-3)
    net = abs((fine["torque"].values * rates).sum(axis=1)).sum() * (times[1] - times[0])
    assert net / weight / distance < 0.9 * (summary(make).cost_of_transport or 0.0)


@MAKE
def test_normal_forces_are_those_of_feet_that_are_to_stand(make: Make) -> None:
    """Feet 1 and 4 in even steps, 2 and 3 in odd ones, on the ground or not, every millisecond."""
    run, fine = make(), robot_dataset(make(), interval=1e-3)
    times = fine["time"].values
    number = np.searchsorted(step_times(run), times, side="right")
    stands = np.array([[toe in own.DIAGONALS[n % 2] for toe in own.TOES] for n in range(2)])
    forces = fine["grf"].values[..., 1][stands[number % 2]]
    low, high = summary(make).normal
    assert (low, high) == (forces.min(), forces.max())
    if make is tracking:
        assert low > 70
    else:
        assert low < 10


@MAKE
def test_ranges_are_the_least_and_the_largest_of_their_quantities(make: Make) -> None:
    found, fine = summary(make), data(make)
    spine = fine["angle"].sel(joint="spine").values
    assert found.spine["spine"] == pytest.approx((spine.min(), spine.max()), abs=2e-4)
    turns = [fine["link_angle"].sel(link=f"{part}_trunk").values for part in ("hind", "fore")]
    pitch = (turns[0] + turns[1]) / 2
    assert found.pitch == pytest.approx((pitch.min(), pitch.max()), abs=2e-4)
    height = fine["com"].values[:, 1]
    assert found.height == pytest.approx((height.min(), height.max()), abs=1e-5)
    torque = np.abs(fine["torque"].values).max()
    assert found.torque == pytest.approx(torque, rel=0.02)
    forces = np.sqrt((fine["grf"].values ** 2).sum(axis=-1)).max()
    assert found.peak_force == pytest.approx(forces, rel=0.05)


@MAKE
def test_friction_demand_is_of_feet_that_stick(make: Make) -> None:
    fine = data(make)
    forces, worst = fine["grf"].values, 0.0
    for foot in range(4):
        sticks = (fine["stands"].values[:, foot] > 0) & (fine["slides"].values[:, foot] == 0)
        sticks &= forces[:, foot, 1] > 0
        worst = max(worst, float(np.max(np.abs(forces[sticks, foot, 0] / forces[sticks, foot, 1]))))
    assert summary(make).friction_demand == pytest.approx(worst, rel=0.05)
    assert summary(make).friction_demand <= 0.8


@MAKE
def test_sliding_is_a_share_of_the_time(make: Make) -> None:
    """Summed over the times between events."""
    run = make()
    flags = [run.bound.system.places[sp.Symbol(f"slides_{toe}", real=True)] for toe in own.TOES]
    slid = sum(a.end - a.start for a in run.trajectory.arcs if np.any(a.held[flags] != 0))
    assert summary(make).sliding == pytest.approx(slid / run.trajectory.duration, abs=2e-3)
    assert (summary(make).sliding > 0.01) == (make is springs)


@MAKE
def test_the_largest_impulse_is_one_that_stops_a_foot(make: Make) -> None:
    """Normal impulses from what they do: the momentum of the robot upwards at each event."""
    run, back = make(), ROBOT.linkage.to_relative
    whole = []
    for event in run.trajectory.events:
        before = next((a for a in run.trajectory.arcs if a.end == event.time), None)
        if before is None or event.names[0].endswith("off"):
            continue
        speeds = []
        for state in (before(np.array([event.time]))[0], event.after.states):
            q, rates = back @ state[:12], back @ state[12:24]
            speeds.append(float(ROBOT.linkage.com_jacobian(q)[1] @ rates))
        whole.append(ROBOT.linkage.mass * (speeds[1] - speeds[0]))
    assert summary(make).impulse <= max(whole) + 1e-9
    assert summary(make).impulse >= max(whole) / 4 - 1e-9
    events = robot_dataset(run, times=np.array([0.0, 1.0]))["event_impulse"].values
    assert summary(make).impulse == pytest.approx(events[..., 1].max(), abs=0)


@MAKE
def test_errors_are_what_joints_are_off_their_references(make: Make) -> None:
    fine = data(make)
    off = fine["angle"].sel(joint=fine["motor"].values).values - fine["reference"].values
    assert summary(make).error == pytest.approx(float(np.abs(off).max()), rel=0.03)
    mean = np.sqrt(np.trapezoid((off**2).mean(axis=1), fine["time"].values)
                   / make().trajectory.duration)  # fmt: skip
    assert summary(make).mean_error == pytest.approx(mean, rel=0.03)


@MAKE
def test_drift_is_how_far_sticking_feet_get_from_where_they_landed(make: Make) -> None:
    """From places of links in turn; where feet stick for a whole arc they do not move at all."""
    run, worst = make(), 0.0
    stands, slides = (
        [run.bound.system.places[sp.Symbol(f"{kind}_{toe}", real=True)] for toe in own.TOES]
        for kind in ("stands", "slides")
    )
    for arc in run.trajectory.arcs:
        states = arc(np.linspace(arc.start, arc.end, 20))
        places = own.feet(states[:, :10], states[:, 10:12])
        for i, toe in enumerate(own.TOES):
            if arc.held[stands[i]] and not arc.held[slides[i]]:
                off = places[toe] - [places[toe][0, 0], 0.0]
                worst = max(worst, float(np.hypot(*off.T).max()))
    assert summary(make).drift <= 3 * worst + 1e-14
    assert worst < 1e-12


@MAKE
def test_energy_is_accounted_for(make: Make) -> None:
    assert 0 < summary(make).imbalance < 1e-9


class Tampered:
    """A run whose dataset has been changed, to see that measures notice."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, **changes: Callable[[Array], Array]
    ) -> None:
        def changed(run: RobotRun, **options: Any) -> xr.Dataset:
            dataset = robot_dataset(run, **options)
            for name, change in changes.items():
                dataset[name] = (dataset[name].dims, change(dataset[name].values.copy()))
            return dataset

        monkeypatch.setattr("flexspine.control.walk_measures.robot_dataset", changed)


def test_an_energy_that_leaks_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    Tampered(monkeypatch, motor_work=lambda work: work + np.linspace(0, 0.5, len(work)))
    assert summarize_walk(tracking()).imbalance == pytest.approx(0.5, abs=1e-9)


def test_a_foot_that_creeps_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    """3 mm forward and 4 mm up are 5 mm."""

    def creep(places: Array) -> Array:
        places[5000] += [0.003, 0.004]
        return places

    Tampered(monkeypatch, foot=creep)
    assert summarize_walk(tracking()).drift == pytest.approx(0.005, abs=1e-9)


def test_forces_known_beforehand_give_measures_known_beforehand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A force of (30, 40) N on every foot all the time, and no torque but 2 N m at one motor."""

    def forces(grf: Array) -> Array:
        grf[:] = [30.0, 40.0]
        return grf

    def torques(torque: Array) -> Array:
        torque[:] = 0.0
        torque[:, 3] = -2.0
        return torque

    Tampered(monkeypatch, grf=forces, torque=torques)
    found = summarize_walk(tracking())
    assert found.peak_force == pytest.approx(50.0, abs=1e-12)
    assert found.normal == (40.0, 40.0)
    assert found.friction_demand == pytest.approx(0.75, abs=1e-12)
    assert found.torque == 2.0


def test_a_run_without_whole_steps_has_no_speed_and_no_cost() -> None:
    run = trot(ROBOT, Trot(seconds=0.5))
    found = summarize_walk(run)
    assert found.speed is None
    assert found.cost_of_transport is None
    assert found.steps == 1


def test_walking_backwards_costs_as_much_and_counts_backwards() -> None:
    run = trot(ROBOT, Trot(seconds=4.0, gait=Pace(speed=-0.3)))
    found = summarize_walk(run)
    assert found.speed == pytest.approx(-0.3, rel=1e-3)
    assert found.distance < -0.9
    assert (found.cost_of_transport or 0.0) > 0.1


def test_the_record_has_every_measure_and_no_number_that_is_none() -> None:
    run = trot(ROBOT, Trot(seconds=0.5))
    record = walk_record(run, summarize_walk(run))
    assert record["measures"].keys() == asdict(summarize_walk(run)).keys()
    assert record["measures"]["speed"] is None
    assert record["spine"] == {"stiffness": 240.0, "damping": 2.0, "rest": -0.05}
    assert record["outcome"] == "completed"
    assert record["duration"] == 0.5
