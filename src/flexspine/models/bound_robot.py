"""A driven robot with its numbers, and what contacts come to in them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import Array, compile_system
from flexspine.hybrid.outcome import Outcome, OutcomeKind
from flexspine.hybrid.trajectory import HybridState
from flexspine.mechanics.complementarity import Contact, Verdict
from flexspine.mechanics.impact import Impact, impact
from flexspine.mechanics.stance import stopped, supported
from flexspine.models.articulated import (
    ANY,
    BY,
    LOSS,
    PUSH_TIME,
    Build,
    Decided,
    Happenings,
    anchor,
    articulated_system,
    floor,
    impulse,
)
from flexspine.models.drive import Drive, Moment
from flexspine.models.footing import Footing

# m; how much a foot has to sink to land. More than rounding errors, so that a foot that has just
# left the ground is above this.
DEPTH = 1e-15

# m; feet that would bounce less high stay on the ground. Bounces of several feet in turn grow
# smaller by the thousand and would never end.
LEAST_BOUNCE = 1e-14

# m/s; a foot that slides no faster is at rest, and what it does next is up to the forces.
AT_REST = 1e-9

# m; feet at this height are on the ground when a run begins.
GROUND = 1e-9

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


@dataclass(frozen=True)
class Push:
    """A sudden push on the body: an impulse in N s on a link, at its centre of mass."""

    time: float
    impulse: tuple[float, float]
    link: str


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
        system = articulated_system(build, HAPPENINGS)
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
        heights = self.linkage.feet_at(moment.q)[:, 1].tolist()
        for foot, height in zip(self.robot.feet, heights, strict=True):
            # A foot that stood may have been in the ground by an error of integration.
            numbers[floor(foot)] = min(height, 0.0) - DEPTH
        held = np.array([numbers[symbol] for symbol in self.system.held])
        new = np.concatenate([states[:n], to @ moment.rates, states[2 * n :]])
        return HybridState(moment.time, self._mode_of(moment), new, held)

    def _mode_of(self, moment: Moment) -> str:
        footing = moment.footing
        usual = footing.feet in self.drive.usual and footing.feet == footing.sticking
        label = self.drive.label(moment)
        return (footing.name if usual else ANY) + (BY + label if label else "")

    def begin(
        self, q: Array, rates: Array, held: Mapping[sp.Symbol, float]
    ) -> HybridState | Outcome:
        """The beginning of a run; feet within rounding error of the ground are on it."""
        start = self.drive.ready(self._stand(q, rates, held))
        angles, still = self.linkage.to_absolute @ q, np.zeros(len(q) + 3)
        return self.carry_on(start, np.concatenate([angles, still]))

    def _stand(self, q: Array, rates: Array, held: Mapping[sp.Symbol, float]) -> Moment:
        linkage = self.linkage
        places = dict(zip(self.robot.feet, linkage.feet_at(q), strict=True))
        low = [foot for foot, (_, y) in places.items() if abs(y) <= GROUND]
        values = dict.fromkeys(self.system.held, 0.0)
        for foot, place in places.items():
            values[anchor(foot)[0]] = float(place[0])
        footing = Footing.of(dict.fromkeys(low, Contact.STICK), self.robot.feet)
        return Moment(0.0, q, rates, footing, {**values, **held})

    def carry_on(self, moment: Moment, states: Array) -> HybridState | Outcome:
        """Go on after something jumped: find out what each touching foot does next."""
        if self.watch is not None:
            self.watch(moment.time)
        while moment.footing.feet:
            now = self._by_speed(moment)
            feet = now.footing.feet
            torques = self.drive.torques_at(self, now, states)
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
        heights = linkage.feet_at(moment.q)[:, 1].tolist()
        for foot, height in zip(self.robot.feet, heights, strict=True):
            if height <= LEAST_BOUNCE and moment.footing.does(foot) is Contact.OPEN:
                rise = self.rise(moment, foot)
                bias = linkage.foot_bias(moment.q, moment.rates, [foot])[1]
                gain = linkage.foot_jacobian(moment.q, [foot])[1] @ accelerations + bias
                if rise >= 0 and gain < 0 and rise**2 <= 2 * -gain * LEAST_BOUNCE:
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
    feet = [each for each in robot.robot.feet if each in {*down, *moment.footing.feet}]
    return _hit(robot, moment, point.states, feet, moment.rates, tuple(down))


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


HAPPENINGS = Happenings(landed=_landed, stopped=_stopped, changed=_changed, pushed=_pushed)
