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

import sympy as sp

from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.outcome import Outcome, OutcomeKind
from flexspine.hybrid.system import Guard, HybridSystem, Mode, Section
from flexspine.hybrid.trajectory import HybridState
from flexspine.mechanics.complementarity import Contact
from flexspine.mechanics.linkage_motion import LinkageMotion, MaybeStanding, Point, Standing
from flexspine.models.drive import Drive, Turning
from flexspine.models.footing import Footing, flags_of
from flexspine.models.robot import Robot

CLOCK, WORK, DISSIPATED = sp.symbols("clock motor_work dissipated_energy", real=True)
LOSS, PUSH_TIME = sp.symbols("impact_loss push_time", real=True)

FELL = OutcomeKind(
    "fell",
    "without control a robot always falls; with it, walk more slowly, lower the hips, or allow "
    "larger torques",
)

# The mode of all footings that have none of their own, and what leads to a drive's label.
ANY = "any footing"
BY = " by "

# N; contact forces may be out of their cones by this much, which is more than rounding errors, so
# that a foot at the edge is found to leave it.
SLACK = 1e-7

# m/s; above the rounding errors of a foot that has just begun to slide.
CREEP = 1e-12

# s; feet that land one after the other knock each other off the ground for microseconds.
CHATTER_WINDOW = 1e-5


@lru_cache(maxsize=256)
def anchor(foot: str) -> tuple[sp.Symbol, sp.Expr]:
    """Where a foot came to rest on the ground."""
    return sp.Symbol(f"anchor_{foot}", real=True), sp.S.Zero


@lru_cache(maxsize=256)
def floor(foot: str) -> sp.Symbol:
    """The height at which a foot in the air lands: just below the ground, and below the foot."""
    return sp.Symbol(f"floor_{foot}", real=True)


@lru_cache(maxsize=256)
def impulse(foot: str) -> tuple[sp.Symbol, sp.Symbol]:
    """The impulse on a foot at the latest impact, in N s."""
    return sp.Symbol(f"impulse_x_{foot}", real=True), sp.Symbol(f"impulse_y_{foot}", real=True)


@dataclass(frozen=True)
class Build:
    """What driven robots have in common that share their compiled equations, and one of them.

    ``motion`` are its mechanics and ``values`` its numbers, by symbol.
    """

    key: tuple[object, ...]
    drive: Drive = field(compare=False)
    motion: LinkageMotion = field(compare=False)
    values: Mapping[sp.Symbol, float] = field(compare=False)

    @classmethod
    def like(cls, drive: Drive) -> Build:
        """The build of a driven robot: its parts, and which of its numbers vanish."""
        robot = drive.robot
        motion = complete_motion(robot)
        parts = (robot.parents, robot.joints, robot.feet)
        key = (*(tuple(part.items()) for part in parts), tuple(motion.values), drive.key)
        return cls(key, drive, motion, motion.values | drive.values())


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


Decided = HybridState | Outcome | None


@dataclass(frozen=True)
class Happenings:
    """What is decided in numbers at contacts; the first two are told the foot."""

    landed: Callable[[str, BoundSystem, HybridState], Decided]
    stopped: Callable[[str, BoundSystem, HybridState], Decided]
    changed: Callable[[str, Contact, BoundSystem, HybridState], Decided]
    pushed: Callable[[BoundSystem, HybridState], Decided]


@lru_cache(maxsize=32)
def articulated_system(build: Build, happenings: Happenings) -> HybridSystem:
    """Assemble the hybrid system of all driven robots of one build."""
    drive, motion, robot = build.drive, build.motion, build.drive.robot
    held = [
        symbol
        for foot in robot.feet
        for symbol in (*flags_of(foot), anchor(foot)[0], floor(foot), *impulse(foot))
    ]
    built: dict[str, Mode] = {}

    def mode(name: str) -> Mode:
        if name not in built:
            built[name] = _Footed(drive, motion, happenings, name).mode()
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
    happenings: Happenings
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
                Guard("push", PUSH_TIME - CLOCK, decide=self.happenings.pushed, timed=True),
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
        stops = Guard(
            f"{foot} stops sliding", speed + CREEP, decide=partial(self.happenings.stopped, foot)
        )
        return [
            _gated(touches, 1 - stands),
            _gated(lifts, stands),
            *(_gated(guard, sticks) for guard in slips),
            _gated(stops, slides**2),
        ]

    def _touchdown(self, foot: str) -> Guard:
        height = self.motion.foot(foot)[1]
        return Guard(
            f"{foot} touchdown", height - floor(foot), decide=partial(self.happenings.landed, foot)
        )

    def _grips(self, foot: str, tangent: sp.Expr, normal: sp.Expr) -> list[Guard]:
        """Lift-off, and the beginnings of sliding either way."""
        opens = partial(self.happenings.changed, foot, Contact.OPEN)
        found = [Guard(f"{foot} lift-off", normal + SLACK, decide=opens, costly=True)]
        grip = self.motion.parameter("friction", self.robot.friction) * normal + SLACK
        # A ground that pushes back lets the foot slide forward.
        for way, slack in (
            (Contact.SLIDE_FORWARD, grip + tangent),
            (Contact.SLIDE_BACK, grip - tangent),
        ):
            slips = partial(self.happenings.changed, foot, way)
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
