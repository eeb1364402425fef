"""When things happen in a run: its phases, apexes and cycles, and the bar that shows the phases."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flexspine.errors import InputError
from flexspine.models.legs import SIDES
from flexspine.report.style import INK, PHASE_COLORS, SMALL_SIZE

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

PHASE_NAMES = {
    "DF": "both legs in flight",
    "FS": "fore stance",
    "HS": "hind stance",
    "DS": "both legs in stance",
}

APEX_TOLERANCE = 1e-9  # m/s; a run started at an apex has exactly zero vertical speed


class Span(NamedTuple):
    """A stretch of time (s) in one phase; ``first`` and ``last`` are its samples."""

    start: float
    end: float
    phase: str
    first: int
    last: int


NEEDED = ("com_x", "com_y", "phase", "event_time")
NEEDED_OF_ROBOTS = ("com", "foot", "stands", "grf", "link_start", "footing", "event_time")


def is_robot(dataset: xr.Dataset) -> bool:
    """Tell a run of an articulated robot from one of a bounder."""
    return "link" in dataset.dims


def check_samples(dataset: xr.Dataset, *, robot: bool = False) -> None:
    """Raise `InputError` for a dataset from which no bounder, or robot, can be drawn."""
    if dataset.sizes.get("time", 0) == 0:
        message = dataset.attrs.get("message")
        raise InputError(
            f"the run has no samples{f' ({message})' if message else ''}",
            "look at its outcome and change the start or the options",
        )
    for name in NEEDED_OF_ROBOTS if robot else NEEDED:
        if name not in dataset:
            maker = "robot_dataset" if robot else "to_dataset"
            remedy = f"give one made by {maker}"
            if not robot and is_robot(dataset):
                remedy = "draw a robot's run by plot_robot or animate"
            raise InputError(f"the dataset has no '{name}'", remedy)


def drawable(dataset: xr.Dataset) -> xr.Dataset:
    """Return a run without the last sample if that has left all bounds."""
    if dataset.attrs.get("outcome") == "diverged" and dataset.sizes["time"] > 1:
        return dataset.isel(time=slice(None, -1))
    return dataset


def phase_spans(dataset: xr.Dataset, name: str = "phase") -> list[Span]:
    """Return the phases in order; they meet at the times of the events between the samples.

    ``name`` is what tells them.
    """
    time = dataset["time"].values
    phase = dataset[name].values.astype(str)
    met = np.sort(dataset["event_time"].values)
    firsts = [0, *(np.flatnonzero(phase[1:] != phase[:-1]) + 1)]
    starts = [float(time[0])]
    for first in firsts[1:]:
        # A sample at the very instant of an event belongs to what follows.
        between = met[(met > time[first - 1]) & (met <= time[first])]
        starts.append(float(between[0] if len(between) else time[first]))
    return [
        Span(start, end, str(phase[first]), int(first), int(following) - 1)
        for start, end, first, following in zip(
            starts, [*starts[1:], float(time[-1])], firsts, [*firsts[1:], len(time)], strict=True
        )
    ]


def events(dataset: xr.Dataset) -> tuple[NDArray[np.float64], NDArray[np.str_]]:
    """Return the times (s) and kinds of the events between the first and the last sample."""
    time, times = dataset["time"].values, dataset["event_time"].values
    inside = (times >= time[0]) & (times <= time[-1])
    return times[inside], dataset["event_kind"].values.astype(str)[inside]


def apex_times(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Return the times (s) of the apexes, the start included if the run began at one."""
    time = dataset["time"].values
    times, kinds = events(dataset)
    times = times[np.array(["apex" in kind for kind in kinds], dtype=bool)]
    climbing = float(dataset["com_y_rate"].values[0])
    if str(dataset["phase"].values[0]) == "DF" and abs(climbing) < APEX_TOLERANCE:
        times = np.append(time[0], times)
    return np.unique(times)


def stride_times(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Return the times (s) of the apexes at which strides begin and end.

    Between two of them both legs have left the ground: a run that is steered has further apexes.
    """
    times, kinds = events(dataset)
    found: list[float] = []
    left: set[str] = set()
    for time, kind in zip(times.tolist(), kinds.tolist(), strict=True):
        left |= {side for side in SIDES if f"{side} lift-off" in kind}
        if "apex" in kind and len(left) == len(SIDES):
            found.append(time)
            left = set()
    first = apex_times(dataset)[:1]
    at_start = first[first == dataset["time"].values[0]]
    return np.unique(np.append(at_start, found))


def last_cycle(dataset: xr.Dataset) -> tuple[float, float]:
    """Return start and end (s) of the last stride from apex to apex, without one those of the run.

    Of a run that ended early: of its last stretch up to the end, as long as a stride.
    """
    time = dataset["time"].values
    first, last = float(time[0]), float(time[-1])
    strides = stride_times(dataset)
    if len(strides) < 2:
        return first, last
    start, end = strides[-2:].tolist()
    if dataset.attrs.get("outcome", "completed") == "completed":
        return start, end
    return max(first, last - (end - start)), last


def window(time: NDArray[np.float64]) -> tuple[float, float]:
    """Return the limits (s) of a time axis, apart even for a single sample."""
    return float(time[0]), max(float(time[-1]), float(time[0]) + 1e-6)


def draw_phase_bar(axes: Axes, spans: list[Span], limits: tuple[float, float]) -> None:
    """Fill the axes with a bar of the phases over ``limits`` (s)."""
    for phase, color in PHASE_COLORS.items():
        pieces = [(s.start, s.end - s.start) for s in spans if s.phase == phase]
        axes.broken_barh(pieces, (0, 1), facecolors=color, edgecolors="white", linewidth=0.4)
    axes.set_xlim(*limits)
    axes.set_ylim(0, 1)
    axes.set_yticks([])
    axes.spines[:].set_visible(False)


def label_phases(axes: Axes, spans: list[Span], width: float) -> None:
    """Write the names into a bar that is ``width`` inches wide, where they fit."""
    left, right = axes.get_xlim()
    room = 1.6 * SMALL_SIZE / 72  # in; two letters
    for span in spans:
        start, end = max(span.start, left), min(span.end, right)
        if (end - start) / (right - left) * width > room:
            axes.text(
                (start + end) / 2, 0.48, span.phase,
                ha="center", va="center", fontsize=SMALL_SIZE, color=INK,
            )  # fmt: skip
