"""Saved gaits in a page: a table of them, and the parameters of each."""

from __future__ import annotations

from typing import Any

from flexspine.models.legs import SIDES
from flexspine.report.page.markup import Markup, folded, joined
from flexspine.report.page.parameters import of_record
from flexspine.report.page.tables import shown

# Of a gait, beside its name; more is in its file.
OF_GAIT = (
    "preset", "family", "mean_speed", "energy", "period", "stride_length", "cost_of_transport",
    "level_spectral_radius", "stable",
)  # fmt: skip
FORCE = "peak_grf"


def gait_section(gaits: dict[str, dict[str, Any]]) -> Markup:
    """Return a table of the gaits, and the parameters of each, folded."""
    columns: dict[str, list[Any]] = {
        "file": list(gaits),
        **{name: [gait.get(name) for gait in gaits.values()] for name in OF_GAIT},
        **{
            f"{FORCE}_{side}": [gait.get(FORCE, {}).get(side) for gait in gaits.values()]
            for side in SIDES
        },
    }
    parameters = (folded(name, of_record(gait)) for name, gait in gaits.items())
    return joined([shown(columns), folded("parameters of each", *parameters)])
