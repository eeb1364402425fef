"""A second, independent implementation of the two bounding templates, for comparison only.

Nothing here comes from the package under test, and the method differs on purpose. The body is a
base point (the spine joint, or the fore hip of a rigid body) that carries links: the coordinates
are the base point and the absolute angles of the links. Mass matrix and velocity terms are summed
numerically from the Jacobians of the segments' centres of mass, forces and torques enter by virtual
work, and SciPy's DOP853 integrates from event to event. Works are no states: powers are integrated
by quadrature, energies of springs are compared where their numbers jump. SI units, radians,
x forward, y up.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from tests.second_flow import (
    SAME_TIME,
    Field,
    Flow,
    Gauge,
    Guard,
    State,
    first_event,
    highest,
    is_above,
)

WINDOW = 0.02  # s; how far one call of the integrator goes before guards are looked at
LONGEST = 60.0  # s; the limit of a run for which none is given
TIGHTEST = 2.3e-14  # SciPy raises any relative tolerance below 100 units of rounding
# Sixth-order central difference: weights of one, two and three steps to either side.
STENCIL = (3 / 4, -3 / 20, 1 / 60)
SMALL, LARGE = 2e-4, 2e-3  # its step for lengths and angles (m, rad), and for their rates
LEGS = ("fore", "hind")
PARTS_OF_STRIDE = ("flight", "fore", "between", "hind", "both")
PHASES = {(): "DF", ("fore",): "FS", ("hind",): "HS", ("fore", "hind"): "DS"}


@dataclass(frozen=True)
class Half:
    """One segment of the flexible body, with its leg pair."""

    mass: float
    inertia: float
    spine_offset: float
    hip_offset: float
    leg_stiffness: float
    leg_damping: float
    leg_rest_length: float
    leg_stiffening: float = 0.0
    leg_extension: float = 0.0
    hip_lever: float = 0.0


@dataclass(frozen=True)
class Flexible:
    """Two segments joined by a torsional spring-damper.

    By part of the stride (flight, fore, between, hind, both), the spine is stiffer by a share of
    itself, and its rest angle is another.
    """

    fore: Half
    hind: Half
    spine_stiffness: float
    spine_damping: float
    spine_rest_angle: float
    gravity: float
    stiffness_shift: Mapping[str, float] = field(default_factory=dict)
    rest_shift: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Rigid:
    """One body; hips at given distances from its centre of mass.

    Legs are (k, c, l0), followed by stiffening, extension and hip lever if they have them.
    """

    mass: float
    inertia: float
    fore_hip: float
    hind_hip: float
    fore_leg: tuple[float, ...]
    hind_leg: tuple[float, ...]
    gravity: float


@dataclass
class Work:
    """What an actuator has done, in J: all it gave, and that less what it took back."""

    positive: float = 0.0
    net: float = 0.0

    def add(self, positive: float, net: float) -> None:
        """Count more."""
        self.positive += positive
        self.net += net


@dataclass(frozen=True)
class Result:
    """One run: how and when it ended, what happened on the way, and the last state.

    ``apexes`` are those it passed, the start not among them; ``dissipated`` is what dampers and
    springs that let go have lost, in J.
    """

    ended: str
    time: float
    phases: list[str]
    events: list[tuple[float, str]]
    end: dict[str, float]
    peak_grf: dict[str, float]
    peak_vertical_grf: dict[str, float]
    energy_start: float
    energy_end: float
    apexes: list[dict[str, float]]
    works: dict[str, Work]
    dissipated: float


@dataclass(frozen=True)
class Contact:
    """Where legs stand, which of them push, and which have stood since the apex."""

    toes: Mapping[str, float] = field(default_factory=dict)
    pushing: frozenset[str] = frozenset()
    stood: frozenset[str] = frozenset()

    @property
    def part_of_stride(self) -> str:
        """Fore or hind stance, both, the flight between the stances, or that around the apex."""
        if self.toes:
            return "both" if len(self.toes) == len(LEGS) else next(iter(self.toes))
        return "between" if len(self.stood) == 1 else "flight"

    def with_toe(self, name: str, toe: float) -> "Contact":
        """The same with one more leg on the ground."""
        return replace(self, toes={**self.toes, name: toe}, stood=self.stood | {name})

    def without(self, name: str) -> "Contact":
        """The same with a leg in the air that stood."""
        toes = {other: toe for other, toe in self.toes.items() if other != name}
        return replace(self, toes=toes, pushing=self.pushing - {name})


IN_THE_AIR = Contact()


@dataclass(frozen=True)
class Part:
    """A rigid segment: its centre of mass lies at `arm` along link `link` from the base point."""

    mass: float
    inertia: float
    arm: float
    link: int


@dataclass(frozen=True)
class Leg:
    """A leg pair; its hip lies at `arm` along link `link` from the base point.

    From its greatest compression on it is stiffer by a share of itself and longer. The hip turns
    it backward, foot away from the head, with `lever` times its force.
    """

    arm: float
    link: int
    stiffness: float
    damping: float
    rest_length: float
    stiffening: float = 0.0
    extension: float = 0.0
    lever: float = 0.0

    @property
    def has_thrust(self) -> bool:
        """Whether anything happens at the greatest compression."""
        return self.stiffening != 0.0 or self.extension != 0.0

    def spring(self, pushing: bool) -> tuple[float, float]:
        """Stiffness and rest length."""
        if not pushing:
            return self.stiffness, self.rest_length
        return self.stiffness * (1.0 + self.stiffening), self.rest_length + self.extension


class Stance(NamedTuple):
    """A leg on the ground: its force, the unit vector from toe to hip, its length and its rate.

    ``turn`` is how fast it turns about its toe, counter-clockwise; ``torque`` turns it the other
    way, and the link that carries its hip counter-clockwise.
    """

    force: float
    along: tuple[float, float]
    length: float
    rate: float
    turn: float
    torque: float

    @property
    def across(self) -> tuple[float, float]:
        """The unit vector along which its hip moves as it turns counter-clockwise."""
        return -self.along[1], self.along[0]

    @property
    def from_ground(self) -> tuple[float, float]:
        """What the ground does to the toe: along the leg its force, across it what torque needs.

        The leg has no mass: about its hip, the ground's moment balances the torque.
        """
        push = -self.torque / self.length
        (ux, uy), (px, py) = self.along, self.across
        return float(self.force * ux + push * px), float(self.force * uy + push * py)


class Linkage:
    """Equations of motion in (base x, base y, link angles) and their rates."""

    def __init__(self, body: Flexible | Rigid) -> None:
        self.gravity = body.gravity
        self.spine: tuple[float, float, float] | None = None
        if isinstance(body, Flexible):
            f, h = body.fore, body.hind
            self.parts = [
                Part(f.mass, f.inertia, f.spine_offset, 0),
                Part(h.mass, h.inertia, -h.spine_offset, 1),
            ]
            self.legs = {
                name: Leg(
                    sign * (half.spine_offset + half.hip_offset),
                    link,
                    half.leg_stiffness,
                    half.leg_damping,
                    half.leg_rest_length,
                    half.leg_stiffening,
                    half.leg_extension,
                    half.hip_lever,
                )
                for name, half, sign, link in (("fore", f, 1, 0), ("hind", h, -1, 1))
            }
            self.spine = (body.spine_stiffness, body.spine_damping, body.spine_rest_angle)
            self.shifts = {
                part: (body.stiffness_shift.get(part, 0.0), body.rest_shift.get(part, 0.0))
                for part in PARTS_OF_STRIDE
            }
            self.pitch_keys = ["fore_pitch", "hind_pitch"]
        else:
            self.parts = [Part(body.mass, body.inertia, -body.fore_hip, 0)]
            self.legs = {
                "fore": Leg(0.0, 0, *body.fore_leg),
                "hind": Leg(-body.fore_hip - body.hind_hip, 0, *body.hind_leg),
            }
            self.pitch_keys = ["pitch"]
        self.n = 2 + len(self.pitch_keys)
        self.mass = sum(part.mass for part in self.parts)

    def place(self, s: State, arm: float, link: int) -> tuple[float, float]:
        """Position of a point of a link."""
        angle = s[2 + link]
        return s[0] + arm * math.cos(angle), s[1] + arm * math.sin(angle)

    def velocity(self, s: State, arm: float, link: int) -> tuple[float, float]:
        """Velocity of a point of a link."""
        angle, turn = s[2 + link], arm * s[self.n + 2 + link]
        return s[self.n] - turn * math.sin(angle), s[self.n + 1] + turn * math.cos(angle)

    def lever(self, s: State, arm: float, link: int) -> tuple[float, float]:
        """Derivative of `place` by the link's angle; that by the base point is the identity."""
        angle = s[2 + link]
        return -arm * math.sin(angle), arm * math.cos(angle)

    def com(self, s: State) -> tuple[float, float, float, float]:
        """Position and velocity of the whole body's centre of mass."""
        total = np.zeros(4)
        for p in self.parts:
            at = (*self.place(s, p.arm, p.link), *self.velocity(s, p.arm, p.link))
            total += p.mass * np.array(at)
        x, y, vx, vy = (total / self.mass).tolist()
        return x, y, vx, vy

    def leg(self, s: State, name: str, contact: Contact) -> Stance:
        """A leg that stands."""
        leg = self.legs[name]
        stiffness, rest_length = leg.spring(name in contact.pushing)
        x, y = self.place(s, leg.arm, leg.link)
        vx, vy = self.velocity(s, leg.arm, leg.link)
        dx = x - contact.toes[name]
        length = math.hypot(dx, y)
        ux, uy = dx / length, y / length
        rate = ux * vx + uy * vy
        force = stiffness * (rest_length - length) - leg.damping * rate
        turn = (ux * vy - uy * vx) / length
        return Stance(float(force), (ux, uy), length, float(rate), turn, leg.lever * force)

    def hip_power(self, s: State, name: str, contact: Contact) -> float:
        """Torque by how fast the link turns against the leg."""
        stance = self.leg(s, name, contact)
        link_turn = s[self.n + 2 + self.legs[name].link]
        return float(stance.torque * (link_turn - stance.turn))

    def spine_spring(self, contact: Contact) -> tuple[float, float]:
        """Stiffness and rest angle of the spine, zero without one."""
        if self.spine is None:
            return 0.0, 0.0
        stiffness, _, rest = self.spine
        share, bend = self.shifts[contact.part_of_stride]
        return stiffness * (1.0 + share), rest + bend

    def spine_energy(self, s: State, contact: Contact) -> float:
        """Energy of the spine's spring."""
        stiffness, rest = self.spine_spring(contact)
        return 0.5 * stiffness * float(s[2] - s[3] - rest) ** 2 if stiffness else 0.0

    def leg_energy(self, s: State, name: str, contact: Contact) -> float:
        """Energy of a leg's spring."""
        stiffness, rest_length = self.legs[name].spring(name in contact.pushing)
        return 0.5 * stiffness * (rest_length - self.leg(s, name, contact).length) ** 2

    @property
    def damped(self) -> bool:
        """Whether it has dampers."""
        spine = self.spine[1] if self.spine is not None else 0.0
        return any([spine, *(leg.damping for leg in self.legs.values())])

    def power_lost(self, s: State, contact: Contact) -> float:
        """What the dampers take."""
        lost = 0.0
        if self.spine is not None:
            lost += self.spine[1] * float(s[self.n + 2] - s[self.n + 3]) ** 2
        for name in contact.toes:
            lost += self.legs[name].damping * self.leg(s, name, contact).rate ** 2
        return lost

    def field(self, contact: Contact) -> Field:
        """The vector field with these legs on the ground."""
        n = self.n
        stiffness, rest = self.spine_spring(contact)

        def rates(state: State) -> State:
            s = state.tolist()
            inertia = [[0.0] * n for _ in range(n)]
            load = [0.0] * n

            def act(force: tuple[float, float], point: tuple[float, float], link: int) -> None:
                load[0] += force[0]
                load[1] += force[1]
                load[2 + link] += point[0] * force[0] + point[1] * force[1]

            for p in self.parts:
                x, y = point = self.lever(s, p.arm, p.link)
                inertia[0][0] += p.mass
                inertia[1][1] += p.mass
                inertia[0][2 + p.link] = inertia[2 + p.link][0] = p.mass * x
                inertia[1][2 + p.link] = inertia[2 + p.link][1] = p.mass * y
                inertia[2 + p.link][2 + p.link] = p.mass * (x**2 + y**2) + p.inertia
                # The centripetal acceleration of the part about the base point.
                turn = s[n + 2 + p.link] ** 2
                ax, ay = -y * turn, x * turn
                act((-p.mass * ax, -p.mass * (ay + self.gravity)), point, p.link)
            if self.spine is not None:
                moment = -stiffness * (s[2] - s[3] - rest)
                moment -= self.spine[1] * (s[n + 2] - s[n + 3])
                load[2] += moment
                load[3] -= moment
            for name in contact.toes:
                leg, stance = self.legs[name], self.leg(s, name, contact)
                act(stance.from_ground, self.lever(s, leg.arm, leg.link), leg.link)
                # Virtual power: torque by the link's turn, less torque by the leg's.
                load[2 + leg.link] += stance.torque
            _, accelerations, failed = dposv(inertia, load)
            assert not failed
            return np.array([*s[n:], *accelerations])

        return rates

    def energy(self, s: State, contact: Contact = IN_THE_AIR) -> float:
        """Kinetic, gravitational, spine and stance-leg spring energy."""
        total = self.spine_energy(s, contact)
        for p in self.parts:
            vx, vy = self.velocity(s, p.arm, p.link)
            total += 0.5 * p.mass * (vx**2 + vy**2)
            total += 0.5 * p.inertia * s[self.n + 2 + p.link] ** 2
            total += p.mass * self.gravity * self.place(s, p.arm, p.link)[1]
        for name in contact.toes:
            total += self.leg_energy(s, name, contact)
        return float(total)

    def pack(self, apex: dict[str, float]) -> State:
        """State from the apex quantities; the centre of mass is at x = 0."""
        s = np.zeros(2 * self.n)
        for i, key in enumerate(self.pitch_keys):
            s[2 + i], s[self.n + 2 + i] = apex[key], apex[key + "_rate"]
        x, y, vx, vy = self.com(s)
        s[0], s[1] = -x, apex["height"] - y
        s[self.n], s[self.n + 1] = apex["speed"] - vx, apex.get("climb", 0.0) - vy
        return s

    def unpack(self, s: State) -> dict[str, float]:
        """The apex quantities of a state, with distance and climb."""
        x, y, vx, vy = self.com(s)
        out = {"height": y, "speed": vx, "distance": x, "climb": vy}
        for i, key in enumerate(self.pitch_keys):
            out[key], out[key + "_rate"] = float(s[2 + i]), float(s[self.n + 2 + i])
        return out

    def hip_height(self, s: State, name: str) -> float:
        """Height of a hip."""
        return self.place(s, self.legs[name].arm, self.legs[name].link)[1]

    def clearance(self, s: State) -> float:
        """Height of the lowest point that must not touch the ground."""
        return min(float(s[1]), self.com(s)[1], *(self.hip_height(s, name) for name in LEGS))

    def pulls(self, s: State, name: str, contact: Contact) -> bool:
        """Whether this leg, on the ground, would pull now or at once after."""
        stance, leg = self.leg(s, name, contact), self.legs[name]
        if abs(stance.force) <= 1e-12 * leg.stiffness * leg.rest_length:
            return stance.rate > 0.0
        return stance.force < 0.0


class Run:
    """A run in progress: the state, the legs on the ground and the record so far."""

    def __init__(
        self, body: Flexible | Rigid, apex: dict[str, float], touchdown: dict[str, float]
    ) -> None:
        self.linkage = Linkage(body)
        self.touchdown = touchdown
        self.state = self.linkage.pack(apex)
        self.time = 0.0
        self.contact = IN_THE_AIR
        self.phases: list[str] = []
        self.events: list[tuple[float, str]] = []
        self.apexes: list[dict[str, float]] = []
        self.peaks = dict.fromkeys(LEGS, 0.0)
        self.vertical_peaks = dict.fromkeys(LEGS, 0.0)
        works = [f"{name}_{what}_work" for name in LEGS for what in ("leg", "hip")]
        self.works = {name: Work() for name in (*works, "spine_work")}
        self.dissipated = 0.0

    def note(self, what: str) -> None:
        """Record an event."""
        self.events.append((self.time, what))

    def land(self, name: str, toe: float) -> None:
        """Put a leg on the ground; if it would pull it leaves again at once."""
        self.contact = self.contact.with_toe(name, toe)
        if self.linkage.pulls(self.state, name, self.contact):
            self.release(name)

    def push(self, name: str) -> None:
        """Begin a leg's thrust; if the leg would pull then it leaves at once."""
        self.note(f"{name} greatest compression")
        before = self.linkage.leg_energy(self.state, name, self.contact)
        self.contact = replace(self.contact, pushing=self.contact.pushing | {name})
        given = self.linkage.leg_energy(self.state, name, self.contact) - before
        self.works[f"{name}_leg_work"].add(max(given, 0.0), given)
        if self.linkage.pulls(self.state, name, self.contact):
            self.release(name)

    def release(self, name: str) -> None:
        """Lift a leg; what its spring still holds is lost."""
        self.note(f"{name} lift-off")
        self.dissipated += self.linkage.leg_energy(self.state, name, self.contact)
        self.contact = self.contact.without(name)

    def note_phase(self) -> None:
        """Record the phase unless it is still the same."""
        phase = PHASES[tuple(name for name in LEGS if name in self.contact.toes)]
        if not self.phases or self.phases[-1] != phase:
            self.phases.append(phase)

    def apex_may_come(self) -> bool:
        """Whether the section is armed."""
        return not self.contact.toes and len(self.contact.stood) == len(LEGS)

    def guards(self) -> list[Guard]:
        """Everything that can happen in this phase."""
        link, contact = self.linkage, self.contact

        def landing(name: str) -> Gauge:
            height = link.legs[name].rest_length * math.cos(self.touchdown[name])
            return lambda s: link.hip_height(s, name) - height

        def force(name: str) -> Gauge:
            return lambda s: link.leg(s, name, contact).force

        def shortening(name: str) -> Gauge:
            return lambda s: -link.leg(s, name, contact).rate

        def hip(name: str) -> Gauge:
            return lambda s: link.hip_height(s, name)

        out = [
            Guard(f"{name} lift-off", force(name))
            if name in contact.toes
            else Guard(f"{name} touchdown", landing(name))
            for name in LEGS
        ]
        out += [
            Guard(f"{name} greatest compression", shortening(name))
            for name in contact.toes
            if link.legs[name].has_thrust and name not in contact.pushing
        ]
        out += [Guard("fall", hip(name)) for name in LEGS]
        out += [Guard("fall", lambda s: float(s[1])), Guard("fall", lambda s: link.com(s)[1])]
        if self.apex_may_come():
            out.append(Guard("apex", lambda s: link.com(s)[3]))
        return out

    def record(self, flow: Flow, k: int, t: float, s: State) -> None:
        """Update peak forces and works with a flow up to state s at time t after node k."""
        link, contact = self.linkage, self.contact
        if link.damped:
            self.dissipated += flow.integral(lambda s: link.power_lost(s, contact), k, t)[1]
        for name in contact.toes:

            def size(s: State, name: str = name) -> float:
                return math.hypot(*link.leg(s, name, contact).from_ground)

            def vertical(s: State, name: str = name) -> float:
                return link.leg(s, name, contact).from_ground[1]

            def power(s: State, name: str = name) -> float:
                return link.hip_power(s, name, contact)

            self.peaks[name] = max(self.peaks[name], highest(flow, size, k, t, s))
            self.vertical_peaks[name] = max(
                self.vertical_peaks[name], highest(flow, vertical, k, t, s)
            )
            if link.legs[name].lever:
                self.works[f"{name}_hip_work"].add(*flow.integral(power, k, t))

    def phase(self, limit: float, rtol: float, atol: float) -> set[str]:
        """Run to the next event and return what fired; nothing if the limit came first."""
        field = self.linkage.field(self.contact)
        guards = self.guards()
        ds = field(self.state)
        above = [is_above(guard.value, self.state, ds) for guard in guards]
        while self.time < limit:
            span = min(WINDOW, limit - self.time)
            flow = Flow(field, self.state, span, rtol, atol)
            event = first_event(flow, guards, above)
            if event is not None:
                k, t, self.state, fired = event
                self.record(flow, k, t, self.state)
                self.time += float(t)
                return fired
            if not flow.success:
                raise RuntimeError("the integrator gave up")
            self.state = flow.states[-1]
            self.record(flow, len(flow.times) - 2, span, self.state)
            self.time = limit if span < WINDOW else self.time + span
        return set()

    def switch(self, fired: set[str]) -> None:
        """Apply what happens together to the legs, and with them to the spine's spring."""
        before = self.linkage.spine_energy(self.state, self.contact)
        for name in LEGS:
            if f"{name} lift-off" in fired:
                self.release(name)
            elif f"{name} touchdown" in fired:
                self.note(f"{name} touchdown")
                leg = self.linkage.legs[name]
                x = self.linkage.place(self.state, leg.arm, leg.link)[0]
                self.land(name, x + leg.rest_length * math.sin(self.touchdown[name]))
            elif f"{name} greatest compression" in fired:
                self.push(name)
        given = self.linkage.spine_energy(self.state, self.contact) - before
        self.works["spine_work"].add(max(given, 0.0), given)

    def at_apex(self, fired: set[str]) -> bool:
        """Whether the section is reached, be it at the very end of a stance."""
        if "apex" in fired:
            return True
        climb = self.linkage.com(self.state)[3]
        level = abs(climb) <= SAME_TIME * self.linkage.gravity
        return bool(fired) and self.apex_may_come() and level

    def go(self, strides: int, limit: float, rtol: float, atol: float) -> str:
        """Run to the end and say what ended it."""
        if self.linkage.clearance(self.state) <= 0.0:
            return "fell"
        while self.time < limit:
            fired = self.phase(limit, rtol, atol)
            if "fall" in fired:
                return "fell"
            if "apex" not in fired:
                self.switch(fired)
                self.note_phase()
            if self.at_apex(fired):
                self.apexes.append(self.linkage.unpack(self.state))
                self.contact = IN_THE_AIR
                if len(self.apexes) == strides:
                    return "apex"
        return "time"


def stride(
    body: Flexible | Rigid,
    apex: dict[str, float],
    touchdown: dict[str, float],
    *,
    contacts: dict[str, float] | None = None,
    strides: int = 1,
    rtol: float = 1e-13,
    atol: float = 1e-13,
    until: float | None = None,
) -> Result:
    """Run from a start state to the first apex section (or a later one), a fall or `until` seconds.

    `apex` holds the start (optionally with "climb", the vertical speed), `touchdown` the angles of
    the legs, `contacts` the toes of legs that start on the ground.
    """
    run = Run(body, apex, touchdown)
    for name, toe in (contacts or {}).items():
        run.land(name, toe)
    run.note_phase()
    energy_start = run.linkage.energy(run.state, run.contact)
    ended = run.go(strides, LONGEST if until is None else until, rtol, atol)
    return Result(
        ended=ended,
        time=run.time,
        phases=run.phases,
        events=run.events,
        end=run.linkage.unpack(run.state),
        peak_grf=run.peaks,
        peak_vertical_grf=run.vertical_peaks,
        energy_start=energy_start,
        energy_end=run.linkage.energy(run.state, run.contact),
        apexes=run.apexes,
        works=run.works,
        dissipated=run.dissipated,
    )


def section_keys(body: Flexible | Rigid) -> list[str]:
    """The section coordinates: height, pitch angles, speed, pitch rates."""
    pitches = Linkage(body).pitch_keys
    return ["height", *pitches, "speed", *(f"{key}_rate" for key in pitches)]


def stride_jacobian(
    body: Flexible | Rigid,
    apex: dict[str, float],
    touchdown: dict[str, float],
    *,
    by_touchdown: bool = False,
) -> NDArray[np.float64]:
    """Derivative of the stride map from an apex to the next, x dropped, in `section_keys` order.

    Touchdown angles are held fixed, (d, d); with `by_touchdown` it is the derivative with respect
    to them instead, (d, 2), fore first. Sixth-order central differences of `stride` at its tightest
    tolerance. Accuracy on the three published gaits: energy identity 3e-11 or better relative to
    the energy gradient, entries 1e-9 or better, multipliers about 1e-10. The steps reach six tenths
    of a millimetre and of a milliradian (of a touchdown angle too), and 6e-3 in the rates; it is an
    error if the phases differ within that reach, since the map is smooth for one order of events
    only.
    """
    keys = section_keys(body)
    order: list[str] | None = None

    def end(name: str, move: float) -> State:
        nonlocal order
        moved = {name: (touchdown if by_touchdown else apex)[name] + move}
        run = stride(
            body,
            apex if by_touchdown else apex | moved,
            touchdown | moved if by_touchdown else touchdown,
            rtol=TIGHTEST,
            atol=TIGHTEST,
        )
        order = order or run.phases
        if run.ended != "apex" or run.phases != order:
            raise ValueError(f"{name} moved by {move:g}: {run.ended} by {run.phases}, not {order}")
        return np.array([run.end[key] for key in keys])

    def column(name: str) -> State:
        step = LARGE if name == "speed" or name.endswith("_rate") else SMALL
        terms = [
            weight * (end(name, i * step) - end(name, -i * step))
            for i, weight in enumerate(STENCIL, 1)
        ]
        return np.sum(terms, axis=0) / step

    return np.column_stack([column(name) for name in (LEGS if by_touchdown else keys)])
