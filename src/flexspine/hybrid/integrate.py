"""One run of a hybrid system, events located by the integrator to rounding error."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

import heyoka as hy
import numpy as np

from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.events import LEAVING, Firing, Progress
from flexspine.hybrid.grazing import touches_without_crossing
from flexspine.hybrid.outcome import COMPLETED, DIVERGED, GRAZED, TIMED_OUT, Outcome
from flexspine.hybrid.system import Section
from flexspine.hybrid.trajectory import Arc, HybridState, Trajectory

# s; the slowest strides take one or two.
SECTION_TIMEOUT = 10.0

# A stride takes some 30 steps; spending this many between two crossings is getting nowhere.
MAX_STEPS = 50_000


def integrate(
    bound: BoundSystem,
    start: HybridState,
    *,
    end_time: float = inf,
    crossings: int | None = None,
    section: Section | None = None,
    section_timeout: float = SECTION_TIMEOUT,
    max_steps: int = MAX_STEPS,
    record: bool = False,
    before: Sequence[Firing] = (),
) -> Trajectory:
    """Run until ``end_time`` (s) or until the section was crossed ``crossings`` times.

    ``section`` is the system's own if none is given. With ``crossings``, a run that stays away
    from it for ``section_timeout`` seconds ends as its ``missed`` outcome. ``max_steps``
    bounds the Taylor steps between two crossings. ``record`` keeps dense output, and only then is
    a guard noticed that touches zero without crossing it. ``before`` are firings that led to
    ``start``, which count for chatter. Always returns; the outcome tells how it ended.
    """
    progress = Progress(bound, start, section or bound.system.section, crossings, before)
    return _Integration(progress, end_time, section_timeout, max_steps, record).go()


# How steps end at which nothing happens.
_UNDER_WAY = (hy.taylor_outcome.success, hy.taylor_outcome.time_limit)


class _Integration:
    """The flow of one run from event to event, and how far it may go."""

    def __init__(
        self,
        progress: Progress,
        end_time: float,
        section_timeout: float,
        max_steps: int,
        record: bool,
    ) -> None:
        self.progress, self.bound, self.record = progress, progress.bound, record
        self.end_time, self.section_timeout = end_time, section_timeout
        self.max_steps, self.steps = max_steps, 0
        self.arcs: list[Arc] = []
        self._renew_limits()

    def go(self) -> Trajectory:
        progress = self.progress
        start = progress.here
        progress.begin()
        while progress.outcome is None:
            crossed = len(progress.crossings)
            self._flow()
            if len(progress.crossings) > crossed:
                self._renew_limits()
        return Trajectory(
            bound=self.bound,
            start=start,
            end=progress.here,
            events=tuple(progress.events),
            crossings=tuple(progress.crossings),
            arcs=tuple(self.arcs),
            steps=self.steps,
            outcome=progress.outcome,
        )

    def _renew_limits(self) -> None:
        """Set the time (s) and the steps after which the next crossing is given up."""
        self.limit, self.steps_left = self.end_time, self.max_steps
        if self.progress.wanted is not None:
            self.limit = min(self.end_time, self.progress.time + self.section_timeout)

    def _flow(self) -> None:
        """Follow the field of the present mode until something happens."""
        progress = self.progress
        mode = self.bound.mode(progress.mode)
        integrator = mode.enter(progress.time, progress.states, progress.held)
        code = mode.code
        jumps = code.jumps
        advance = self._advance_recording if self.record else self._advance
        leaves = code.endless and progress.leaves_a_guard(mode)
        longest = LEAVING if leaves else inf
        while True:
            result = advance(integrator, longest)
            longest = inf
            if progress.outcome is not None:
                return
            if result == hy.taylor_outcome.err_nf_state:
                progress.outcome = Outcome(
                    DIVERGED, f"not finite after t = {progress.time:.6g} s in {progress.mode}"
                )
                return
            progress.time, progress.states = integrator.time, code.state.copy()
            index = -int(result) - 1
            if not 0 <= index < len(jumps):
                progress.outcome = self._stopped(result)
                return
            if progress.happen(jumps[index], mode):
                return

    def _advance(self, integrator: Any, longest: float) -> Any:
        """Advance to the next event; the first step is at most ``longest`` (s)."""
        if self.steps_left <= 0:
            return hy.taylor_outcome.step_limit
        if longest < self.limit - integrator.time:
            result, _ = integrator.step(longest)
            self._count(1)
            if result not in _UNDER_WAY:
                return result
        result, _, _, steps, _, _ = integrator.propagate_until(self.limit, self.steps_left)
        self._count(steps)
        return result

    def _advance_recording(self, integrator: Any, longest: float) -> Any:
        """Advance step by step and keep the Taylor series of each."""
        times, series = [integrator.time], []
        result = hy.taylor_outcome.success
        while result == hy.taylor_outcome.success:
            if self.steps_left <= 0:
                result = hy.taylor_outcome.step_limit
                break
            left = self.limit - integrator.time
            result, _ = integrator.step(min(left, longest), write_tc=True)
            if longest < left and result in _UNDER_WAY:
                result = hy.taylor_outcome.success
            longest = inf
            if integrator.time > times[-1]:
                self._count(1)
                times.append(integrator.time)
                series.append(integrator.tc.copy())
        if series:
            progress = self.progress
            self._keep(Arc(progress.mode, progress.held, np.array(times), np.array(series)))
        return result

    def _count(self, steps: int) -> None:
        self.steps += steps
        self.steps_left -= steps

    def _keep(self, arc: Arc) -> None:
        """Keep an arc; if a guard touches zero within it without crossing, end the run there."""
        progress = self.progress
        touch = touches_without_crossing(arc, self.bound.mode(arc.mode))
        if touch is not None:
            name, time = touch
            arc = arc.until(time)
            progress.outcome = Outcome(GRAZED, f"{name} missed by a hair at t = {time:.9g} s")
        self.arcs.append(arc)
        progress.time, progress.states = arc.end, arc(arc.times[-1:])[0]

    def _stopped(self, result: Any) -> Outcome:
        """Tell how a run ended that came to one of its limits."""
        progress = self.progress
        if result != hy.taylor_outcome.time_limit:
            reached = f"{self.max_steps} steps in {progress.mode} reached only"
            return Outcome(TIMED_OUT, f"{reached} t = {progress.time:g} s")
        if self.limit == self.end_time:
            progress.settle()
            return progress.outcome or Outcome(COMPLETED, f"reached t = {progress.time:.6g} s")
        return Outcome(
            progress.section.missed,
            f"no {progress.section_name} within {self.section_timeout:g} s after "
            f"{len(progress.crossings)} of {progress.wanted}, still in {progress.mode}",
        )
