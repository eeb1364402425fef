"""How a run ended, as a value with advice; expected failure raises nothing."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OutcomeKind:
    """A way for a run to end: its name, and ``advice`` on what to try next."""

    name: str
    advice: str


COMPLETED = OutcomeKind("completed", "nothing to do")
GRAZED = OutcomeKind(
    "grazed",
    "the motion touches a guard without crossing it, so what follows is not determined; "
    "change the initial state or a parameter a little",
)
CHATTERED = OutcomeKind(
    "chattered",
    "events pile up in ever shorter time; look for a rest state there, or change a parameter",
)
TIMED_OUT = OutcomeKind(
    "timed_out",
    "the step budget is spent, mostly because something is far too stiff for its mass; "
    "look at the parameters or raise max_steps",
)
DIVERGED = OutcomeKind(
    "diverged",
    "the state stopped being finite; look for a parameter or a rate that is far too large",
)


@dataclass(frozen=True)
class Outcome:
    """How a run ended: its kind, and one line about what happened, where and when.

    Kinds of all runs are ``completed``, ``grazed``, ``chattered``, ``timed_out`` and ``diverged``;
    animals add their own, such as ``fell`` and ``no_apex``.
    """

    kind: OutcomeKind
    message: str

    @property
    def name(self) -> str:
        """The kind's name, such as ``completed``."""
        return self.kind.name

    @property
    def advice(self) -> str:
        """What to try next."""
        return self.kind.advice

    @property
    def completed(self) -> bool:
        """Whether the run did what was asked of it."""
        return self.kind is COMPLETED

    def __str__(self) -> str:
        return f"{self.name}: {self.message}"
