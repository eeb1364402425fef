"""What the runs say about a claim."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from flexspine.gaits.gait import Gait

HOLDS, FAILS, DEPENDS, UNDECIDED = "holds", "fails", "depends on", "undecided"


@dataclass(frozen=True)
class Verdict:
    """``verdict`` is ``holds``, ``fails``, ``depends on``, or ``undecided`` without evidence.

    ``finding`` says it in words with the numbers; ``numbers`` are these for machines, ``runs`` the
    gaits that are quoted, by name, and ``command`` what repeats the runs of those that quote none.
    """

    number: int
    claim: str
    verdict: str
    finding: str
    numbers: Mapping[str, Any] = field(default_factory=dict)
    runs: Mapping[str, Gait] = field(default_factory=dict)
    command: str = ""


def decided(for_it: list[bool], against_it: list[bool]) -> str:
    """All cases for it, all against it, or some of each."""
    if not (for_it or against_it):
        return UNDECIDED
    if all(for_it):
        return HOLDS
    return FAILS if all(against_it) else DEPENDS
