"""Pictures are made, say their units and simulate nothing. How they look is for eyes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from PIL import Image

from flexspine import Model, animate, load_model, plot_run, simulate, strip, to_dataset
from flexspine.errors import InputError
from tests.report.layout import assert_no_text_overlaps


@pytest.fixture(scope="module")
def data() -> xr.Dataset:
    return to_dataset(simulate(load_model("kamimura2015-flexible"), strides=2))


def test_every_axis_of_the_figure_has_a_unit(preset: Model) -> None:
    figure = plot_run(to_dataset(simulate(preset)))
    labels = [axes.get_ylabel() for axes in figure.axes if axes.get_ylabel()]
    labels += [axes.get_xlabel() for axes in figure.axes if axes.get_xlabel()]
    assert len(labels) >= 5
    for label in labels:
        assert any(unit in label for unit in ("(m)", "(°)", "(N", "(%", "%)", "(s)")), label


def test_the_figure_draws_the_data(data: xr.Dataset) -> None:
    figure = plot_run(data)
    lines = [line for axes in figure.axes for line in axes.get_lines()]

    def drawn(values: np.ndarray) -> bool:
        return any(
            len(line.get_ydata()) == len(values) and np.allclose(line.get_ydata(), values)
            for line in lines
        )

    assert drawn(data.com_y.values)
    assert drawn(np.degrees(data.fore_pitch.values))
    assert drawn(np.degrees(data.hind_pitch.values))


def test_no_text_of_a_figure_runs_over_another(preset: Model) -> None:
    figure = plot_run(to_dataset(simulate(preset, strides=3)))
    assert_no_text_overlaps(figure)


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_an_animation_has_frames_of_one_size(data: xr.Dataset, tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"run{suffix}"
    seen: list[float] = []
    animate(data.isel(time=slice(0, 120)), file, progress=seen.append)
    assert file.stat().st_size > 10_000
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0)
    if suffix == ".gif":
        with Image.open(file) as image:
            assert image.n_frames >= 10


def test_a_strip_is_drawn_for_every_preset(preset: Model, tmp_path: Path) -> None:
    strip(to_dataset(simulate(preset))).savefig(tmp_path / "strip.png")
    with Image.open(tmp_path / "strip.png") as image:
        assert image.size[0] > 600


def test_a_format_that_is_not_known_is_refused(data: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.avi"):
        animate(data, tmp_path / "run.avi")
    assert list(tmp_path.iterdir()) == []


def test_a_run_without_samples_is_refused(data: xr.Dataset, tmp_path: Path) -> None:
    empty = data.isel(time=slice(0, 0))
    for draw in (plot_run, strip, lambda d: animate(d, tmp_path / "run.gif")):
        with pytest.raises(InputError):
            draw(empty)


def test_drawing_leaves_the_data_alone(data: xr.Dataset) -> None:
    before = data.copy(deep=True)
    plot_run(data)
    strip(data)
    xr.testing.assert_identical(data, before)


def test_energy_of_an_actuated_run_adds_up_to_what_it_had_and_was_given(flexible: Model) -> None:
    run = simulate(flexible.with_values({"legs.extension": 0.01, "spine.damping": 1.0}))
    data = to_dataset(run)
    lines = [line for axes in plot_run(data).axes for line in axes.get_lines()]
    (given,) = [line for line in lines if line.get_label() == "start and work"]
    whole = data["total_energy"].values + data["dissipated_energy"].values
    assert np.asarray(given.get_ydata()) == pytest.approx(100 * whole / whole[0], rel=1e-9)
    assert whole[-1] > 1.02 * whole[0]
