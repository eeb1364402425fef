"""Which feet of a robot are on the ground, and which of them slide."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from flexspine.mechanics.complementarity import Contact

FLIGHT = "flight"

_MARKS = {Contact.STICK: "", Contact.SLIDE_FORWARD: " >", Contact.SLIDE_BACK: " <"}

# Whether a foot stands, and which way it slides.
_FLAGS = {
    Contact.OPEN: (0.0, 0.0),
    Contact.STICK: (1.0, 0.0),
    Contact.SLIDE_FORWARD: (1.0, 1.0),
    Contact.SLIDE_BACK: (1.0, -1.0),
}
_CONTACTS = {flags: contact for contact, flags in _FLAGS.items()}


@lru_cache(maxsize=256)
def flags_of(foot: str) -> tuple[sp.Symbol, sp.Symbol]:
    """The symbols of a foot's flags."""
    return sp.Symbol(f"stands_{foot}", real=True), sp.Symbol(f"slides_{foot}", real=True)


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
    def sticking_on(cls, feet: Iterable[str]) -> Footing:
        """The footing of feet that all stick."""
        return cls(tuple((foot, Contact.STICK) for foot in feet))

    @classmethod
    def in_flags(cls, held: Mapping[sp.Symbol, float], feet: Iterable[str]) -> Footing:
        """The footing that flags tell."""
        found = []
        for foot in feet:
            stands, slides = flags_of(foot)
            if held[stands]:
                found.append((foot, _CONTACTS[held[stands], held[slides]]))
        return cls(tuple(found))

    def flags(self, feet: Iterable[str]) -> dict[sp.Symbol, float]:
        """The flags of all feet."""
        contacts = dict(self.contacts)
        found: dict[sp.Symbol, float] = {}
        for foot in feet:
            found |= dict(
                zip(flags_of(foot), _FLAGS[contacts.get(foot, Contact.OPEN)], strict=True)
            )
        return found

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
