"""A run in motion: an animation, or a strip of postures over one cycle."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from math import isfinite
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from flexspine.errors import ParameterError
from flexspine.report.caption import ending, heading
from flexspine.report.film import is_gif, write_film
from flexspine.report.picture import Picture
from flexspine.report.postures import Posture, postures
from flexspine.report.robot_scene import RobotScene
from flexspine.report.sagittal import is_spatial, sagittal
from flexspine.report.scene import Scene, pill, view_of
from flexspine.report.stage import DOTS, View, add_force_key, draw_ground, draw_heights, write
from flexspine.report.stick_figure import Scale, StickFigure, bend_palette
from flexspine.report.style import SMALL_SIZE, TITLE_SIZE, themed
from flexspine.report.timeline import check_samples, drawable, is_robot, last_cycle, stride_times
from flexspine.report.way import Way

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# Twenty-four seconds at the usual rate: enough of any run.
MAX_FRAMES = 600
SLOW_DOWN = 8.0  # of bounders
MAX_RATE = 100  # frames per second; a GIF counts time in hundredths of a second

COLOR_SAMPLES = 10  # frames from which a GIF's 256 colours are taken

MAX_POSTURES = 40
PER_ROW = 5
CELL = 1.9  # in, the width of one posture
LABELS = 0.4  # in, below each row
LETTERS = 125  # of small type; what fits over five postures


class Shown(Protocol):
    """What moves: a figure that is brought to one posture after the other."""

    figure: Figure
    postures: list[Any]

    def __init__(self, dataset: xr.Dataset, times: Array, slow_down: float) -> None: ...

    def show(self, posture: Any) -> None:
        """Bring the figure to a posture."""


def animate(
    dataset: xr.Dataset,
    path: Path | str,
    *others: Path | str,
    fps: int = 25,
    slow_down: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write a run as an animated stick figure, ``slow_down`` times slower than real.

    If it is not given, bounders are slowed down eight times and robots not at all. A run in space
    is shown from the right. The suffix of each path, .gif or .mp4, gives the format; all of them
    come from one drawing. Of a run that needs more than 600 frames the last 600 are shown.
    ``progress`` is told the share that is done, 0 to 1. Raises `InputError`, among them
    `OutputError` for a path that cannot be written to, and `MachineError` where the video encoder
    fails.
    """
    robot = is_robot(dataset)
    dataset = sagittal(dataset) if is_spatial(dataset) else dataset
    check_samples(dataset, robot=robot)
    if slow_down is None:
        slow_down = 1.0 if robot else SLOW_DOWN
    times = frame_times(drawable(dataset), fps, slow_down)
    files = [Path(file) for file in (path, *others)]
    with themed():
        made: type[Shown] = RobotScene if robot else Scene
        scene = made(dataset, times, slow_down)
        scene.figure.set_dpi(DOTS)
        write_film(
            _pictures(scene, scene.postures), files, fps=fps, count=len(times),
            colors=_colors(scene) if any(map(is_gif, files)) else None, progress=progress,
        )  # fmt: skip


def frame_times(dataset: xr.Dataset, fps: int, slow_down: float) -> Array:
    """Return the times (s) of the frames, evenly spaced; the last `MAX_FRAMES` at most.

    Raises `ParameterError` for a rate that cannot be used.
    """
    if not 1 <= fps <= MAX_RATE:
        raise ParameterError(f"fps = {fps} is not usable", f"give 1 to {MAX_RATE} per second")
    if not (isfinite(slow_down) and slow_down > 0):
        raise ParameterError(f"slow_down = {slow_down} is not usable", "give a number above zero")
    start, end = float(dataset["time"].values[0]), float(dataset["time"].values[-1])
    step = 1 / (fps * slow_down)
    # One more than fits: the last frame is the end of the run.
    count = int(min(np.ceil((end - start) / step), MAX_FRAMES - 1)) + 1
    return np.clip(end - step * np.arange(count)[::-1], start, end)


def _pictures(scene: Shown, shown: Iterable[Any]) -> Iterator[NDArray[np.uint8]]:
    """Draw one posture after the other."""
    canvas: Any = FigureCanvasAgg(scene.figure)
    for posture in shown:
        scene.show(posture)
        canvas.draw()
        yield np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3])


def _colors(scene: Shown) -> Image.Image:
    """An image with the palette of some frames and of the bend of the spine."""
    some = scene.postures[:: max(1, len(scene.postures) // COLOR_SAMPLES)]
    kept = bend_palette(32)
    found = Image.fromarray(np.vstack(list(_pictures(scene, some)))).quantize(256 - len(kept))
    taken = np.reshape(found.getpalette() or [255] * 3, (-1, 3))[: 256 - len(kept)]
    palette = np.vstack([taken, kept])
    palette[(palette > 246).all(axis=1)] = 255  # paper stays white
    colors = Image.new("P", (1, 1))
    colors.putpalette(palette.ravel().tolist())
    return colors


def strip(dataset: xr.Dataset, *, frames: int = 9) -> Figure:
    """Draw ``frames`` evenly spaced postures over the last stride from apex to apex, or the run.

    Of a run that ended early they lead up to its end. They stand side by side; the way between them
    is not drawn. Raises `InputError`.
    """
    check_samples(dataset)
    dataset = drawable(dataset)
    if not 1 <= frames <= MAX_POSTURES:
        raise ParameterError(f"frames = {frames} is not usable", f"give 1 to {MAX_POSTURES}")
    shown = postures(dataset, np.linspace(*last_cycle(dataset), frames))
    scale = Scale.of(dataset)
    way = Way.of(dataset)
    view = view_of(shown, scale, way)
    metre = CELL / (2 * view.aside)  # in
    height = (view.high - view.low) * metre
    rows = [shown[i : i + PER_ROW] for i in range(0, frames, PER_ROW)]
    width = max(len(rows[0]), 3) * CELL
    with themed():
        figure = Picture(figsize=(0.75 + width, 1.0 + len(rows) * (height + LABELS)))
        size = figure.get_size_inches()
        for number, row in enumerate(rows):
            foot = size[1] - 0.6 - number * (height + LABELS) - height
            axes = figure.add_axes(
                (0.6 / size[0], foot / size[1], len(row) * CELL / size[0], height / size[1])
            )
            axes.set_xlim(-view.aside, (2 * len(row) - 1) * view.aside)
            _draw_row(axes, row, view, scale, metre, way)
        add_force_key(figure, (0.6, 0.2), scale, metre)
        _write_heading(figure, dataset, shown)
    return figure


def _draw_row(
    axes: Axes, row: list[Posture], view: View, scale: Scale, metre: float, way: Way | None
) -> None:
    """Draw postures side by side, each with its phase and time (s) below."""
    draw_heights(axes, view)
    if way is None:
        draw_ground(axes, axes.get_xlim(), scale)
    axes.set_ylabel("height over the way (m)" if way is not None and way.climbs else "height (m)")
    axes.spines["bottom"].set_visible(False)
    axes.set_xticks([])
    style: dict[str, Any] = {
        "ha": "center", "va": "center", "fontsize": SMALL_SIZE, "annotation_clip": False,
        "xycoords": axes.get_xaxis_transform(), "textcoords": "offset points",
    }  # fmt: skip
    for number, posture in enumerate(row):
        middle = 2 * view.aside * number
        x = posture.com[0]
        shift = middle - x, 0.0 if way is None else -way.level(x)
        if way is not None:
            near = way.between(x - view.aside, x + view.aside).moved(shift)
            draw_ground(axes, (middle - view.aside, middle + view.aside), scale, near)
        StickFigure(axes, scale, 72 * metre, posture).show(posture, shift)
        box = pill(posture.phase)
        axes.annotate(posture.phase, (middle, 0), (-20, -8), bbox=box, fontweight="bold", **style)
        axes.annotate(f"{posture.time:.3f} s", (middle, 0), (14, -8), **style)


def _write_heading(figure: Figure, dataset: xr.Dataset, shown: list[Posture]) -> None:
    width, height = figure.get_size_inches()
    under = [line for line in (_stretch(dataset), ending(dataset)) if line]
    write(figure, (0.12, height - 0.2), heading(dataset), size=TITLE_SIZE, fontweight="bold")
    write(figure, (0.12, height - 0.4), shorten("  ·  ".join(under), LETTERS))
    if len(shown) == 1:
        return
    moved = shown[-1].com[0] - shown[0].com[0]
    lasted = shown[-1].time - shown[0].time
    told = f"side by side; from first to last {moved:.3g} m in {lasted:.3g} s"
    write(figure, (width - 0.15, 0.2), told, ha="right")


def _stretch(dataset: xr.Dataset) -> str | None:
    """Which part of what the postures are, or None for all of it."""
    early, strides = ending(dataset), len(stride_times(dataset)) - 1
    if strides < 1 or (strides == 1 and not early):
        return None
    whole = f"{strides} stride{'s' * (strides != 1)}{' and the end' if early else ''}"
    return f"the last {'stretch ' if early else ''}of {dataset.attrs.get('shown', whole)}"
