"""A gait: a periodic orbit of the apex map, certified by simulating it anew."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from flexspine.gaits.measures import Profile, Summary, summarize
from flexspine.hybrid.compile import Array
from flexspine.hybrid.functions import section_quantities
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.trajectory import Trajectory
from flexspine.models.bounder import FORE, HIND
from flexspine.models.legs import SIDES, STANCE_PHASES
from flexspine.models.model import Model
from flexspine.models.simulation import DEFAULT_TOLERANCE, Run, check_count, simulate

# Natural units; what a gait may miss its start by.
CLOSED = 1e-11

# rad, and relative for forces; gaits are known to 1e-11.
SYMMETRY = 1e-7

# s; contacts closer than this come in either order by rounding.
ONE_INSTANT = 1e-10

# m/s; the CoM rests at an apex, to rounding error.
AT_REST = 1e-9

ENERGIES = ("kinetic", "gravity", "leg", "spine")


@dataclass(frozen=True)
class Gait:
    """A periodic orbit, found at fixed touchdown angles. SI and radians.

    ``model`` holds its apex and touchdown angles, ``strides`` how many strides make a period,
    ``trajectory`` is one period of it, at the integrator's ``tolerance``.
    """

    model: Model
    strides: int
    trajectory: Trajectory
    tolerance: float

    def __repr__(self) -> str:
        told = f"{self.period:.4g} s, {self.mean_speed:.4g} m/s, {'-'.join(self.phases)}"
        return f"<Gait of {self.model.name}: {told}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """What goes to another process: how to run it anew."""
        return _examined_anew, (self.model, self.strides, self.tolerance)

    @cached_property
    def run(self) -> Run:
        """One period simulated anew and recorded, which is what confirms the gait."""
        return simulate(self.model, strides=self.strides, tolerance=self.tolerance)

    @cached_property
    def residual(self) -> float:
        """By how much the orbit misses its start, in natural units; infinite if it fell."""
        if not self.trajectory.outcome.completed:
            return float("inf")
        start, end = self.trajectory.start.states, self.trajectory.end.states
        system, scales = self.model.system, self.model.scales
        places = {n: system.places[s] for n, s in system.section.coordinates.items()}
        return max(abs(float(end[i] - start[i])) / scales[n] for n, i in places.items())

    @cached_property
    def flaw(self) -> str | None:
        """Why this is no periodic orbit, or None if it is one."""
        if not self.trajectory.outcome.completed:
            return str(self.trajectory.outcome)
        # Looser integration leaves more.
        if not self.residual <= max(CLOSED, 10 * self.tolerance):
            return f"misses its start by {self.residual:.1e} (natural units)"
        for side in SIDES:
            if not any(phase in STANCE_PHASES[side] for phase in self.phases):
                return f"its {side} leg never bears load"
        return None

    @property
    def confirmed(self) -> bool:
        """Whether simulating it anew bears it out."""
        return self.doubt is None

    @cached_property
    def doubt(self) -> str | None:
        """Why simulating it anew does not bear it out, or None."""
        if self.flaw is not None:
            return self.flaw
        if not self.run.outcome.completed:
            return str(self.run.outcome)
        if self.run.phases != self.phases:
            return f"went {'-'.join(self.run.phases)} the second time"
        return None

    @property
    def phases(self) -> tuple[str, ...]:
        """The phases in order, from apex to apex."""
        return self.trajectory.modes

    @cached_property
    def contacts(self) -> tuple[tuple[str, ...], ...]:
        """Touchdowns and lift-offs in order, such as ``fore touchdown``; those at once together."""
        groups: list[list[str]] = []
        latest = -1.0
        for name, time in contact_times(self.trajectory):
            if time - latest < ONE_INSTANT:
                groups[-1].append(name)
            else:
                groups.append([name])
            latest = time
        return tuple(tuple(sorted(group)) for group in groups)

    @property
    def touchdown_angles(self) -> dict[str, float]:
        """Touchdown angle of each leg, in rad from the vertical, foot ahead of the hip positive."""
        return dict(self.model.touchdown)

    @cached_property
    def liftoff_angles(self) -> dict[str, float]:
        """Angle of each leg at its latest lift-off, in rad from the vertical, as at touchdown."""
        held, places = self.trajectory.end.held, self.model.system.places
        return {leg.side: float(held[places[leg.left]]) for leg in (FORE, HIND)}

    @cached_property
    def summary(self) -> Summary:
        """The measures of the period."""
        return summarize(self.run, self.profile)

    @cached_property
    def profile(self) -> Profile:
        """Ranges and means over the period."""
        return Profile(self.run)

    @property
    def period(self) -> float:
        """How long a period takes, in s."""
        return self.trajectory.duration

    @property
    def stride_length(self) -> float:
        """Mean distance per stride, in m."""
        return self.mean_speed * self.period / self.strides

    @property
    def mean_speed(self) -> float:
        """Distance over time of a period, in m/s."""
        start, end = self.trajectory.start.states, self.trajectory.end.states
        return float(end[0] - start[0]) / self.period

    @cached_property
    def energy(self) -> float:
        """Total energy at the start, in J."""
        start = self.trajectory.start
        quantities = section_quantities(self.model.system)
        answer = quantities(start.states, start.held, self.model.parameter_vector)
        return float(answer.values[list(self.model.system.section.quantities).index("energy")])

    @property
    def quantities(self) -> dict[str, float]:
        """Energy (J), apex height (m) and mean speed (m/s): what tells gaits of an animal apart."""
        height = self.model.apex["height"]
        return {"energy": self.energy, "height": height, "mean_speed": self.mean_speed}

    @property
    def peak_grf(self) -> dict[str, float]:
        """Largest magnitude of each leg's ground reaction force, in N per pair of legs."""
        return self.summary.peak_grf

    @property
    def com_amplitude(self) -> float:
        """Highest minus lowest CoM height, in m."""
        low, high = self.profile.range("com_y")
        return high - low

    @cached_property
    def apex_energy_shares(self) -> dict[str, float]:
        """Shares of the total energy at the first apex: kinetic, gravity, leg and spine."""
        return {kind: self.profile.first(f"{kind}_energy") / self.energy for kind in ENERGIES}

    @cached_property
    def mean_energy_shares(self) -> dict[str, float]:
        """Shares of the total energy, averaged over the period."""
        means = {kind: self.profile.mean(f"{kind}_energy") for kind in ENERGIES}
        whole = sum(means.values())
        return {kind: value / whole for kind, value in means.items()}

    @cached_property
    def symmetric(self) -> bool:
        """Whether each leg leaves at minus the other's touchdown angle and the peaks are equal."""
        landed, left = self.touchdown_angles, self.liftoff_angles
        fore, hind = self.peak_grf.values()
        return (
            self.strides == 1
            and abs(landed["fore"] + left["hind"]) < SYMMETRY
            and abs(landed["hind"] + left["fore"]) < SYMMETRY
            and abs(fore - hind) < SYMMETRY * max(fore, hind)
        )

    @cached_property
    def family(self) -> str:
        """What kind of gait it is: which leg leads, its phases, how the spine bends at the apex."""
        first = next((phase for phase in self.phases if phase != "DF"), "DF")
        lead = {"FS": "fore-first", "HS": "hind-first", "DS": "pronking"}.get(first, "airborne")
        name = f"{lead} {'-'.join(self.phases)}"
        if "fore_pitch" in self.model.apex:
            bend = self.model.apex["fore_pitch"] - self.model.apex["hind_pitch"]
            shape = "straight" if abs(bend) < SYMMETRY else "sagging" if bend > 0 else "arched"
            name += f", spine {shape} at the apex"
        return name

    @cached_property
    def orbit(self) -> Array:
        """All its apexes in natural units, shape (apexes, coordinates)."""
        return np.array([[apex[n] / self.model.scales[n] for n in apex] for apex in self._tops()])

    def _tops(self) -> list[dict[str, float]]:
        """Every point at which the CoM is highest in flight, section or not.

        The apex is a guard, so an arc of flight begins at each of them.
        """
        run = self.run
        climb = run.model.state_names.index("com_y_rate")
        starts = [arc(arc.times[:1])[0] for arc in run.trajectory.arcs if arc.mode == "DF"]
        return [
            run.section_state(run.trajectory.end._replace(states=states))
            for states in starts
            if abs(states[climb]) < AT_REST
        ]


def contact_times(trajectory: Trajectory) -> list[tuple[str, float]]:
    """Touchdowns and lift-offs of a run with their times in s."""
    return [
        (name, event.time)
        for event in trajectory.events
        for name in event.names
        if name.endswith(("touchdown", "lift-off"))
    ]


def _examined_anew(model: Model, strides: int, tolerance: float) -> Gait:
    return examine(model, strides=strides, tolerance=tolerance)


def examine(model: Model, *, strides: int = 1, tolerance: float = DEFAULT_TOLERANCE) -> Gait:
    """Run one period from the model's apex, and take it for a gait; its ``flaw`` tells if not.

    ``strides`` make the period, ``tolerance`` is the integrator's, between 1e-17 and 1e-3. Raises
    `ParameterError` for what is not usable, and for ground that is not flat.

    >>> from flexspine import examine, load_model
    >>> gait = examine(load_model("kamimura2015-flexible"))
    >>> gait
    <Gait of kamimura2015-flexible: 0.2527 s, 4.5 m/s, DF-FS-DF-HS-DF>
    >>> gait.residual < 1e-9
    True
    >>> examine(load_model("kamimura2015-flexible", apex={"height": 0.33})).flaw
    'misses its start by 1.5e-01 (natural units)'
    """
    model.on_flat_ground("a gait")
    check_count("strides", strides)
    trajectory = integrate(model.bind(tolerance), model.apex_state(), crossings=strides)
    return Gait(model, strides, trajectory, tolerance)
