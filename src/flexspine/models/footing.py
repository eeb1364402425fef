"""Which feet of a robot are on the ground, and which of them slide."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from flexspine.mechanics.complementarity import Contact

FLIGHT = "flight"

_MARKS = {Contact.STICK: "", Contact.SLIDE_FORWARD: " >", Contact.SLIDE_BACK: " <"}


@dataclass(frozen=True)
class Footing:
    """Contacts by foot, in the order of the robot's feet; feet that are not named are open.

    Its name lists them, those that slide with the way they go: ``toe_1 + toe_3 >``.
    """

    contacts: tuple[tuple[str, Contact], ...] = ()

    @classmethod
    def of(cls, contacts: Mapping[str, Contact], feet: Mapping[str, object]) -> Footing:
        """The footing with these contacts, open ones among them left out."""
        return cls(
            tuple(
                (foot, contacts[foot])
                for foot in feet
                if contacts.get(foot, Contact.OPEN) is not Contact.OPEN
            )
        )

    @classmethod
    def named(cls, name: str) -> Footing:
        """The footing of a name."""
        if name == FLIGHT:
            return cls()
        parts = []
        for part in name.split(" + "):
            foot, _, mark = part.partition(" ")
            parts.append((foot, next(c for c, m in _MARKS.items() if m.strip() == mark)))
        return cls(tuple(parts))

    @property
    def name(self) -> str:
        """What it is called."""
        return " + ".join(foot + _MARKS[does] for foot, does in self.contacts) or FLIGHT

    @property
    def feet(self) -> tuple[str, ...]:
        """All that touch the ground."""
        return tuple(foot for foot, _ in self.contacts)

    @property
    def sticking(self) -> tuple[str, ...]:
        """Those that do not slide."""
        return tuple(foot for foot, does in self.contacts if does is Contact.STICK)

    def does(self, foot: str) -> Contact:
        """What a foot does."""
        return dict(self.contacts).get(foot, Contact.OPEN)

    def but(self, foot: str, does: Contact, feet: Mapping[str, object]) -> Footing:
        """The same with one foot doing something else."""
        return Footing.of({**dict(self.contacts), foot: does}, feet)
