"""The part of a long run that is kept in full and drawn: its beginning, or how it ended."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from flexspine.control.steering import SteeredBounder, SteeredRun
from flexspine.hybrid.integrate import integrate

# More strides than these run together in a picture, and take megabytes and minutes.
SHOWN = 8


@dataclass(frozen=True, repr=False)
class Excerpt(SteeredRun):
    """Strides from ``first`` to ``last``, counted from 1, of a run that made ``made``.

    With those of a run that ended early goes what came after the last of them.
    """

    first: int = field(kw_only=True)
    last: int = field(kw_only=True)
    made: int = field(kw_only=True)

    @property
    def told(self) -> str | None:
        """Which part it is, in words; None if it is the whole."""
        count = self.last - self.first + 1
        if count >= self.made:
            return None
        start, end = self.trajectory.start.time, self.trajectory.end.time
        which = "first" if self.first == 1 else "last"
        after = "" if self.outcome.completed else " and the end"
        return f"the {which} {count} of {self.made} strides{after}, {start:.2f} to {end:.2f} s"

    @property
    def remarks(self) -> dict[str, str]:
        """Which part is shown, besides what there is to say of the run."""
        part = {} if self.told is None else {"shown": self.told}
        return {**part, **super().remarks}

    @property
    def record(self) -> dict[str, Any]:
        """Which part it is, for a file."""
        start, end = self.trajectory.start.time, self.trajectory.end.time
        return {"strides": [self.first, self.last], "start": start, "end": end, "told": self.told}


def excerpt(run: SteeredRun, most: int = SHOWN) -> Excerpt:
    """Run the part of a run worth looking at once more, and keep its motion.

    These are its first ``most`` strides, or its last ones if it ended early.
    """
    made, completed = len(run.trajectory.crossings), run.outcome.completed
    skipped = 0 if completed else max(made - most, 0)
    wanted = min(made, most) if completed else most + 1
    bound = SteeredBounder(run.model, run.steering, run.tolerance, run.noise, run.seed)
    start = bound.start()
    if skipped:
        start = integrate(bound, start, crossings=skipped).end
    part = integrate(bound, start, crossings=wanted, record=True)
    if part.end.time == run.trajectory.end.time:
        part = replace(part, outcome=run.outcome)  # which counts all strides
    return Excerpt(
        run.model, part, run.tolerance, steering=run.steering, noise=run.noise, seed=run.seed,
        first=skipped + 1, last=skipped + len(part.crossings), made=made,
    )  # fmt: skip
