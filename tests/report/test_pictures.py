"""Pictures are made, say their units and simulate nothing. How they look is for eyes."""

from __future__ import annotations

import errno
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image, ImageSequence

from flexspine import (
    Model,
    Terrain,
    animate,
    examine,
    load_model,
    plot_run,
    simulate,
    stabilize,
    strip,
    to_dataset,
)
from flexspine.control.excerpt import excerpt
from flexspine.errors import InputError, MachineError
from flexspine.report.caption import describe
from flexspine.report.film import write_film
from flexspine.report.stage import draw_ground
from flexspine.report.stick_figure import Scale
from flexspine.report.way import Way
from flexspine.studies.wayfaring import walk_over
from tests.report.layout import assert_no_text_overlaps

Make = Callable[[xr.Dataset, Path], None]


@pytest.fixture(scope="module")
def data() -> xr.Dataset:
    return to_dataset(simulate(load_model("kamimura2015-flexible"), strides=2))


@cache
def figure_of(preset: str) -> Figure:
    return plot_run(to_dataset(simulate(load_model(preset), strides=3)))


def test_every_axis_of_the_figure_has_a_unit(preset: Model) -> None:
    figure = figure_of(preset.name)
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
    assert_no_text_overlaps(figure_of(preset.name))


def frames_of(video: Path, width: int, height: int) -> np.ndarray:
    read = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(video)]
    raw = [*read, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(raw, capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3)


def test_animations_have_the_frames_of_one_drawing(data: xr.Dataset, tmp_path: Path) -> None:
    gif, video = tmp_path / "run.gif", tmp_path / "run.mp4"
    seen: list[float] = []
    animate(data.isel(time=slice(0, 60)), gif, video, progress=seen.append)
    assert seen == sorted(set(seen))
    assert seen[-1] == pytest.approx(1.0)
    with Image.open(gif) as image:
        assert image.n_frames == len(seen) >= 10
        assert image.info["duration"] == 40
        frames = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(image)]
        filmed = frames_of(video, *image.size)
    assert len(filmed) == len(frames)
    for left, right in zip(filmed, frames, strict=True):
        assert np.abs(left.astype(float) - right).mean() < 3  # of 255
    assert imageio_ffmpeg.count_frames_and_secs(str(video))[1] == pytest.approx(len(seen) / 25)


def test_pictures_of_odd_sizes_become_a_film(tmp_path: Path) -> None:
    write_film([np.zeros((9, 15, 3), np.uint8)] * 2, [tmp_path / "run.mp4"], fps=25, count=2)
    assert frames_of(tmp_path / "run.mp4", 14, 8).shape == (2, 8, 14, 3)


def test_what_the_encoder_says_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    encoder = tmp_path / "encoder"
    encoder.write_text("#!/bin/sh\necho no such codec >&2\nexit 1\n")
    encoder.chmod(0o755)
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(encoder))
    pictures = [np.zeros((480, 640, 3), np.uint8)] * 4
    for count in (1, 4):  # it may end before all pictures are with it
        with pytest.raises(MachineError, match="no such codec"):
            write_film(pictures[:count], [tmp_path / "run.mp4"], fps=25, count=count)
    assert list(tmp_path.iterdir()) == [encoder]


def test_a_strip_is_drawn_for_every_preset(preset: Model, tmp_path: Path) -> None:
    strip(to_dataset(simulate(preset))).savefig(tmp_path / "strip.png")
    with Image.open(tmp_path / "strip.png") as image:
        assert image.size[0] > 600


def _film(_data: xr.Dataset, path: Path) -> None:
    write_film([np.zeros((8, 8, 3), np.uint8)], [path], fps=25, count=1)


@pytest.mark.parametrize("make", [animate, _film])
def test_without_ffmpeg_it_is_said_how_to_get_one(
    data: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: Make
) -> None:
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "none"))
    with pytest.raises(MachineError, match="no ffmpeg") as refused:
        make(data, tmp_path / "run.mp4")
    assert "--no-animation" in refused.value.remedy
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("make", [animate, _film])
def test_a_full_disk_is_no_fault_of_the_place(
    data: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: Make
) -> None:
    def full(*_arguments: object, **_options: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", full)
    with pytest.raises(OSError, match="No space left"):
        make(data.isel(time=slice(0, 30)), tmp_path / "run.gif")
    assert list(tmp_path.iterdir()) == []


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


@pytest.fixture(scope="module")
def rough() -> xr.Dataset:
    """Steered over rough ground, until energy has risen by half."""
    gait = examine(load_model("kamimura2015-flexible"))
    inputs = ("touchdown.fore", "touchdown.hind", "legs.extension")
    feedback = stabilize(gait, inputs, twice=True)
    terrain = Terrain("rough", {"height": 0.03, "spacing": 0.4})
    return to_dataset(
        excerpt(
            walk_over(gait.model, feedback, terrain, stride=gait.stride_length, strides=5, seed=8),
            most=4,
        )
    )


@pytest.fixture(scope="module")
def drawn(rough: xr.Dataset) -> Figure:
    return plot_run(rough)


def test_the_ground_is_drawn_below_the_com(rough: xr.Dataset, drawn: Figure) -> None:
    height = drawn.axes[1]
    com, ground = (np.asarray(line.get_ydata()) for line in height.lines[:2])
    assert np.all(ground < com)
    told = [text.get_text() for text in height.get_legend().get_texts()]
    (raised,) = [float(text.split()[-2]) for text in told if "raised by" in text]
    x = rough["com_x"].values
    assert ground - raised == pytest.approx(
        np.interp(x, rough["ground_x"].values, rough["ground_y"].values)
    )


def test_the_key_fits_and_all_energy_is_on_the_scale(rough: xr.Dataset, drawn: Figure) -> None:
    crowded = rough.assign(event_kind=rough["event_kind"].copy())
    kinds = crowded["event_kind"].values.astype("U60")
    kinds[np.array(["compression" in kind for kind in kinds])] = "an event with a name of its own"
    for figure in (drawn, plot_run(crowded.assign(event_kind=("event", kinds)))):
        (key,) = figure.legends
        assert key.get_window_extent().x1 <= figure.bbox.x1
        told = " ".join(text.get_text() for text in key.get_texts())
        assert "DS: both legs in stance" in told
        energy = next(axes for axes in figure.axes if "energy" in axes.get_ylabel())
        assert energy.get_ylim()[1] > 140
        assert max(energy.get_yticks()) >= 0.95 * energy.get_ylim()[1]
    assert "fore greatest compression" not in told


def test_an_excerpt_says_what_it_shows(rough: xr.Dataset, drawn: Figure) -> None:
    for figure in (drawn, strip(rough)):
        assert "the first 4 of 5 strides" in " ".join(text.get_text() for text in figure.texts)


def test_hatching_of_the_ground_stays_on_it(rough: xr.Dataset) -> None:
    """In the axes, where none moves the clip, and between the ends of the ground."""
    axes = Figure().subplots()
    axes.set_xlim(1.0, 2.0)
    draw_ground(axes, (0.5, 2.5), Scale.of(rough), Way.of(rough))
    (strokes,) = axes.collections
    ends = np.vstack(strokes.get_segments())[:, 0]
    assert (ends.min(), ends.max()) == pytest.approx((0.5, 2.5), abs=0.1)
    assert 0.5 <= ends.min() < ends.max() <= 2.5
    assert strokes.get_clip_on()
    assert strokes.get_clip_path() is None
    assert strokes.get_clip_box() is not None


def test_actuators_that_work_are_named(flexible: Model) -> None:
    given = {"legs.extension": 0.00217, "hind.leg.stiffening": 0.05, "spine.damping": 1.0}
    data = to_dataset(simulate(flexible.with_values(given)))
    told = "  ·  ".join(describe(data))
    assert "leg extension 2.17 mm" in told
    assert "leg stiffening 0 (fore), 5 (hind) %" in told
    assert "hip lever" not in told
    assert "extension" not in " ".join(describe(to_dataset(simulate(flexible))))


def test_energy_of_an_excerpt_counts_from_its_first_instant(rough: xr.Dataset) -> None:
    late = rough.sel(time=slice(0.8, None))
    lines = [line for axes in plot_run(late).axes for line in axes.get_lines()]
    (given,) = [line for line in lines if line.get_label() == "start and work"]
    total = late["total_energy"].values
    assert np.asarray(given.get_ydata()) == pytest.approx(100 * total / total[0], rel=1e-9)
    assert total[-1] > 1.2 * total[0]
