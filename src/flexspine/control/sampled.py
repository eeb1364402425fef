"""Walk under a law that a computer asks for torques."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import sympy as sp

from flexspine.control.clocked import Clocked
from flexspine.control.laws import Law, Tracking
from flexspine.control.walking import WalkingDrive
from flexspine.hybrid.compile import Array
from flexspine.models.drive import Moment


@dataclass(frozen=True)
class Sampled(Clocked, WalkingDrive):
    """Walk by a law, such as one of `flexspine.control.laws`."""

    law: Law = field(default_factory=Tracking)

    def observed(self) -> tuple[Mapping[sp.Symbol, sp.Expr], Mapping[str, sp.Expr]]:
        """Where joints are to be."""
        return self.references.definitions, self.observed_references

    def choose(self, moment: Moment) -> tuple[Array, Mapping[sp.Symbol, float]]:
        """What the law wants."""
        return self.law.torques(self.situation(moment, self.limit)), {}
