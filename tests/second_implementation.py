"""A second, independent implementation of the two bounding templates, for comparison only.

Nothing here comes from the package under test, and the method differs on purpose. The body is a
base point (the spine joint, or the fore hip of a rigid body) that carries links: the coordinates
are the base point and the absolute angles of the links. Mass matrix and velocity terms are summed
numerically from the Jacobians of the segments' centres of mass, leg forces enter by virtual work
at the hips, and SciPy's DOP853 integrates from event to event. SI units, radians, x forward, y up.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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


@dataclass(frozen=True)
class Flexible:
    """Two segments joined by a torsional spring-damper."""

    fore: Half
    hind: Half
    spine_stiffness: float
    spine_damping: float
    spine_rest_angle: float
    gravity: float


@dataclass(frozen=True)
class Rigid:
    """One body; hips at given distances from its centre of mass; legs are (k, c, l0)."""

    mass: float
    inertia: float
    fore_hip: float
    hind_hip: float
    fore_leg: tuple[float, float, float]
    hind_leg: tuple[float, float, float]
    gravity: float


@dataclass(frozen=True)
class Result:
    """One run: how and when it ended, what happened on the way, and the last state."""

    ended: str
    time: float
    phases: list[str]
    events: list[tuple[float, str]]
    end: dict[str, float]
    peak_grf: dict[str, float]
    peak_vertical_grf: dict[str, float]
    energy_start: float
    energy_end: float


@dataclass(frozen=True)
class Part:
    """A rigid segment: its centre of mass lies at `arm` along link `link` from the base point."""

    mass: float
    inertia: float
    arm: float
    link: int


@dataclass(frozen=True)
class Leg:
    """A leg pair; its hip lies at `arm` along link `link` from the base point."""

    arm: float
    link: int
    stiffness: float
    damping: float
    rest_length: float


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
                )
                for name, half, sign, link in (("fore", f, 1, 0), ("hind", h, -1, 1))
            }
            self.spine = (body.spine_stiffness, body.spine_damping, body.spine_rest_angle)
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

    def jacobian(self, s: State, arm: float, link: int) -> NDArray[np.float64]:
        """Derivative of `place` with respect to the coordinates."""
        jac = np.zeros((2, self.n))
        jac[0, 0] = jac[1, 1] = 1.0
        jac[0, 2 + link] = -arm * math.sin(s[2 + link])
        jac[1, 2 + link] = arm * math.cos(s[2 + link])
        return jac

    def com(self, s: State) -> tuple[float, float, float, float]:
        """Position and velocity of the whole body's centre of mass."""
        total = np.zeros(4)
        for p in self.parts:
            at = (*self.place(s, p.arm, p.link), *self.velocity(s, p.arm, p.link))
            total += p.mass * np.array(at)
        x, y, vx, vy = (total / self.mass).tolist()
        return x, y, vx, vy

    def leg(self, s: State, name: str, toe: float) -> tuple[float, float, float, float, float]:
        """Force, unit vector from toe to hip (two numbers), length and its rate."""
        leg = self.legs[name]
        x, y = self.place(s, leg.arm, leg.link)
        vx, vy = self.velocity(s, leg.arm, leg.link)
        length = math.hypot(x - toe, y)
        ux, uy = (x - toe) / length, y / length
        rate = ux * vx + uy * vy
        force = leg.stiffness * (leg.rest_length - length) - leg.damping * rate
        return float(force), float(ux), float(uy), length, float(rate)

    def field(self, toes: dict[str, float]) -> Field:
        """The vector field with these toes on the ground."""
        n = self.n

        def rates(s: State) -> State:
            inertia = np.zeros((n, n))
            load = np.zeros(n)
            for p in self.parts:
                jac = self.jacobian(s, p.arm, p.link)
                angle, turn = s[2 + p.link], s[n + 2 + p.link]
                # Jdot qdot: the centripetal acceleration of the part about the base point.
                drift = -p.arm * turn**2 * np.array([math.cos(angle), math.sin(angle)])
                inertia += p.mass * (jac.T @ jac)
                inertia[2 + p.link, 2 + p.link] += p.inertia
                load -= p.mass * (jac.T @ (drift + np.array([0.0, self.gravity])))
            if self.spine is not None:
                k, c, rest = self.spine
                moment = -k * (s[2] - s[3] - rest) - c * (s[n + 2] - s[n + 3])
                load[2] += moment
                load[3] -= moment
            for name, toe in toes.items():
                force, ux, uy, _, _ = self.leg(s, name, toe)
                jac = self.jacobian(s, self.legs[name].arm, self.legs[name].link)
                load += force * (jac.T @ np.array([ux, uy]))
            return np.concatenate([s[n:], np.linalg.solve(inertia, load)])

        return rates

    def energy(self, s: State, toes: dict[str, float]) -> float:
        """Kinetic, gravitational, spine and stance-leg spring energy."""
        total = 0.0
        for p in self.parts:
            vx, vy = self.velocity(s, p.arm, p.link)
            total += 0.5 * p.mass * (vx**2 + vy**2)
            total += 0.5 * p.inertia * s[self.n + 2 + p.link] ** 2
            total += p.mass * self.gravity * self.place(s, p.arm, p.link)[1]
        if self.spine is not None:
            total += 0.5 * self.spine[0] * (s[2] - s[3] - self.spine[2]) ** 2
        for name, toe in toes.items():
            leg = self.legs[name]
            total += 0.5 * leg.stiffness * (leg.rest_length - self.leg(s, name, toe)[3]) ** 2
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

    def pulls(self, s: State, name: str, toe: float) -> bool:
        """Whether this leg, on the ground, would pull now or at once after."""
        force, _, _, _, rate = self.leg(s, name, toe)
        leg = self.legs[name]
        if abs(force) <= 1e-12 * leg.stiffness * leg.rest_length:
            return rate > 0.0
        return force < 0.0


class Run:
    """A run in progress: the state, the legs on the ground and the record so far."""

    def __init__(
        self, body: Flexible | Rigid, apex: dict[str, float], touchdown: dict[str, float]
    ) -> None:
        self.linkage = Linkage(body)
        self.touchdown = touchdown
        self.state = self.linkage.pack(apex)
        self.time = 0.0
        self.toes: dict[str, float] = {}
        self.had_stance: set[str] = set()
        self.phases: list[str] = []
        self.events: list[tuple[float, str]] = []
        self.peaks = dict.fromkeys(LEGS, 0.0)
        self.vertical_peaks = dict.fromkeys(LEGS, 0.0)

    def land(self, name: str, toe: float) -> None:
        """Put a leg on the ground; if it would pull it leaves again at once."""
        self.had_stance.add(name)
        if self.linkage.pulls(self.state, name, toe):
            self.events.append((self.time, f"{name} lift-off"))
        else:
            self.toes[name] = toe

    def note_phase(self) -> None:
        """Record the phase unless it is still the same."""
        phase = PHASES[tuple(name for name in LEGS if name in self.toes)]
        if not self.phases or self.phases[-1] != phase:
            self.phases.append(phase)

    def apex_may_come(self) -> bool:
        """Whether the section is armed."""
        return not self.toes and len(self.had_stance) == len(LEGS)

    def guards(self) -> list[Guard]:
        """Everything that can happen in this phase."""
        link = self.linkage
        toes = dict(self.toes)

        def landing(name: str) -> Gauge:
            height = link.legs[name].rest_length * math.cos(self.touchdown[name])
            return lambda s: link.hip_height(s, name) - height

        def force(name: str) -> Gauge:
            return lambda s: link.leg(s, name, toes[name])[0]

        def hip(name: str) -> Gauge:
            return lambda s: link.hip_height(s, name)

        out = [
            Guard(f"{name} lift-off", force(name))
            if name in toes
            else Guard(f"{name} touchdown", landing(name))
            for name in LEGS
        ]
        out += [Guard("fall", hip(name)) for name in LEGS]
        out += [Guard("fall", lambda s: float(s[1])), Guard("fall", lambda s: link.com(s)[1])]
        if self.apex_may_come():
            out.append(Guard("apex", lambda s: link.com(s)[3]))
        return out

    def record_peaks(self, flow: Flow, k: int, t: float, s: State) -> None:
        """Update the peak forces with a flow up to state s at time t after node k."""
        link = self.linkage
        for name, toe in self.toes.items():

            def force(s: State, name: str = name, toe: float = toe) -> float:
                return link.leg(s, name, toe)[0]

            def vertical(s: State, name: str = name, toe: float = toe) -> float:
                f, _, uy, _, _ = link.leg(s, name, toe)
                return f * uy

            self.peaks[name] = max(self.peaks[name], highest(flow, force, k, t, s))
            self.vertical_peaks[name] = max(
                self.vertical_peaks[name], highest(flow, vertical, k, t, s)
            )

    def phase(self, limit: float, rtol: float, atol: float) -> set[str]:
        """Run to the next event and return what fired; nothing if the limit came first."""
        field = self.linkage.field(dict(self.toes))
        guards = self.guards()
        ds = field(self.state)
        above = [is_above(guard.value, self.state, ds) for guard in guards]
        while self.time < limit:
            span = min(WINDOW, limit - self.time)
            flow = Flow(field, self.state, span, rtol, atol)
            event = first_event(flow, guards, above)
            if event is not None:
                k, t, self.state, fired = event
                self.record_peaks(flow, k, t, self.state)
                self.time += float(t)
                return fired
            if not flow.success:
                raise RuntimeError("the integrator gave up")
            self.state = flow.states[-1]
            self.record_peaks(flow, len(flow.times) - 2, span, self.state)
            self.time = limit if span < WINDOW else self.time + span
        return set()

    def switch(self, fired: set[str]) -> None:
        """Apply lift-offs and touchdowns that happen together."""
        for name in LEGS:
            if f"{name} lift-off" in fired:
                self.events.append((self.time, f"{name} lift-off"))
                del self.toes[name]
            elif f"{name} touchdown" in fired:
                self.events.append((self.time, f"{name} touchdown"))
                leg = self.linkage.legs[name]
                x = self.linkage.place(self.state, leg.arm, leg.link)[0]
                self.land(name, x + leg.rest_length * math.sin(self.touchdown[name]))

    def go(self, limit: float, rtol: float, atol: float) -> str:
        """Run to the end and say what ended it."""
        if self.linkage.clearance(self.state) <= 0.0:
            return "fell"
        while self.time < limit:
            fired = self.phase(limit, rtol, atol)
            if "fall" in fired:
                return "fell"
            if "apex" in fired:
                return "apex"
            self.switch(fired)
            self.note_phase()
            climb = self.linkage.com(self.state)[3]
            if fired and self.apex_may_come() and abs(climb) <= SAME_TIME * self.linkage.gravity:
                return "apex"
        return "time"


def stride(
    body: Flexible | Rigid,
    apex: dict[str, float],
    touchdown: dict[str, float],
    *,
    contacts: dict[str, float] | None = None,
    rtol: float = 1e-13,
    atol: float = 1e-13,
    until: float | None = None,
) -> Result:
    """Run from a start state to the first apex section, a fall or `until` seconds.

    `apex` holds the start (optionally with "climb", the vertical speed), `touchdown` the angles of
    the legs, `contacts` the toes of legs that start on the ground.
    """
    run = Run(body, apex, touchdown)
    for name, toe in (contacts or {}).items():
        run.land(name, toe)
    run.note_phase()
    energy_start = run.linkage.energy(run.state, run.toes)
    ended = run.go(LONGEST if until is None else until, rtol, atol)
    return Result(
        ended=ended,
        time=run.time,
        phases=run.phases,
        events=run.events,
        end=run.linkage.unpack(run.state),
        peak_grf=run.peaks,
        peak_vertical_grf=run.vertical_peaks,
        energy_start=energy_start,
        energy_end=run.linkage.energy(run.state, run.toes),
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
