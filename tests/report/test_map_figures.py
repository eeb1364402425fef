"""The figures of basins and maps draw the arrays they are given, and say what is missing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.text import Text

from flexspine import load_model
from flexspine.errors import InputError
from flexspine.report.basin_figure import plot_basin
from flexspine.report.map_figure import plot_map
from flexspine.studies.basin import Basin, Other
from flexspine.studies.gait_map import GaitMap
from tests.report.layout import assert_apart, text_boxes

STIFFNESSES, SPEEDS = np.linspace(180, 280, 6), np.linspace(2.5, 4.5, 21)


@pytest.fixture(scope="module")
def drawn_map() -> GaitMap:
    """Ends on the slow side from 240 N m/rad on; stable beyond some 4 m/s."""
    slowest = np.array([np.nan, np.nan, np.nan, 3.02, 3.32, 3.62])
    speeds, stiffnesses = np.meshgrid(SPEEDS, STIFFNESSES)
    there = speeds > np.nan_to_num(slowest)[:, None]
    return GaitMap(
        model=load_model("kamimura2015-flexible"),
        energy=290.0,
        height=0.32,
        stiffnesses=STIFFNESSES,
        speeds=SPEEDS,
        peak_grf=np.where(there, 1500 - 200 * speeds - stiffnesses, np.nan),
        radius=np.where(there, 4.02 / speeds, np.nan),
        slowest=slowest,
        fastest=np.full(6, np.nan),
        reasons=("", "", "", *["second touchdown at mean_speed = 3"] * 3),
    )


@pytest.fixture(scope="module")
def basins() -> list[Basin]:
    """A stable gait, of whose starts a third does not come to it, and one about which all fall."""
    model = load_model("scout2")
    pitches, rates = np.linspace(-0.5, 0.5, 9), np.linspace(0.0, 4.0, 7)
    strides = np.full((9, 7), 100)
    strides[0] = 3
    deviation = np.where(strides == 100, 1e-10, np.nan)
    deviation[1:4] = 0.5
    stable = Basin(
        name="scout2",
        model=model,
        radius=0.73,
        energy=242.0,
        energy_kept=True,
        over=("pitch", "pitch_rate"),
        values=(pitches, rates),
        wanted=100,
        strides=strides,
        deviation=deviation,
        possible=np.ones((9, 7), dtype=bool),
        others=(Other(dict(model.apex), 21, 0.58),),
    )
    possible = np.broadcast_to(rates < 3, (9, 7))
    unstable = replace(
        stable, name="another", radius=1.53, strides=np.full((9, 7), 4), possible=possible,
        deviation=np.full((9, 7), np.nan), others=(),
    )  # fmt: skip
    return [stable, unstable]


def images(axes: Any) -> list[Any]:
    return [image for image in axes.images if image.get_array().shape > (1, 1)]


def words(figure: Figure) -> str:
    return "\n".join(text.get_text() for text in figure.findobj(Text))


def at(image: Any, x: float, y: float) -> Any:
    """What an image holds at a place; masked if nothing."""
    left, right, bottom, top = image.get_extent()
    data = image.get_array()
    row = int((y - bottom) / (top - bottom) * data.shape[0])
    column = int((x - left) / (right - left) * data.shape[1])
    return data[row, column]


def test_a_map_shows_every_gait_where_it_is(drawn_map: GaitMap) -> None:
    figure = plot_map(drawn_map)
    for axes, content in zip(figure.axes, (drawn_map.peak_grf, drawn_map.radius), strict=False):
        (image,) = images(axes)
        for i, stiffness in enumerate(STIFFNESSES):
            for j, speed in enumerate(SPEEDS):
                shown = at(image, speed, stiffness)
                assert np.ma.is_masked(shown) == np.isnan(content[i, j])
                if np.isfinite(content[i, j]):
                    assert shown == content[i, j]


def test_a_map_is_cut_where_gaits_end(drawn_map: GaitMap) -> None:
    """At 240 N m/rad they end at 3.02 m/s; the first gait is at 3.1, its cell begins at 3.05."""
    figure = plot_map(drawn_map)
    for axes in figure.axes[:2]:
        (image,) = images(axes)
        assert not np.ma.is_masked(at(image, 3.045, 240.5))
        assert np.ma.is_masked(at(image, 3.005, 240.5))
        ends = [line for line in axes.get_lines() if 3.02 in line.get_xdata()]
        assert len(ends) == 1
        for x, y in ((3.02, 240.0), (3.32, 260.0), (3.62, 280.0)):
            assert (x, y) in zip(ends[0].get_xdata(), ends[0].get_ydata(), strict=True)


def test_a_map_draws_the_limit_of_stability_where_it_is(drawn_map: GaitMap) -> None:
    figure = plot_map(drawn_map)
    assert "limit of stability" in words(figure)
    for axes in figure.axes[:2]:
        thick = [c for c in axes.collections if np.max(c.get_linewidths()) > 2]
        assert len(thick) == 1
        points = np.concatenate([path.vertices for path in thick[0].get_paths()])
        # A radius of 4.02 / v is one at 4.02 m/s; between gaits it is taken to be straight.
        assert points[:, 0] == pytest.approx(4.02, abs=2e-3)
    none = replace(drawn_map, radius=drawn_map.radius + 1)
    assert "limit of stability" not in words(plot_map(none))
    assert "no gait here is stable" in words(plot_map(none))


def test_a_map_marks_the_published_stiffnesses(drawn_map: GaitMap) -> None:
    for axes in plot_map(drawn_map).axes[:2]:
        marks = {line.get_ydata()[0] for line in axes.get_lines() if line.get_linestyle() == "--"}
        assert marks == {200, 220, 240, 260}
    assert "Kamimura" not in words(plot_map(drawn_map, published=()))


def test_a_basin_shows_strides_and_deviations(basins: list[Basin]) -> None:
    figure = plot_basin(basins)
    for column, basin in enumerate(basins):
        above, below = figure.axes[column], figure.axes[column + 2]
        *_, strides = images(above)
        grey, left = images(below)
        for i, pitch in enumerate(np.degrees(basin.values[0])):
            for j, rate in enumerate(np.degrees(basin.values[1])):
                possible, lasted = basin.possible[i, j], basin.lasted[i, j]
                shown = at(strides, pitch, rate)
                assert np.ma.is_masked(shown) == (not possible)
                assert not possible or shown == basin.strides[i, j]
                assert np.ma.is_masked(at(grey, pitch, rate)) == (not possible)
                assert np.ma.is_masked(at(left, pitch, rate)) == (not lasted)
                assert not lasted or at(left, pitch, rate) == basin.deviation[i, j]
        for axes in (above, below):
            (gait,) = axes.get_lines()
            assert gait.get_xdata() == pytest.approx([0])
            assert gait.get_ydata() == pytest.approx([140])


def test_starts_that_lasted_have_a_colour_of_their_own(basins: list[Basin]) -> None:
    *_, image = images(plot_basin(basins).axes[0])
    colors = [tuple(image.to_rgba(np.array([n]))[0]) for n in (0, 1, 4, 7, 99, 100)]
    assert len(set(colors)) == len(colors)
    brightness = [sum(color[:3]) for color in colors[1:]]
    assert brightness == sorted(brightness)
    assert colors[0] == pytest.approx(to_rgba("#D5D5D5"), abs=0.01)


def test_a_basin_tells_its_numbers(basins: list[Basin]) -> None:
    told = words(plot_basin(basins))
    for text in (
        "scout2", "4 m/s", "= 0.73: stable", "= 1.53: not stable", "none of 45 starts lasts",
        "55.6 % come to it", "33.3 % to other gaits", "energy of its gait", "all 100", "50 to 99",
    ):  # fmt: skip
        assert text in told
    assert "at rest" in told
    assert "at rest" not in words(plot_basin(basins[:1]))
    lost = replace(basins[0], others=(Other(dict(basins[0].model.apex), 21, None),))
    assert "33.3 % not, or not yet" in words(plot_basin([lost]))


def test_every_axis_has_a_unit(drawn_map: GaitMap, basins: list[Basin]) -> None:
    for figure in (plot_map(drawn_map), plot_basin(basins)):
        labels = [axes.get_ylabel() for axes in figure.axes] + [a.get_xlabel() for a in figure.axes]
        shown = [label for label in labels if label]
        assert len(shown) >= 4
        for label in shown:
            assert label.endswith(")") or "spectral radius" in label or "strides" in label, label


def test_no_text_runs_over_another(drawn_map: GaitMap, basins: list[Basin]) -> None:
    figures = [plot_basin((basins * 2)[:count]) for count in (1, 2, 4)]
    for figure in (plot_map(drawn_map), *figures):
        boxes = text_boxes(figure)
        assert_apart(boxes)
        for text, box in boxes:
            assert box.x0 >= 0, f"{text!r} leaves the figure"
            assert box.x1 <= figure.bbox.width + 1, f"{text!r} leaves the figure"


def test_few_strides_and_one_gait_are_drawn(drawn_map: GaitMap, basins: list[Basin]) -> None:
    few = replace(basins[0], wanted=1, strides=np.ones((9, 7), dtype=int))
    plot_basin([few]).draw_without_rendering()
    only = np.full_like(drawn_map.radius, np.nan)
    only[2, 3] = 2.0
    one = replace(drawn_map, radius=only, peak_grf=100 * only, slowest=np.full(6, np.nan))
    plot_map(one).draw_without_rendering()
    plot_map(replace(one, peak_grf=np.full_like(only, np.nan))).draw_without_rendering()


def test_what_cannot_be_drawn_is_refused(drawn_map: GaitMap, basins: list[Basin]) -> None:
    nothing = np.full_like(drawn_map.radius, np.nan)
    with pytest.raises(InputError, match="no gait"):
        plot_map(replace(drawn_map, radius=nothing))
    with pytest.raises(InputError, match="one slice"):
        plot_basin([])
    with pytest.raises(InputError, match="one slice"):
        plot_basin([basins[0], replace(basins[1], wanted=50)])
