"""The kinds of bounder, by name."""

from __future__ import annotations

from flexspine.errors import UnknownNameError
from flexspine.models.bounder import BounderKind
from flexspine.models.flexible_bounder import FLEXIBLE_BOUNDER
from flexspine.models.locked_bounder import LOCKED_BOUNDER
from flexspine.models.rigid_bounder import RIGID_BOUNDER

KINDS: dict[str, BounderKind] = {
    kind.name: kind for kind in (RIGID_BOUNDER, LOCKED_BOUNDER, FLEXIBLE_BOUNDER)
}


def find_kind(name: str) -> BounderKind:
    """Return the kind of that name; raises `UnknownNameError`."""
    if name not in KINDS:
        raise UnknownNameError("model", name, KINDS)
    return KINDS[name]
