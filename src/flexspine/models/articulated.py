"""A planar robot on flat ground as a hybrid system.

A foot lands when it comes down to the ground: a plastic impact with friction
(`flexspine.mechanics.impact`). It lifts off when its normal force falls through zero, begins to
slide when the tangential one leaves the friction cone, and stops sliding when its velocity falls
through zero. Whenever forces jump, at impacts and when a controller changes its mind, what every
touching foot does next is found anew (`flexspine.mechanics.stance.supported`). What turns the
motors is a `Drive`.

Which feet stand and which slide is its footing. Footings that last have a mode of their own; all
others, most of them over within milliseconds, share one in which flags tell what each foot does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial

import numpy as np
import sympy as sp

from flexspine.hybrid.compile import Array, BoundSystem, compile_system
from flexspine.hybrid.outcome import Outcome, OutcomeKind
from flexspine.hybrid.system import Guard, HybridSystem, Mode, Section
from flexspine.hybrid.trajectory import HybridState
from flexspine.mechanics.complementarity import Contact, Verdict
from flexspine.mechanics.impact import Impact, impact
from flexspine.mechanics.linkage_motion import LinkageMotion, MaybeStanding, Point, Standing
from flexspine.mechanics.stance import stopped, supported
from flexspine.models.bounder import FELL
from flexspine.models.drive import Drive, Moment, Turning
from flexspine.models.footing import Footing, flags_of
from flexspine.models.robot import Robot

CLOCK, WORK, DISSIPATED = sp.symbols("clock motor_work dissipated_energy", real=True)
LOSS, PUSH_TIME = sp.symbols("impact_loss push_time", real=True)

# The mode of all footings that have none of their own, and what leads to a drive's label.
ANY = "any footing"
BY = " by "

# N; contact forces may be out of their cones by this much, which is more than rounding errors, so
# that a foot at the edge is found to leave it.
SLACK = 1e-7

# m; how much a foot has to sink to land. More than rounding errors, so that a foot that has just
# left the ground is above this.
DEPTH = 1e-15

# m; feet that would bounce less high stay on the ground. Bounces of several feet in turn grow
# smaller by the thousand and would never end.
LEAST_BOUNCE = 1e-14

# m/s; above the rounding errors of a foot that has just begun to slide.
CREEP = 1e-12

# m/s; a foot that slides no faster is at rest, and what it does next is up to the forces.
AT_REST = 1e-9

# m; feet at this height are on the ground when a run begins.
GROUND = 1e-9

# s; feet that land one after the other knock each other off the ground for microseconds.
CHATTER_WINDOW = 1e-5

# s; feet that land closer together than this land at once.
TOGETHER = 1e-12

NO_SOLUTION = OutcomeKind(
    "no_contact_solution",
    "no combination of feet that stick, slide or let go obeys the laws of contact; allow sliding, "
    "or change the friction or the state a little",
)
AMBIGUOUS = OutcomeKind(
    "ambiguous_contact",
    "several combinations of feet that stick, slide or let go obey the laws of contact, so what "
    "follows is not determined; allow sliding, or change the friction or the state a little",
)


def anchor(foot: str) -> tuple[sp.Symbol, sp.Expr]:
    """Where a foot came to rest on the ground."""
    return sp.Symbol(f"anchor_{foot}", real=True), sp.S.Zero


def floor(foot: str) -> sp.Symbol:
    """The height at which a foot in the air lands: just below the ground, and below the foot."""
    return sp.Symbol(f"floor_{foot}", real=True)


def impulse(foot: str) -> tuple[sp.Symbol, sp.Symbol]:
    """The impulse on a foot at the latest impact, in N s."""
    return sp.Symbol(f"impulse_x_{foot}", real=True), sp.Symbol(f"impulse_y_{foot}", real=True)


@dataclass(frozen=True)
class Push:
    """A sudden push on the body: an impulse in N s on a link, at its centre of mass."""

    time: float
    impulse: tuple[float, float]
    link: str


@dataclass(frozen=True)
class Build:
    """What driven robots have in common that share their compiled equations, and one of them.

    ``values`` are that one's numbers, by symbol.
    """

    key: tuple[object, ...]
    drive: Drive = field(compare=False)
    values: Mapping[sp.Symbol, float] = field(compare=False)

    @classmethod
    def like(cls, drive: Drive) -> Build:
        """The build of a driven robot: its parts, and which of its numbers vanish."""
        robot = drive.robot
        values = complete_motion(robot).values
        parts = (robot.parents, robot.joints, robot.feet)
        key = (*(tuple(part.items()) for part in parts), tuple(values), drive.key)
        return cls(key, drive, values | drive.values())


def complete_motion(robot: Robot) -> LinkageMotion:
    """The robot's mechanics in symbols, with every number that they may ever need."""
    motion = LinkageMotion(robot.linkage, robot.friction)
    motion.mass_matrix()
    motion.forces({})
    motion.foot_rows(list(robot.feet))
    motion.parameter("friction", robot.friction)
    for point in low_points(robot):
        motion.point(*point)
    return motion


def low_points(robot: Robot) -> list[tuple[str, str, float]]:
    """Joints and ends of links that must stay above the ground: name, link, distance on it."""
    linkage = robot.linkage
    links = {link.name: link for link in linkage.links}
    first = linkage.links[0]
    places = [(first.name, first.name, 0.0)]
    for joint in linkage.joints:
        child = links[joint.link]
        assert child.parent is not None
        places.append((joint.name, child.parent, child.at))
    places += [(link.name, link.name, link.length) for link in linkage.links]
    seen = [tuple(linkage.foot_arms(foot)) for foot in robot.feet]
    found = []
    for name, link, distance in places:
        arms = tuple(linkage.arms(link, distance))
        if arms not in seen:  # joints meet at hips, and feet may touch
            seen.append(arms)
            found.append((name, link, distance))
    return found


class BoundRobot(BoundSystem):
    """A driven robot's compiled system with its numbers.

    ``slides`` False: feet that touch at an impact stick or let go. ``watch`` is told the time (s)
    whenever something happens.
    """

    def __init__(
        self,
        drive: Drive,
        tolerance: float,
        *,
        push: Push | None = None,
        slides: bool = True,
        watch: Callable[[float], None] | None = None,
    ) -> None:
        build = Build.like(drive)
        system = articulated_system(build)
        own = {**build.values, PUSH_TIME: -1.0 if push is None else push.time}
        numbers = np.array([own[symbol] for symbol in system.parameters])
        super().__init__(compile_system(system, tolerance), numbers)
        self.drive, self.push, self.slides, self.watch = drive, push, slides, watch
        self.robot, self.linkage = drive.robot, drive.robot.linkage

    def moment(self, point: HybridState) -> Moment:
        """What a drive needs to know of a point."""
        n = self.linkage.size
        held = dict(zip(self.system.held, point.held.tolist(), strict=True))
        back = self.linkage.to_relative
        q, rates = back @ point.states[:n], back @ point.states[n : 2 * n]
        footing = Footing.in_flags(held, self.robot.feet)
        return Moment(point.time, q, rates, footing, held)

    def point(self, moment: Moment, states: Array) -> HybridState:
        """The point of a moment; what else flows is that of ``states``."""
        n, to = self.linkage.size, self.linkage.to_absolute
        numbers = {**moment.held, **moment.footing.flags(self.robot.feet)}
        for foot in self.robot.feet:
            # A foot that stood may have been in the ground by an error of integration.
            height = float(self.linkage.foot(moment.q, foot)[1])
            numbers[floor(foot)] = min(height, 0.0) - DEPTH
        held = np.array([numbers[symbol] for symbol in self.system.held])
        new = np.concatenate([states[:n], to @ moment.rates, states[2 * n :]])
        return HybridState(moment.time, self._mode_of(moment), new, held)

    def _mode_of(self, moment: Moment) -> str:
        footing = moment.footing
        usual = footing.feet in self.drive.usual and footing.feet == footing.sticking
        label = self.drive.label(moment)
        return (footing.name if usual else ANY) + (BY + label if label else "")

    def stand(self, q: Array, rates: Array, held: Mapping[sp.Symbol, float]) -> Moment:
        """The beginning of time; feet within rounding error of the ground are on it."""
        linkage = self.linkage
        places = {foot: linkage.foot(q, foot) for foot in self.robot.feet}
        low = [foot for foot, (_, y) in places.items() if abs(y) <= GROUND]
        values = dict.fromkeys(self.system.held, 0.0)
        for foot, place in places.items():
            values[anchor(foot)[0]] = float(place[0])
        footing = Footing.of(dict.fromkeys(low, Contact.STICK), self.robot.feet)
        return Moment(0.0, q, rates, footing, {**values, **held})

    def at_rest(self, q: Array) -> Array:
        """All that flows, at rest with these coordinates."""
        n = self.linkage.size
        return np.concatenate([self.linkage.to_absolute @ q, np.zeros(n + 3)])

    def carry_on(self, moment: Moment, states: Array) -> HybridState | Outcome:
        """Go on after something jumped: find out what each touching foot does next."""
        if self.watch is not None:
            self.watch(moment.time)
        while moment.footing.feet:
            now = self._by_speed(moment)
            feet = now.footing.feet
            torques = self.drive.torques_at(self, self.point(now, states))
            moving = [None if does is Contact.STICK else does for _, does in now.footing.contacts]
            found, accelerations = supported(
                self.linkage, now.q, now.rates, feet, torques, self.robot.friction, moving
            )
            if found.verdict is Verdict.NONE:
                return Outcome(NO_SOLUTION, f"{now.footing.name} at t = {now.time:.9g} s")
            contacts = dict(zip(feet, found.contacts, strict=True))
            after = replace(now, footing=Footing.of(contacts, self.robot.feet))
            lingering = self._lingering(after, accelerations)
            if lingering:
                down = touching(self, after, dict.fromkeys(lingering, Contact.SLIDE_FORWARD))
                moment = self._held_still(down)
                continue
            moment = self.drive.after_settling(after)
            if moment is after:
                break
        return self.point(moment, states)

    def _by_speed(self, moment: Moment) -> Moment:
        """The moment with feet that slide the way they move; those at rest stick for now."""
        contacts: dict[str, Contact] = {}
        rests: dict[str, Contact] = {}
        for foot, does in moment.footing.contacts:
            if does is not Contact.STICK:
                row = self.linkage.foot_jacobian(moment.q, [foot])[0]
                speed = float(row @ moment.rates)
                contacts[foot] = Contact.SLIDE_FORWARD if speed > 0 else Contact.SLIDE_BACK
                if abs(speed) <= AT_REST:
                    rests[foot] = Contact.STICK
        after = touching(self, moment, contacts | rests)
        return self._held_still(after) if rests else after

    def _lingering(self, moment: Moment, accelerations: Array) -> list[str]:
        """Feet in the air that would come back without having left."""
        linkage, found = self.linkage, []
        for foot in self.robot.feet:
            if moment.footing.does(foot) is Contact.OPEN:
                height = linkage.foot(moment.q, foot)[1]
                rise = self.rise(moment, foot)
                bias = linkage.foot_bias(moment.q, moment.rates, [foot])[1]
                gain = linkage.foot_jacobian(moment.q, [foot])[1] @ accelerations + bias
                low = height <= LEAST_BOUNCE and rise >= 0
                if low and gain < 0 and rise**2 <= 2 * -gain * LEAST_BOUNCE:
                    found.append(foot)
        return found

    def _held_still(self, moment: Moment) -> Moment:
        """The moment with feet that stick at rest, and none that leaves the ground."""
        rows = [
            row
            for foot, does in moment.footing.contacts
            for row in self.linkage.foot_jacobian(moment.q, [foot])[
                (0 if does is Contact.STICK else 1) :
            ]
        ]
        rates = stopped(self.linkage, moment.q, moment.rates, np.array(rows))
        return replace(moment, rates=rates, held=self.lost(moment, rates))

    def lost(self, before: Moment, rates: Array) -> dict[sp.Symbol, float]:
        """What is held when rates have changed at once: the energy that is lost counts."""
        energies = [self.linkage.kinetic_energy(before.q, each) for each in (before.rates, rates)]
        return {**before.held, LOSS: before.held[LOSS] + float(energies[0] - energies[1])}

    def rise(self, moment: Moment, foot: str) -> float:
        """How fast a foot rises, in m/s."""
        return float(self.linkage.foot_jacobian(moment.q, [foot])[1] @ moment.rates)


@lru_cache(maxsize=32)
def articulated_system(build: Build) -> HybridSystem:
    """Assemble the hybrid system of all driven robots of one build."""
    drive, robot = build.drive, build.drive.robot
    motion = complete_motion(robot)
    held = [
        symbol
        for foot in robot.feet
        for symbol in (*flags_of(foot), anchor(foot)[0], floor(foot), *impulse(foot))
    ]
    built: dict[str, Mode] = {}

    def mode(name: str) -> Mode:
        if name not in built:
            built[name] = _Footed(drive, motion, name).mode()
        return built[name]

    return HybridSystem(
        name=robot.name,
        states=(*motion.coordinates, *motion.rates, CLOCK, WORK, DISSIPATED),
        held=(*held, LOSS, *drive.held()),
        parameters=(*motion.values, *drive.values(), PUSH_TIME),
        modes=(),
        mode=mode,
        section=Section((), {}, {}, {}, FELL),
        large=True,
        chatter_window=CHATTER_WINDOW,
    )


def stands_in(drive: Drive, mode: str) -> tuple[str, ...] | None:
    """The feet that stick in a mode, None where flags tell what they do."""
    name = mode.partition(BY)[0]
    if name == ANY:
        return None
    return next(feet for feet in drive.usual if Footing.sticking_on(feet).name == name)


@dataclass(frozen=True)
class _Footed:
    """One mode in the making."""

    drive: Drive
    motion: LinkageMotion
    name: str

    @property
    def robot(self) -> Robot:
        return self.drive.robot

    @cached_property
    def usual(self) -> tuple[str, ...] | None:
        return stands_in(self.drive, self.name)

    @cached_property
    def turning(self) -> Turning:
        return self.drive.turning(self.motion, self.name)

    def mode(self) -> Mode:
        motion, turning = self.motion, self.turning
        definitions = {**motion.definitions, **turning.definitions}
        accelerations, forces = turning.accelerations, turning.forces
        if accelerations is None:
            more, accelerations, forces = motion.stance(self._standing(), turning.torques)
            definitions |= more
        n = len(motion.coordinates)
        return Mode(
            name=self.name,
            definitions=definitions,
            field={
                **dict(zip(motion.coordinates, motion.rates, strict=True)),
                **dict(zip(motion.rates, accelerations[:n], strict=True)),
                CLOCK: sp.S.One,
                WORK: self._motor_power(),
                DISSIPATED: self._power_lost(forces),
            },
            guards=(
                *(guard for foot in self.robot.feet for guard in self._contact(foot, forces)),
                *self._falls(),
                Guard("push", PUSH_TIME - CLOCK, decide=_pushed, timed=True),
                *self.drive.guards(),
                *turning.guards,
            ),
            observables={
                **{f"torque_{name}": torque for name, torque in turning.torques.items()},
                **{
                    f"force_{axis}_{foot}": forces[foot][i] if foot in forces else sp.S.Zero
                    for foot in self.robot.feet
                    for i, axis in enumerate("xy")
                },
                **turning.observables,
            },
        )

    def _standing(self) -> list[Standing]:
        if self.usual is not None:
            return [Standing(foot, anchor(foot)) for foot in self.usual]
        return [MaybeStanding(foot, anchor(foot), *flags_of(foot)) for foot in self.robot.feet]

    def _motor_power(self) -> sp.Expr:
        return sum(
            (torque * self.motion.bend_rate(name) for name, torque in self.turning.torques.items()),
            sp.S.Zero,
        )

    def _power_lost(self, forces: Mapping[str, Point]) -> sp.Expr:
        """In dampers, and by feet that slide."""
        lost = self.motion.damper_power()
        if self.usual is None:
            for foot, (tangent, _) in forces.items():
                _, slides = flags_of(foot)
                lost -= slides**2 * tangent * self.motion.foot_velocity(foot)[0]
        return lost

    def _contact(self, foot: str, forces: Mapping[str, Point]) -> list[Guard]:
        """What ends a foot's contact, or brings it about.

        Where flags tell what a foot does, guards of what it does not do stay above zero.
        """
        touches = self._touchdown(foot)
        if self.usual is not None:
            return self._grips(foot, *forces[foot]) if foot in self.usual else [touches]
        stands, slides = flags_of(foot)
        sticks = stands * (1 - slides**2)
        lifts, *slips = self._grips(foot, *forces[foot])
        speed = slides * self.motion.foot_velocity(foot)[0]
        stops = Guard(f"{foot} stops sliding", speed + CREEP, decide=partial(_stopped, foot))
        return [
            _gated(touches, 1 - stands),
            _gated(lifts, stands),
            *(_gated(guard, sticks) for guard in slips),
            _gated(stops, slides**2),
        ]

    def _touchdown(self, foot: str) -> Guard:
        height = self.motion.foot(foot)[1]
        return Guard(f"{foot} touchdown", height - floor(foot), decide=partial(_landed, foot))

    def _grips(self, foot: str, tangent: sp.Expr, normal: sp.Expr) -> list[Guard]:
        """Lift-off, and the beginnings of sliding either way."""
        opens = partial(_changed, foot, Contact.OPEN)
        found = [Guard(f"{foot} lift-off", normal + SLACK, decide=opens, costly=True)]
        grip = self.motion.parameter("friction", self.robot.friction) * normal + SLACK
        # A ground that pushes back lets the foot slide forward.
        for way, slack in (
            (Contact.SLIDE_FORWARD, grip + tangent),
            (Contact.SLIDE_BACK, grip - tangent),
        ):
            slips = partial(_changed, foot, way)
            name = f"{foot} begins to {way.value}"
            found.append(Guard(name, slack, decide=slips, costly=True))
        return found

    def _falls(self) -> list[Guard]:
        return [
            Guard(f"{name} at the ground", self.motion.point(name, link, at)[1], ends=FELL)
            for name, link, at in low_points(self.robot)
        ]


def _gated(guard: Guard, flag: sp.Expr) -> Guard:
    """A guard that can fire where the flag is 1 only."""
    return replace(guard, expression=flag * guard.expression + (1 - flag))


Decided = HybridState | Outcome | None


def _robot(bound: BoundSystem) -> BoundRobot:
    assert isinstance(bound, BoundRobot)
    return bound


def _landed(foot: str, bound: BoundSystem, point: HybridState) -> Decided:
    """A foot comes down: a plastic impact of all feet that touch."""
    robot = _robot(bound)
    moment, linkage = robot.moment(point), robot.linkage
    down = {foot: robot.rise(moment, foot)}
    for other in robot.robot.feet:
        if moment.footing.does(other) is Contact.OPEN and other != foot:
            rise = robot.rise(moment, other)
            above = linkage.foot(moment.q, other)[1] - moment.held[floor(other)]
            if rise < 0 and above <= -rise * TOGETHER:
                down[other] = rise
    touching = [each for each in robot.robot.feet if each in {*down, *moment.footing.feet}]
    return _hit(robot, moment, point.states, touching, moment.rates, tuple(down))


def _pushed(bound: BoundSystem, point: HybridState) -> Decided:
    """Something hits the body, and with it the ground its feet."""
    robot = _robot(bound)
    push = robot.push
    assert push is not None
    moment, linkage = robot.moment(point), robot.linkage
    link = linkage.links[linkage.place[push.link]]
    along = linkage.point_jacobian(moment.q, link.name, link.com)
    kick = np.linalg.solve(linkage.mass_matrix(moment.q), along.T @ np.array(push.impulse))
    feet = list(moment.footing.feet)
    return _hit(robot, moment, point.states, feet, moment.rates + kick, ())


def _hit(
    robot: BoundRobot,
    moment: Moment,
    states: Array,
    feet: list[str],
    rates: Array,
    landed: tuple[str, ...],
) -> Decided:
    """Let feet hit the ground, and go on with what follows."""
    friction = robot.robot.friction if robot.slides else None
    found = impact(robot.linkage, moment.q, rates, feet, friction)
    if found.verdict is not Verdict.ONE:
        kind = NO_SOLUTION if found.verdict is Verdict.NONE else AMBIGUOUS
        text = f"{found.solutions} at the impact of {', '.join(feet)} at t = {moment.time:.9g} s"
        return Outcome(kind, text)
    after = _after(robot, moment, feet, found)
    return robot.carry_on(robot.drive.after_landing(after, landed), states)


def _after(robot: BoundRobot, moment: Moment, feet: list[str], found: Impact) -> Moment:
    """The moment after an impact, before a drive has its say."""
    held = robot.lost(moment, found.rates)
    for name in robot.robot.feet:
        held |= dict.fromkeys(impulse(name), 0.0)
    for name, push in zip(feet, found.impulses, strict=True):
        held |= dict(zip(impulse(name), push.tolist(), strict=True))
    hit = replace(moment, rates=found.rates, footing=Footing(), held=held)
    stood = moment.footing.sticking
    return touching(robot, hit, dict(zip(feet, found.contacts, strict=True)), stood)


def touching(
    robot: BoundRobot,
    moment: Moment,
    contacts: Mapping[str, Contact],
    stood: tuple[str, ...] = (),
) -> Moment:
    """The moment with some feet on the ground, where they are now unless they have stood there."""
    held = dict(moment.held)
    for name in contacts:
        if name not in stood:
            held[anchor(name)[0]] = float(robot.linkage.foot(moment.q, name)[0])
    footing = Footing.of({**dict(moment.footing.contacts), **contacts}, robot.robot.feet)
    return replace(moment, footing=footing, held=held)


def _changed(foot: str, does: Contact, bound: BoundSystem, point: HybridState) -> Decided:
    """A foot lifts off or begins to slide; no force jumps at that."""
    robot = _robot(bound)
    moment = robot.moment(point)
    footing = moment.footing.but(foot, does, robot.robot.feet)
    return robot.point(replace(moment, footing=footing), point.states)


def _stopped(foot: str, bound: BoundSystem, point: HybridState) -> Decided:
    """A foot comes to rest, or turns round."""
    robot = _robot(bound)
    still = touching(robot, robot.moment(point), {foot: Contact.STICK})
    return robot.carry_on(still, point.states)
