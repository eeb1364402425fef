"""The picture of what bodies survive."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.container import ErrorbarContainer

from flexspine.control.disturbance import Fate, disturbance
from flexspine.report.robustness_figure import plot_robustness
from flexspine.studies.robustness import Endurance, Robustness, wilson
from tests.report.layout import assert_no_text_overlaps


def about(energy: float, **parameters: float) -> dict[str, Any]:
    return {
        "mean_speed": 4.5, "energy": energy, "apex": {"height": 0.32}, "parameters": parameters,
    }  # fmt: skip


def fate(*, survived: bool) -> Fate:
    named = {"survived": survived, "outcome": "completed" if survived else "fell"}
    return Fate(**{name: named.get(name, 1.0) for name in Fate._fields})  # type: ignore[arg-type]


def test_shares_have_bars_and_the_title_names_the_gaits() -> None:
    sizes = np.arange(-19.75, 20, 0.5)
    bodies = {
        name: Endurance(sizes, tuple(fate(survived=bool(abs(size) < most)) for size in sizes))
        for name, most in (("locked-spine", 5.0), ("flexible", 10.5))
    }
    found = Robustness(disturbance("push"), 20.0, 50, 0, bodies)
    gaits = {"locked-spine": about(290.0), "flexible": about(290.0, **{"spine.stiffness": 260.0})}
    figure = plot_robustness(found, gaits)
    (axes,) = figure.axes
    text = " ".join(each.get_text() for each in figure.texts)
    for told in ("4.5 m/s", "290 J", "apex height 0.32 m", "80 runs"):
        assert told in text
    names = [each.get_text() for each in axes.get_legend().get_texts()]
    assert names == ["locked spine", "flexible\n$k_t$ = 260 N m/rad"]
    drawn = [each for each in axes.containers if isinstance(each, ErrorbarContainer)]
    assert len(drawn) == 2
    assert not any(isinstance(each, PolyCollection) for each in axes.collections), "no bands"
    # Two runs a bin; of one in two the interval is that of one in two.
    line, _, (bars,) = drawn[1]
    shares = np.asarray(line.get_ydata())
    assert shares.tolist() == [0.0] * 9 + [50.0] + [100.0] * 20 + [50.0] + [0.0] * 9
    ends = np.array([segment[:, 1] for segment in bars.get_segments()])
    assert np.allclose(ends[9], 100 * np.array(wilson(1, 2)))
    assert_no_text_overlaps(figure)


def test_what_differs_is_told_of_each() -> None:
    one = Endurance(np.array([0.01]), (fate(survived=True),))
    found = Robustness(disturbance("acting"), 0.03, 5, 0, {"a": one, "b": one})
    figure = plot_robustness(found, {"a": about(290.0), "b": about(310.0)})
    names = [each.get_text() for each in figure.axes[0].get_legend().get_texts()]
    assert names == ["a\n290 J", "b\n310 J"]
    assert "4.5 m/s" in " ".join(each.get_text() for each in figure.texts)
