"""The picture of how far runs come."""

from __future__ import annotations

import pytest

from flexspine.control.disturbance import Fate
from flexspine.report.distance_figure import plot_distances
from flexspine.studies.wayfaring import Terrain, Wayfaring

FELL = {"survived": False, "outcome": "fell", "distance": 7.0}


@pytest.mark.parametrize(
    ("kind", "numbers", "told"),
    [
        ("rough", {"height": 0.008}, ("height 0.008 m", "spacing 0.3 m")),
        ("slope", {}, ("degrees -0.3",)),
        ("stairs", {"count": 3.0}, ("height -0.01 m", "length 2 m", "count 3")),
    ],
)
def test_all_numbers_of_the_ground_have_units(
    kind: str, numbers: dict[str, float], told: tuple[str, ...]
) -> None:
    fates = tuple(
        Fate(**{name: FELL.get(name, 1) for name in Fate._fields})  # type: ignore[arg-type]
        for _ in range(2)
    )
    record = {"preset": "p", "passive": True, "mean_speed": 4.5}
    figure = plot_distances(Wayfaring(Terrain(kind, numbers), 5, 0, fates), record)
    words = "  ·  ".join(text.get_text() for text in figure.texts).split("  ·  ")
    assert set(told) <= set(words)
