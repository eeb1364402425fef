"""Robots on the ground: against a second implementation, and against what contact means."""

from __future__ import annotations

from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

from flexspine import Robot, load_robot
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.outcome import Outcome
from flexspine.hybrid.trajectory import Event, Trajectory
from flexspine.mechanics.complementarity import Contact
from flexspine.models.articulated import DISSIPATED, LOSS, WORK, impulse
from flexspine.models.bound_robot import BoundRobot, Push
from flexspine.models.drive import Drive
from flexspine.models.footing import Footing
from tests.robot_by_scipy import Falling, Happening
from tests.robots import TOLERANCE, Steady, above_ground, dropped, fallen_from

Array = NDArray[np.float64]

TOES = ["toe_1", "toe_2", "toe_3", "toe_4"]
WAYS = {Contact.STICK: 0, Contact.SLIDE_FORWARD: 1, Contact.SLIDE_BACK: -1}

# N m; all but the spine and the first leg's knee.
TORQUES = {"knee_2": 3.0, "hip_1": -4.0, "hip_2": 1.5, "hip_3": 2.0, "knee_4": -2.5}

PUSH = Push(0.18, (3.0, -1.0), "fore_trunk")

# Friction, whether the motors do anything, whether it is pushed.
RUNS = [(0.3, False, False), (0.8, False, False), (2.0, False, False), (0.8, True, False),
        (0.5, True, True)]  # fmt: skip
SECONDS = 0.27


def robot_of(friction: float) -> Robot:
    return load_robot("sc618", {"friction": friction})


@cache
def run_of(friction: float, driven: bool, pushed: bool) -> tuple[BoundRobot, Trajectory]:
    robot = robot_of(friction)
    drive = Steady(robot, TORQUES) if driven else Drive(robot)
    return dropped(drive, SECONDS, push=PUSH if pushed else None)


@cache
def theirs(friction: float, driven: bool) -> tuple[Falling, list[Happening]]:
    robot = robot_of(friction)
    other = Falling(robot, TORQUES if driven else None)
    return other, other.run(*above_ground(robot), SECONDS)


def feet_of(footing: Footing) -> dict[str, int]:
    """Feet on the ground: 0, 1 or -1."""
    return {foot: WAYS[does] for foot, does in footing.contacts}


def samples(run: Trajectory, count: int = 40) -> list[tuple[Array, Array, Array, str]]:
    """Times, states and held variables of every arc, sampled densely, and its mode."""
    found = []
    for arc in run.arcs:
        times = np.linspace(arc.start, arc.end, count)
        found.append((times, arc(times), arc.held, arc.mode))
    return found


def before(run: Trajectory, event: Event) -> Array:
    """The states right before an event."""
    arc = next(arc for arc in run.arcs if arc.end == event.time)
    return arc(np.array([event.time]))[0]


def split(bound: BoundRobot, states: Array) -> tuple[Array, Array]:
    """Coordinates and rates."""
    n, back = bound.linkage.size, bound.linkage.to_relative
    return states[..., :n] @ back.T, states[..., n : 2 * n] @ back.T


def footing_of(bound: BoundRobot, held: Array) -> Footing:
    return Footing.in_flags(dict(zip(bound.system.held, held, strict=True)), bound.robot.feet)


@pytest.mark.parametrize(("friction", "driven"), [run[:2] for run in RUNS if not run[2]])
def test_it_falls_as_by_other_means(friction: float, driven: bool) -> None:
    """Onto toes that slide or stick, bounce, come to rest, slip back and lift off.

    Forces may be out of their cones by 1e-7 N, which takes them some 1e-9 s; their states are taken
    on to our instants.
    """
    bound, run = run_of(friction, driven, False)
    other, events = theirs(friction, driven)
    assert [event.names for event in run.events] == [(event.name,) for event in events]
    assert len(events) >= 18
    for ours, theirs_ in zip(run.events, events, strict=True):
        assert feet_of(footing_of(bound, ours.after.held)) == theirs_.feet
        late = ours.time - theirs_.time
        assert abs(late) <= 2e-9
        gain, _ = other.motion(theirs_.q, theirs_.rates, theirs_.feet)
        q, rates = split(bound, ours.after.states)
        np.testing.assert_allclose(q, theirs_.q + late * theirs_.rates, rtol=0, atol=1e-10)
        fastest = np.abs(rates).max()
        np.testing.assert_allclose(rates, theirs_.rates + late * gain, rtol=0, atol=1e-9 * fastest)


@pytest.mark.parametrize("run", RUNS, ids=str)
def test_forces_of_the_ground_are_those_of_newton(run: tuple[float, bool, bool]) -> None:
    """As observed between events, against Pinocchio's."""
    bound, trajectory = run_of(*run)
    other = Falling(bound.robot, TORQUES if run[1] else None)
    for _, states, held, mode in samples(trajectory, 5):
        seen = trajectory.bound.observe(mode, states, held)
        feet = feet_of(footing_of(bound, held))
        for i, state in enumerate(states):
            _, forces = other.motion(*split(bound, state), feet)
            expected = dict(zip(feet, forces, strict=True))
            for toe in TOES:
                found = [seen[f"force_{axis}_{toe}"][i] for axis in "xy"]
                size = np.abs(forces).max(initial=1.0)
                wanted = expected.get(toe, np.zeros(2))
                np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-8 * size)


@pytest.mark.parametrize("run", RUNS, ids=str)
def test_energy_is_accounted_for(run: tuple[float, bool, bool]) -> None:
    """To 1e-10 of what there is; steady motors work their torques times the bends."""
    bound, trajectory = run_of(*run)
    linkage, places = bound.linkage, bound.system.places
    start, _ = split(bound, trajectory.start.states)
    total = []
    for _, states, held, _ in samples(trajectory):
        q, rates = split(bound, states)
        kinetic, potential = linkage.kinetic_energy(q, rates), linkage.potential_energy(q)
        spent = states[:, places[DISSIPATED]] + held[places[LOSS]] - states[:, places[WORK]]
        total.append(kinetic + potential + spent)
        bends = (q - start) if run[1] else np.zeros_like(q)
        work = sum(t * bends[:, linkage.place[joint]] for joint, t in TORQUES.items())
        np.testing.assert_allclose(states[:, places[WORK]], work, rtol=0, atol=1e-11)
        assert np.all(np.diff(states[:, places[DISSIPATED]]) >= -1e-15)
    whole = np.concatenate(total)
    assert np.ptp(whole) <= 1e-10 * whole[0]
    assert trajectory.end.states[places[DISSIPATED]] > 0.05


@pytest.mark.parametrize("run", RUNS, ids=str)
def test_impulses_change_momentum_and_take_energy(run: tuple[float, bool, bool]) -> None:
    """Of the whole body: x and y. The ground takes -L (v- + v+) / 2 of energy from every foot.

    Bounces too low to count, of some 1e-6 m/s, are taken away without an impulse.
    """
    bound, trajectory = run_of(*run)
    other = Falling(bound.robot)
    linkage, places = bound.linkage, bound.system.places
    hits = [e for e in trajectory.events if e.names[0].endswith(("touchdown", "push"))]
    assert len(hits) >= 8
    for event in hits:
        q, rates = split(bound, before(trajectory, event))
        _, after = split(bound, event.after.states)
        held = event.after.held
        arc = next(arc for arc in trajectory.arcs if arc.end == event.time)
        impulses = np.array([[held[places[part]] for part in impulse(toe)] for toe in TOES])
        middle = (rates + after) / 2
        lost = -impulses.ravel() @ linkage.foot_jacobian(q, TOES) @ middle
        push = np.zeros(2)
        if event.names == ("push",):
            push = np.array(PUSH.impulse)
            lost -= push @ linkage.point_jacobian(q, "fore_trunk", 0.15) @ middle
        gained = linkage.mass * linkage.com_jacobian(q) @ (after - rates)
        touching = list(footing_of(bound, event.after.held).feet)
        bounce = 0.0
        if event.names != ("push",) and touching:
            names = [toe for toe in TOES if impulses[TOES.index(toe)].any() or toe in touching]
            stopped = other.hit(q, rates, names)
            bounce = float((other.jacobian(q, touching) @ stopped)[1::2].max())
            assert bounce <= 1e-5
        slack = 1e-11 + linkage.mass * max(bounce, 0.0)
        np.testing.assert_allclose(gained, impulses.sum(axis=0) + push, rtol=0, atol=slack)
        assert held[places[LOSS]] - arc.held[places[LOSS]] == pytest.approx(lost, abs=slack)
        if event.names != ("push",):
            assert lost >= 0
        assert impulses[:, 1].min() >= -1e-12
        grip = bound.robot.friction * impulses[:, 1]
        assert np.all(np.abs(impulses[:, 0]) <= grip + 1e-10 * np.abs(impulses).max())


@pytest.mark.parametrize("run", RUNS, ids=str)
def test_feet_stand_and_push_as_feet_do(run: tuple[float, bool, bool]) -> None:
    """They do not move while they stick, never sink, never pull, and friction has its cone."""
    bound, trajectory = run_of(*run)
    linkage, friction = bound.linkage, bound.robot.friction
    since: dict[str, float] = {}
    stuck = slid = 0
    for _, states, held, mode in samples(trajectory):
        footing = footing_of(bound, held)
        q, rates = split(bound, states)
        seen = trajectory.bound.observe(mode, states, held)
        for toe in TOES:
            place = linkage.foot(q, toe)
            speed = (linkage.foot_jacobian(q, [toe])[:, 0, :] * rates).sum(axis=-1)
            tangent, normal = seen[f"force_x_{toe}"], seen[f"force_y_{toe}"]
            does = footing.does(toe)
            assert place[:, 1].min() >= -1e-12
            assert normal.min() >= -1e-6
            assert np.all(np.abs(tangent) <= friction * normal + 1e-6)
            if does is Contact.STICK:
                stuck += 1
                since.setdefault(toe, place[0, 0])
                assert np.abs(place[:, 0] - since[toe]).max() <= 1e-12
                assert np.abs(place[:, 1]).max() <= 1e-12
                continue
            since.pop(toe, None)
            if does is Contact.OPEN:
                assert not tangent.any()
                assert not normal.any()
                continue
            slid += 1
            assert np.abs(place[:, 1]).max() <= 1e-12
            assert (WAYS[does] * speed).min() >= -1e-11
            np.testing.assert_allclose(tangent, -WAYS[does] * friction * normal, atol=1e-9)
    assert stuck
    assert slid


@pytest.mark.parametrize("run", RUNS, ids=str)
def test_feet_let_go_where_forces_leave_their_cones(run: tuple[float, bool, bool]) -> None:
    """By Newton's equations in other hands: at the border at the event, inside before it."""
    bound, trajectory = run_of(*run)
    other = Falling(bound.robot, TORQUES if run[1] else None)
    counted = 0
    for event in trajectory.events:
        toe, _, kind = event.names[0].partition(" ")
        if kind != "lift-off" and not kind.startswith("begins"):
            continue
        arc = next(arc for arc in trajectory.arcs if arc.end == event.time)
        feet = feet_of(footing_of(bound, arc.held))
        key = kind, toe
        span = min(1e-3, arc.end - arc.start)
        for ago in (0.0, 0.3 * span, 0.9 * span):
            q, rates = split(bound, arc(np.array([event.time - ago]))[0])
            slack = other.guards(feet, q, rates)[key]
            if ago:
                assert slack > 0
            else:
                assert abs(slack) <= 2e-7
        counted += 1
    assert counted >= 2


def test_friction_decides_whether_toes_land_sliding() -> None:
    """At 1 m/s on to 0.3 they slide, on to 0.8 the first one sticks."""
    for friction, does in ((0.3, Contact.SLIDE_FORWARD), (0.8, Contact.STICK)):
        bound, run = run_of(friction, False, False)
        assert footing_of(bound, run.events[0].after.held).does("toe_3") is does


# One link with two feet.

MASS, LENGTH, COM, GRAVITY = 3.0, 0.8, 0.5, 9.81
ROD = """
friction = 0.4
[links.rod]
length = 0.8
mass = 3.0
com = 0.5
inertia = 1.0
[feet.hind]
link = "rod"
at = 0.0
[feet.fore]
link = "rod"
"""


@pytest.fixture(scope="module")
def rod(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    file: Path = tmp_path_factory.mktemp("robots") / "rod.toml"
    file.write_text(ROD)
    return load_robot(file)


@pytest.mark.parametrize("speed", [1.0, -1.3])
@pytest.mark.parametrize("friction", [0.1, 0.4])
def test_a_rod_that_lands_flat_slides_to_rest_as_coulomb_says(
    rod: Robot, friction: float, speed: float
) -> None:
    """It loses mu sqrt(2 g h) on landing, and then mu g."""
    fall = np.sqrt(2 * 0.02 / GRAVITY)
    slower = abs(speed) - friction * GRAVITY * fall
    way = np.sign(speed)
    stop = fall + slower / (friction * GRAVITY)
    where = way * (abs(speed) * fall + slower**2 / (2 * friction * GRAVITY))
    slippery = rod.with_values({"friction": friction})
    q, rates = np.array([0.0, 0.0, 0.02]), np.array([0.0, speed, 0.0])
    bound, run = fallen_from(Drive(slippery), q, rates, stop + 1.0)
    assert run.outcome.completed
    landing = run.events[0]
    assert landing.time == pytest.approx(fall, abs=1e-12)
    assert set(footing_of(bound, landing.after.held).feet) == {"hind", "fore"}
    # Its other end, which cannot stick as well, may seem to stop once more by rounding errors.
    stops = [event.time for event in run.events if "stops" in event.names[0]]
    assert stops[0] == pytest.approx(stop, abs=1e-11)
    assert run.end.states[:3] == pytest.approx([0.0, where, 0.0], abs=1e-12)
    assert run.end.states[3:6] == pytest.approx([0.0, 0.0, 0.0], abs=1e-11)
    energy = MASS * slower**2 / 2
    assert run.end.states[bound.system.places[DISSIPATED]] == pytest.approx(energy, abs=1e-12)
    arc = run.arcs[1]
    seen = run.observe(arc, arc(np.array([arc.start, arc.end])))
    # Weight on the feet by its levers.
    for foot, share in (("hind", 1 - COM / LENGTH), ("fore", COM / LENGTH)):
        force = share * MASS * GRAVITY
        assert seen[f"force_y_{foot}"] == pytest.approx([force] * 2, rel=1e-12)
        assert seen[f"force_x_{foot}"] == pytest.approx([-way * friction * force] * 2, rel=1e-12)


def test_a_rod_that_lands_flat_stops_at_once(rod: Robot) -> None:
    """Both ends share its momentum by their levers."""
    bound, run = fallen_from(Drive(rod), np.array([0.0, 0.0, 0.1]), np.zeros(3), 1.0)
    fall = np.sqrt(2 * 0.1 / GRAVITY)
    (event,) = run.events
    assert event.time == pytest.approx(fall, abs=1e-12)
    assert np.abs(event.after.states[:6]).max() <= 1e-12
    whole = MASS * GRAVITY * fall
    held, places = event.after.held, bound.system.places
    assert held[places[impulse("hind")[1]]] == pytest.approx(whole * (1 - COM / LENGTH), rel=1e-11)
    assert held[places[impulse("fore")[1]]] == pytest.approx(whole * COM / LENGTH, rel=1e-11)
    assert held[places[LOSS]] == pytest.approx(MASS * GRAVITY * 0.1, rel=1e-11)


def test_a_rod_that_lies_stays(rod: Robot) -> None:
    _, run = fallen_from(Drive(rod), np.zeros(3), np.zeros(3), 5.0)
    assert not run.events
    assert run.outcome.completed
    assert np.abs(run.end.states[:6]).max() <= 1e-15


def test_a_rod_rocks_from_end_to_end_as_housner_says(rod: Robot) -> None:
    """Let go on one end it turns about it as a pendulum; then spins by conserved momentum.

    About the end that lands there is m c (L - c) less than the inertia at the centre before, and
    m c^2 more after; the other end rises.
    """
    inertia, angle = 1.0, 0.3
    fore = LENGTH - COM
    about = {"hind": inertia + MASS * COM**2, "fore": inertia + MASS * fore**2}
    arms = {"hind": COM, "fore": fore}
    rough = rod.with_values({"friction": 0.9})
    bound, run = fallen_from(Drive(rough), np.array([angle, 0.0, 0.0]), np.zeros(3), 0.66)

    def seconds(foot: str, high: float, spin: float) -> float:
        """A pendulum turns from a height to the ground, begun with a spin."""
        pull = 2 * MASS * GRAVITY * arms[foot] / about[foot]

        # s^2 is the height that is lost, which takes the root's singularity away.
        def rate(s: float) -> float:
            sine = np.sin(high) - s**2
            return 2 * s / np.sqrt(1 - sine**2) / np.sqrt(spin**2 + pull * s**2)

        return float(quad(rate, 0.0, np.sqrt(np.sin(high)), epsabs=1e-13, epsrel=1e-13)[0])

    time = seconds("hind", angle, 0.0)
    spin = np.sqrt(2 * MASS * GRAVITY * COM * np.sin(angle) / about["hind"])
    stands = "hind"
    for event in run.events[:5]:
        lands = "fore" if stands == "hind" else "hind"
        assert event.names == (f"{lands} touchdown",)
        assert event.time == pytest.approx(time, abs=1e-10)
        spin *= (inertia - MASS * COM * fore) / about[lands]
        assert abs(event.after.states[3]) == pytest.approx(spin, rel=1e-9)
        assert footing_of(bound, event.after.held).sticking == (lands,)
        stands = lands
        highest = np.arcsin(spin**2 * about[stands] / (2 * MASS * GRAVITY * arms[stands]))
        time += 2 * seconds(stands, highest, 0.0)


def test_a_rod_comes_to_rest_after_rocking(rod: Robot) -> None:
    """Infinitely many times in finite time; in the end it lies and has lost all."""
    rough = rod.with_values({"friction": 0.9})
    bound, run = fallen_from(Drive(rough), np.array([0.3, 0.0, 0.0]), np.zeros(3), 2.0)
    assert run.outcome.completed
    assert set(footing_of(bound, run.end.held).feet) == {"hind", "fore"}
    assert abs(run.end.states[0]) <= 1e-12
    assert np.abs(run.end.states[3:6]).max() <= 1e-12
    lost = run.end.held[bound.system.places[LOSS]]
    assert lost == pytest.approx(MASS * GRAVITY * COM * np.sin(0.3), rel=1e-10)


def test_a_push_in_flight_throws_the_robot() -> None:
    """Its centre of mass goes on along another parabola; all that is lost is what the push adds."""
    robot, push = robot_of(0.8), Push(0.05, (3.0, -1.0), "fore_trunk")
    bound, run = dropped(Drive(robot), 0.09, push=push)
    (event,) = run.events
    assert (event.names, event.time) == (("push",), pytest.approx(0.05, abs=1e-15))
    q, rates = split(bound, run.end.states)
    mass = robot.linkage.mass
    speed = bound.linkage.com_jacobian(q) @ rates
    expected = [1.0 + 3.0 / mass, -9.81 * 0.09 - 1.0 / mass]
    assert speed == pytest.approx(expected, abs=1e-12)
    kinetic = []
    for state in (before(run, event), event.after.states):
        kinetic.append(bound.linkage.kinetic_energy(*split(bound, state)))
    added = kinetic[1] - kinetic[0]
    assert -event.after.held[bound.system.places[LOSS]] == pytest.approx(added, rel=1e-12)
    assert added > 0


def test_a_rod_that_lies_on_more_than_its_feet_has_fallen(rod: Robot) -> None:
    """Its end comes down with its feet."""
    longer = rod.with_values({"fore.at": 0.7})
    for height in (0.1, 0.05, 0.0371):
        _, run = fallen_from(Drive(longer), np.array([0.0, 0.0, height]), np.zeros(3), 1.0)
        assert run.outcome.name == "fell"
        assert run.outcome.message.startswith("rod at the ground")
        assert run.end.time == pytest.approx(np.sqrt(2 * height / GRAVITY), abs=1e-12)


def solutions(robot: Robot, q: Array, rates: Array, feet: list[str]) -> int:
    """How many ways there are for feet to stick or let go at an impact."""
    other, found = Falling(robot), []
    jacobian = other.jacobian(q, feet)
    spread = np.linalg.solve(other.engine.mass_matrix(q), jacobian.T)
    for sticks in product((False, True), repeat=len(feet)):
        rows = [2 * i + k for i, each in enumerate(sticks) if each for k in (0, 1)]
        pushes = np.zeros(2 * len(feet))
        if rows:
            response = (jacobian @ spread)[np.ix_(rows, rows)]
            pushes[rows] = -np.linalg.solve(response, (jacobian @ rates)[rows])
        after = jacobian @ (rates + spread @ pushes)
        fine = all(
            pushes[2 * i + 1] >= 0 if each else after[2 * i + 1] >= 0
            for i, each in enumerate(sticks)
        )
        found += [after] if fine else []
    return len(found)


def on_two_toes(robot: Robot, rng: np.random.Generator) -> tuple[Array, list[str]] | None:
    """A random posture with two toes on the ground and all else above it, if it is one."""
    linkage = robot.linkage
    q = np.concatenate([rng.uniform(-np.pi, np.pi, 10), [0.0, 0.0]])
    places = np.array([linkage.foot(q, toe) for toe in TOES])
    one, other = np.argsort(places[:, 1])[:2]
    apart = places[other] - places[one]
    q[0] -= np.arctan2(apart[1], apart[0])
    q[-1] -= linkage.foot(q, TOES[one])[1]
    ends = [linkage.point(q, link, at)[1] for link in robot.parents
            for at in (0.0, robot.numbers[f"{link}.length"])]  # fmt: skip
    heights = [linkage.foot(q, toe)[1] for toe in TOES]
    if min(ends) < -1e-12 or sum(height < 1e-3 for height in heights) != 2:
        return None
    return q, sorted([TOES[one], TOES[other]])


def test_without_sliding_it_ends_where_contact_has_no_single_solution() -> None:
    """One toe stands and another falls from 1 um, in random postures."""
    robot = robot_of(0.8)
    linkage, rng = robot.linkage, np.random.default_rng(8)
    names = {0: "no_contact_solution", 1: "completed"}
    bound = BoundRobot(Drive(robot), TOLERANCE, slides=False)
    other = Falling(robot)
    seen: dict[str, int] = {}
    while sum(seen.values()) < 30 or len(seen) < 3:
        posture = on_two_toes(robot, rng)
        if posture is None:
            continue
        q, feet = posture
        jacobian = linkage.foot_jacobian(q, feet)
        q += np.linalg.pinv(jacobian[[0, 1, 3]]) @ [0.0, 0.0, 1e-6]
        rates = rng.normal(0, 3, 12)
        jacobian = linkage.foot_jacobian(q, feet)
        held = jacobian[[0, 1, 3]]
        rates -= np.linalg.pinv(held) @ (held @ rates - [0.0, 0.0, -10.0])
        if other.next(q, rates, feet[:1])[1] != {feet[0]: 0}:
            continue  # it would lift off or slide
        wanted = names.get(solutions(robot, q, rates, feet), "ambiguous_contact")
        start = bound.begin(q, rates, {})
        assert not isinstance(start, Outcome)
        run = integrate(bound, start, end_time=1.2e-7, record=True)
        assert run.outcome.name == wanted
        if wanted != "completed":
            assert run.end.time == pytest.approx(1e-7, rel=1e-3)
        seen[wanted] = seen.get(wanted, 0) + 1
        assert sum(seen.values()) < 1000, seen


def test_robots_of_one_build_share_their_equations() -> None:
    """A spine of another stiffness has the same ones, one without a spring has others."""
    soft, stiff, loose = (load_robot("sc618", {"spine.stiffness": k}) for k in (240.0, 500.0, 0.0))
    systems = [BoundRobot(Drive(robot), 1e-12).system for robot in (soft, stiff, loose)]
    assert systems[0] is systems[1]
    assert systems[0] is not systems[2]
    for robot in (stiff, loose):
        bound, run = dropped(Drive(robot), 0.1012)
        other = Falling(robot)
        events = other.run(*above_ground(robot), 0.1012)
        assert [event.names for event in run.events] == [(event.name,) for event in events]
        assert len(events) >= 2
        for ours, wanted in zip(run.events, events, strict=True):
            assert ours.time == pytest.approx(wanted.time, abs=1e-10)
            q, rates = split(bound, ours.after.states)
            np.testing.assert_allclose(q, wanted.q, rtol=0, atol=1e-9)
            np.testing.assert_allclose(rates, wanted.rates, rtol=0, atol=1e-7)
