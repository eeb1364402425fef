"""The figure of what damping and compliance cost draws the table it is given."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

from flexspine.errors import InputError
from flexspine.report.damping_figure import HIGHEST, plot_damping
from flexspine.report.style import YELLOW
from tests.report.layout import assert_no_text_overlaps

Row = dict[str, Any]

EXTENSION, STIFFENING, LEVER = "legs.extension", "legs.stiffening", "legs.hip_lever"


def gait(over: str, speed: float, actuator: str, position: int, **more: float) -> Row:
    return {
        "over": over, "speed": speed, "actuator": actuator, "position": position,
        "spine_stiffness": 260.0, "spine_damping": 0.1, "amplitude": 0.001,
        "cost_of_transport": 0.01, "energy": 290.0, "apex_height": 0.32, "confirmed": True,
        "peak_grf_fore": 530.0, "peak_grf_hind": 540.0, "spectral_radius": 1.2, "stable": False,
        **more,
    }  # fmt: skip


def over_damping(speed: float, actuator: str, values: list[float], most: float) -> list[Row]:
    return [
        gait(
            "spine.damping", speed, actuator, number, spine_damping=value,
            cost_of_transport=0.02 * value / (1 + value**2), amplitude=most * (number > 0),
        )
        for number, value in enumerate(values)
    ]  # fmt: skip


@pytest.fixture
def rows() -> list[Row]:
    """Three actuators at 4.5 m/s, one at 4 m/s that ends early, and two branches over stiffness."""
    wide = [0.0, 0.1, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0]
    found = over_damping(4.0, EXTENSION, [0.0, 0.1, 0.2], 0.009)
    for actuator, most in ((EXTENSION, 0.005), (STIFFENING, 0.12), (LEVER, 0.0086)):
        found += over_damping(4.5, actuator, wide, most)
    for speed, damping in ((4.0, 0.1), (4.5, 0.1), (4.5, 1.0)):
        found += [
            gait(
                "spine.stiffness", speed, EXTENSION, number, spine_damping=damping,
                spine_stiffness=stiffness, spectral_radius=radius, stable=radius < 1,
            )
            for number, (stiffness, radius) in enumerate([(100, 50.0), (160, 0.9), (500, 2.0)])
        ]  # fmt: skip
    return found


@pytest.fixture
def figure(rows: list[Row]) -> Figure:
    return plot_damping(rows)


def titled(figure: Figure) -> list[str]:
    return [axes.get_title("left") for axes in figure.axes if axes.get_title("left")]


def test_each_column_is_over_one_quantity(figure: Figure) -> None:
    assert len(figure.axes) == 12
    assert titled(figure) == [
        "4.5 m/s, $k_t$ = 260 N m/rad", "leg extension, $k_t$ = 260 N m/rad", "leg extension",
    ]  # fmt: skip
    along = [axes.get_xlabel() for axes in figure.axes if axes.get_xlabel()]
    assert along == ["spine damping $c_t$ (N m s/rad)"] * 2 + ["spine stiffness $k_t$ (N m/rad)"]


def test_the_curves_are_the_columns_of_the_table(figure: Figure, rows: list[Row]) -> None:
    costs = figure.axes[0].lines
    drawn = [line for line in costs if len(line.get_xdata()) > 1]
    assert len(drawn) == 3
    expected = [r for r in rows if (r["speed"], r["actuator"]) == (4.5, STIFFENING)]
    assert list(drawn[1].get_xdata()) == [row["spine_damping"] for row in expected]
    assert list(drawn[1].get_ydata()) == [row["cost_of_transport"] for row in expected]
    forces = [line for line in figure.axes[6].lines if len(line.get_xdata()) > 1]
    assert set(forces[0].get_ydata()) == {540.0}, "the larger of both"
    in_mm = [line for line in figure.axes[4].lines if len(line.get_xdata()) > 1]
    assert max(in_mm[0].get_ydata()) == pytest.approx(9.0)


def test_damping_is_drawn_over_decades_and_where_branches_end_early_enlarged(
    figure: Figure,
) -> None:
    whole, enlarged = figure.axes[9], figure.axes[10]
    assert whole.get_xscale() == "asinh"
    assert whole.get_xlim()[1] > 999
    assert 0.2 < enlarged.get_xlim()[1] < 0.5


def test_gaits_on_the_brink_leave_the_panel_of_stability(figure: Figure) -> None:
    assert figure.axes[11].get_ylim()[1] == HIGHEST
    assert figure.axes[11].get_ylim()[0] < 0.9


def test_a_single_stable_gait_is_highlighted_in_every_panel(figure: Figure) -> None:
    """At 160 N m/rad; the radius is 1 at 100 + 60 * 49 / 49.1 and 160 + 340 * 0.1 / 1.1 N m/rad."""
    for axes in figure.axes:
        stable = [
            line
            for line in axes.lines
            if to_hex(line.get_color()) == YELLOW.lower() and len(line.get_xdata()) > 1
        ]
        assert len(stable) == (3 if axes in figure.axes[2::3] else 0)
        for line in stable:
            found = np.array(line.get_xdata(), dtype=float)
            assert found[np.isfinite(found)] == pytest.approx([159.877801, 160.0, 190.909091])


def test_colours_of_actuators_and_of_speeds_are_far_apart(figure: Figure) -> None:
    actuators, speeds = (
        [to_rgb(line.get_color()) for line in axes.lines if len(line.get_xdata()) > 1]
        for axes in figure.axes[:2]
    )
    assert (len(actuators), len(speeds)) == (3, 2)
    for one, other in product(actuators, speeds):
        assert np.hypot.reduce(np.subtract(one, other)) > 0.3


def test_the_key_says_what_actuators_come_to_at_most(figure: Figure) -> None:
    key = [text.get_text() for text in figure.legends[0].get_texts()]
    for told in (
        "leg extension, at most 5 mm", "leg stiffening, at most 12 %", "hip lever, at most 8.6 mm",
        "4 m/s", "4.5 m/s", "$c_t$ = 0.1 N m s/rad", "$c_t$ = 1 N m s/rad", "highlighted: stable",
    ):  # fmt: skip
        assert told in key
    assert_no_text_overlaps(figure)


def test_one_speed_without_sweeps_fills_one_column(rows: list[Row]) -> None:
    alone = [r for r in rows if r["speed"] == 4.5 and r["over"] == "spine.damping"]
    assert titled(plot_damping(alone)) == ["4.5 m/s, $k_t$ = 260 N m/rad"]


def test_an_empty_table_is_refused() -> None:
    with pytest.raises(InputError, match="no rows"):
        plot_damping([])
