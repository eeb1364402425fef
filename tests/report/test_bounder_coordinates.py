"""The sketch that tells what the coordinates of a bounder are."""

from __future__ import annotations

import numpy as np
import pytest

from flexspine import load_model, plot_coordinates
from tests.report.layout import assert_no_text_overlaps


def words(figure) -> set[str]:
    return {text.get_text() for text in figure.axes[0].texts if text.get_text()}


def test_a_body_that_bends_has_two_pitches_and_a_spine():
    told = words(plot_coordinates(load_model("kamimura2015-flexible")))
    assert {r"$\theta_f$", r"$\theta_h$", "$a_f$", "$h_h$", "$k_t, c_t$"} <= told


def test_a_rigid_body_has_one_pitch_and_no_spine():
    told = words(plot_coordinates(load_model("kamimura2015-rigid")))
    assert r"$\theta$" in told
    assert not told & {r"$\theta_f$", "$a_f$", "$k_t, c_t$"}


@pytest.mark.parametrize("hind", [0.1, 0.276])
def test_hips_are_as_far_apart_as_on_the_animal(hind):
    model = load_model("kamimura2015-rigid", {"hind.hip_offset": hind})
    axes = plot_coordinates(model).axes[0]
    trunk = [line for line in axes.get_lines() if line.get_linewidth() == 5]
    ends = sorted(np.hypot(*np.diff(line.get_xydata(), axis=0).T).item() for line in trunk)
    np.testing.assert_allclose(ends, [hind, 0.276])


def test_one_foot_stands_and_the_other_is_in_the_air():
    axes = plot_coordinates(load_model("kamimura2015-flexible")).axes[0]
    feet = [line.get_ydata()[-1] for line in axes.get_lines() if len(line.get_xdata()) > 10
            and line.get_linewidth() == 1.8]  # fmt: skip
    assert sorted(np.round(feet, 12)) == [0.0, pytest.approx(max(feet))]
    assert max(feet) > 0.01


@pytest.mark.parametrize("preset", ["kamimura2015-flexible", "kamimura2015-locked", "scout2"])
def test_no_word_hides_another(preset):
    figure = plot_coordinates(load_model(preset))
    assert_no_text_overlaps(figure)
