"""The figures of the study draw the tables and strides they are given, and say what is missing."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from flexspine import load_model, simulate, to_dataset
from flexspine.errors import InputError
from flexspine.report.study_figures import (
    plot_energy_shares,
    plot_peak_grf,
    plot_peak_grf_stiffness,
    plot_profiles,
    plot_stability_speed,
    plot_stability_stiffness,
)
from tests.report.layout import assert_apart, text_boxes

Row = dict[str, Any]
Profiles = dict[tuple[str, float], xr.Dataset]

RIGID, LOCKED, FLEXIBLE = "published rigid", "locked spine", "flexible"
SOFT, MIDDLE, STIFF = (f"{FLEXIBLE}, k_t = {value:g} N m/rad" for value in (200, 220, 260))

PUBLISHED: list[Row] = [
    {"body": "rigid", "spine_stiffness": None, "mean_speed": 3.92, "peak_grf": 1065.0},
    {"body": "flexible", "spine_stiffness": 200.0, "mean_speed": 4.25, "peak_grf": 705.0},
    {"body": "flexible", "spine_stiffness": 260.0, "mean_speed": 4.5, "peak_grf": 528.0},
]


def gait(mean_speed: float, peak: float, radius: float, **more: Any) -> Row:
    return {
        "mean_speed": mean_speed, "energy": 290.0, "apex_height": 0.32, "confirmed": True,
        "peak_grf_fore": peak - 5.0, "peak_grf_hind": peak, "level_spectral_radius": radius,
        "stable": radius < 1, **more,
    }  # fmt: skip


def branch(body: str, stiffness: float | None, points: list[tuple[float, float, float]]) -> list:
    return [
        gait(*point, body=body, spine_stiffness=stiffness, position=position)
        for position, point in enumerate(points)
    ]


# Each folds: its fastest gait is not its last.
FOLDED = [(2.4, 900.0, 5.0), (4.0, 700.0, 4.0), (4.55, 420.0, 1.4), (4.5, 460.0, 12.0)]
BRANCHES: dict[tuple[str, float | None], list[tuple[float, float, float]]] = {
    (RIGID, None): [(2.4, 1370.0, 60.0), (3.92, 1060.0, 6.0), (4.59, 300.0, 3.0)],
    (LOCKED, None): [(4.1, 830.0, 1.5), (4.3, 740.0, 0.9), (4.5, 540.0, 0.6), (4.58, 350.0, 0.5)],
    (FLEXIBLE, 200.0): FOLDED,
    (FLEXIBLE, 260.0): [(speed, peak - 30.0, radius + 0.2) for speed, peak, radius in FOLDED],
}

CONTINUED, NEXT = "continued from the published gait", "next to the locked spine"
SWEEP = [(400.0, 310.0, 4.0), (140.0, 500.0, 1.5), (135.0, 520.0, 1.7), (870.0, 410.0, 2.1)]
STIFFER = [(1e6, 542.0, 1.0), (1e4, 541.0, 0.98), (1e3, 520.0, 1.4)]


@pytest.fixture
def gaits() -> list[Row]:
    """The table of gaits with its rows in disorder."""
    rows = [row for (body, k), points in BRANCHES.items() for row in branch(body, k, points)]
    return rows[:1] + rows[:0:-1]


@pytest.fixture
def sweeps() -> list[Row]:
    """The table over stiffness; at 4 m/s the locked spine has no gait."""
    rows = []
    for speed in (4.0, 4.5):
        for kind, points in ((CONTINUED, SWEEP), (NEXT, STIFFER)):
            if kind == CONTINUED or speed == 4.5:
                rows += [
                    gait(speed, peak, radius, speed=speed, kind=kind, spine_stiffness=stiffness)
                    for stiffness, peak, radius in points
                ]
    return [
        *rows, gait(4.5, 543.0, 0.55, speed=4.5, kind=LOCKED, spine_stiffness=None)
    ]  # fmt: skip


@pytest.fixture(scope="module")
def profiles() -> Profiles:
    """Strides at 4.5 m/s, some of which pass for such at 4 m/s, where the locked spine has none."""
    rigid, locked, flexible = (
        to_dataset(simulate(load_model(f"kamimura2015-{name}")))
        for name in ("rigid", "locked", "flexible")
    )
    strides: Profiles = {(RIGID, 4.0): rigid, (RIGID, 4.5): rigid, (LOCKED, 4.5): locked}
    for label, stiffness in ((STIFF, 260.0), (SOFT, 200.0), (MIDDLE, 220.0)):
        stride = flexible.copy()
        given = json.loads(flexible.attrs["parameters"])
        stride.attrs["parameters"] = json.dumps({**given, "spine.stiffness": stiffness})
        strides |= {(label, 4.0): stride, (label, 4.5): stride}
    return strides


@pytest.fixture
def drawn(gaits: list[Row], sweeps: list[Row], profiles: Profiles) -> dict[str, Figure]:
    return {
        "peak over speed": plot_peak_grf(gaits, PUBLISHED),
        "stability over speed": plot_stability_speed(gaits),
        "peak over stiffness": plot_peak_grf_stiffness(sweeps),
        "stability over stiffness": plot_stability_stiffness(sweeps),
        "profiles": plot_profiles(profiles, (4.0, 4.5)),
        "energy": plot_energy_shares(profiles),
    }


def has_line(axes: Any, x: Any, y: Any) -> bool:
    return any(
        len(line.get_xdata()) == len(x)
        and np.allclose(line.get_xdata(), x)
        and np.allclose(line.get_ydata(), y, equal_nan=True)
        for line in axes.get_lines()
    )


def words(figure: Figure) -> str:
    return "\n".join(text.get_text() for text in figure.findobj(Text))


def of(points: list[tuple[float, float, float]], column: int) -> list[float]:
    return [point[column] for point in points]


@pytest.mark.parametrize(("draw", "column"), [(plot_peak_grf, 1), (plot_stability_speed, 2)])
def test_every_branch_over_speed_is_drawn_in_its_order(
    gaits: list[Row], draw: Callable[[list[Row]], Figure], column: int
) -> None:
    for axes in draw(gaits).axes:
        for points in BRANCHES.values():
            assert has_line(axes, of(points, 0), of(points, column))


@pytest.mark.parametrize(
    ("draw", "column"), [(plot_peak_grf_stiffness, 1), (plot_stability_stiffness, 2)]
)
def test_every_gait_over_stiffness_is_drawn(
    sweeps: list[Row], draw: Callable[[list[Row]], Figure], column: int
) -> None:
    locked = {1: 543.0, 2: 0.55}[column]
    for axes in draw(sweeps).axes:
        assert axes.get_xscale() == "log"
        assert has_line(axes, of(SWEEP, 0), of(SWEEP, column))
    for axes in draw(sweeps).axes[1::2]:
        assert has_line(axes, of(STIFFER, 0), of(STIFFER, column))
        assert has_line(axes, [0, 1], [locked, locked])


def test_published_readings_are_where_they_were_read_in_the_colour_of_their_body(
    gaits: list[Row],
) -> None:
    figure = plot_peak_grf(gaits, PUBLISHED)
    lines = {line.get_label(): line for line in figure.axes[0].get_lines()}
    assert lines
    for axes in figure.axes:
        for reading in PUBLISHED:
            x, y = reading["mean_speed"], reading["peak_grf"]
            assert has_line(axes, [x], [y])
            box = next(
                patch
                for patch in axes.patches
                if isinstance(patch, Rectangle) and np.allclose(patch.get_center(), (x, y))
            )
            assert np.allclose((box.get_width(), box.get_height()), (0.04, 16))
            points = next(
                points
                for (body, stiffness), points in BRANCHES.items()
                if body.endswith(reading["body"]) and stiffness == reading["spine_stiffness"]
            )
            line = next(
                line for line in axes.get_lines() if np.array_equal(line.get_ydata(), of(points, 1))
            )
            assert to_hex(box.get_edgecolor()) == to_hex(line.get_color())
    assert "±8 N, ±0.02 m/s" in words(figure)
    assert "±8 N" not in words(plot_peak_grf(gaits))


def test_a_gait_that_was_not_run_to_its_peak_has_none(gaits: list[Row]) -> None:
    first = next(row for row in gaits if row["spine_stiffness"] == 260 and row["position"] == 0)
    first["confirmed"] = False
    points = BRANCHES[FLEXIBLE, 260.0]
    axes = plot_peak_grf(gaits).axes[0]
    assert has_line(axes, of(points, 0), [np.nan, *of(points, 1)[1:]])
    ends = [float(line.get_ydata()[0]) for line in axes.get_lines() if line.get_marker() == "o"]
    assert points[1][1] in ends
    assert np.isfinite(ends).all()


def test_stable_gaits_are_drawn_thick(gaits: list[Row]) -> None:
    figure = plot_stability_speed(gaits)
    for axes in figure.axes:
        assert axes.get_yscale() == "log"
        assert has_line(axes, [0, 1], [1, 1])
        thick = [line for line in axes.get_lines() if line.get_linewidth() > 3]
        values = np.concatenate([line.get_ydata() for line in thick])
        assert sorted(values[np.isfinite(values)]) == [0.5, 0.6, 0.9]


def test_the_ends_of_branches_are_marked(sweeps: list[Row]) -> None:
    for axes in plot_peak_grf_stiffness(sweeps).axes:
        ends = [line.get_xdata()[0] for line in axes.get_lines() if line.get_marker() == "o"]
        assert ends == [400.0, 870.0]


def test_strides_are_drawn_over_time(profiles: Profiles) -> None:
    figure = plot_profiles(profiles, (4.0, 4.5))
    heights, _, forces, _ = figure.axes
    for label in (RIGID, SOFT, STIFF):
        stride = profiles[label, 4.0]
        assert has_line(heights, stride.time, stride.com_y)
        tops = [np.nanmax(line.get_ydata()) for line in forces.get_lines()]
        assert any(np.isclose(top, stride.fore_grf.max()) for top in tops)
    assert "$k_t$ = 200" in words(figure)
    assert "$k_t$ = 220" not in words(figure)
    for axes in figure.axes:
        assert axes.get_xlim()[0] == 0


def test_energy_shares_fill_the_whole(profiles: Profiles) -> None:
    figure = plot_energy_shares(profiles)
    assert [axes.get_title("left") for axes in figure.axes[:3]] == [
        RIGID, LOCKED, STIFF.replace("k_t", "$k_t$"),
    ]  # fmt: skip
    for axes in figure.axes[:3]:
        top = max(path.vertices[:, 1].max() for c in axes.collections for path in c.get_paths())
        assert top == pytest.approx(100)
    stride = profiles[STIFF, 4.5]
    spine = 100 * stride.spine_energy / stride.total_energy[0]
    legs = 100 * stride.leg_energy / stride.total_energy[0]
    assert has_line(figure.axes[5], stride.time, spine)
    assert has_line(figure.axes[5], stride.time, legs)


def test_what_is_missing_is_said(sweeps: list[Row], profiles: Profiles) -> None:
    for figure in (plot_peak_grf_stiffness(sweeps), plot_profiles(profiles, (4.0, 4.5))):
        told = [text.get_text() for axes in figure.axes for text in axes.texts]
        assert len(told) == 1
        assert told[0].startswith("no gait at 4 m/s:")
        assert told[0].endswith(LOCKED)
    told = [
        text.get_text() for axes in plot_energy_shares(profiles, 4.0).axes for text in axes.texts
    ]
    assert told == ["no gait at 4 m/s"]


def test_a_speed_without_any_stride_leaves_its_column_empty(profiles: Profiles) -> None:
    figure = plot_profiles(profiles, (3.0, 4.5))
    assert not figure.axes[0].get_lines()
    assert all(label.replace("k_t", "$k_t$") in words(figure) for label in (RIGID, LOCKED, SOFT))


def test_every_axis_has_a_unit(drawn: dict[str, Figure]) -> None:
    for name, figure in drawn.items():
        labels = [axes.get_ylabel() for axes in figure.axes] + [a.get_xlabel() for a in figure.axes]
        shown = [label for label in labels if label]
        assert len(shown) >= 3, name
        for label in shown:
            assert label.endswith(")") or label.startswith("spectral radius"), label


def test_every_title_says_what_the_numbers_are_of(drawn: dict[str, Figure]) -> None:
    for name, figure in drawn.items():
        title = "\n".join(text.get_text() for text in figure.texts)
        assert "total energy 290 J" in title, name
        assert "apex height 0.32 m" in title, name
        assert "$k_l$ = 6340 N/m per leg pair" in title, name
        assert "$k_t$ on the relative angle" in title, name
        if "peak" in name:
            assert "whichever is larger" in title


def test_no_text_runs_over_another(drawn: dict[str, Figure]) -> None:
    for name, figure in drawn.items():
        boxes = text_boxes(figure)
        assert_apart(boxes)
        for text, box in boxes:
            assert box.x0 >= 0, f"{name}: {text!r} leaves the figure"
            assert box.x1 <= figure.bbox.width + 1, f"{name}: {text!r} leaves the figure"


def test_nothing_to_draw_is_refused(profiles: Profiles) -> None:
    for draw in (
        plot_peak_grf, plot_stability_speed, plot_peak_grf_stiffness, plot_stability_stiffness,
    ):  # fmt: skip
        with pytest.raises(InputError):
            draw([])
    for draw_strides in (plot_profiles, plot_energy_shares):
        with pytest.raises(InputError):
            draw_strides({})
    with pytest.raises(InputError):
        plot_energy_shares(profiles, 9.0)


def test_a_study_of_one_gait_is_drawn(gaits: list[Row], sweeps: list[Row]) -> None:
    plot_peak_grf(gaits[:1]).draw_without_rendering()
    plot_stability_speed(gaits[:1]).draw_without_rendering()
    plot_stability_stiffness(sweeps[:1]).draw_without_rendering()


def test_drawing_leaves_the_tables_alone(gaits: list[Row], sweeps: list[Row]) -> None:
    before = copy.deepcopy((gaits, sweeps))
    plot_peak_grf(gaits, PUBLISHED)
    plot_stability_stiffness(sweeps)
    assert (gaits, sweeps) == before
