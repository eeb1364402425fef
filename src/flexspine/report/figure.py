"""A run over time: height, pitch, forces, energies and phases in one figure."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, MultipleLocator

from flexspine.report.caption import SIDES, describe, ending, excerpt_of, heading
from flexspine.report.picture import Picture
from flexspine.report.style import (
    ENERGY_COLORS,
    FAINT,
    INK,
    LINE,
    PHASE_COLORS,
    SIDE_COLORS,
    SMALL_SIZE,
    add_legend,
    add_title,
    lay_out,
    themed,
    widen,
)
from flexspine.report.timeline import (
    PHASE_NAMES,
    Span,
    check_samples,
    draw_phase_bar,
    events,
    label_phases,
    phase_spans,
    window,
)
from flexspine.report.way import Way

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# %; from there on ticks at every 25 % would run together.
MOST_TICKED = 130

# More lines than this would hide the curves: only apexes are drawn, then none.
MAX_EVENT_LINES = 80

# m; heights to which the ground is raised, and what is left free over it.
AIR = 0.01

MANY_PHASES = 120  # from here on thick lines would run together


def plot_run(dataset: xr.Dataset) -> Figure:
    """Draw a run: CoM height, pitch, ground reaction forces, energy shares and phases.

    Raises `InputError` for a dataset without samples.
    """
    check_samples(dataset)
    spans = phase_spans(dataset)
    with themed({"lines.linewidth": 1.5 if len(spans) <= MANY_PHASES else 0.7}):
        time = dataset["time"].values
        details = excerpt_of(dataset) + describe(dataset)
        title = 0.38 + LINE * len(details)
        width = float(np.clip(7.4 + 0.1 * (len(spans) - 20), 7.4, 12.0))
        figure = Picture(figsize=(width, 8.2 + title), layout="constrained")
        bar, *panels = figure.subplots(
            6, 1, sharex=True, height_ratios=[0.24, 1, 1, 1.2, 1.15, 0.95]
        )
        draw_phase_bar(bar, spans, window(time))
        bar.tick_params(bottom=False)
        height, pitch, forces, energy, elastic = panels
        _draw_height(height, dataset)
        _draw_pitch(pitch, dataset)
        _draw_forces(forces, dataset)
        _draw_energy(energy, elastic, dataset)
        _draw_events(panels, dataset)
        elastic.set_xlabel("time (s)")
        figure.align_ylabels(panels)
        early = ending(dataset)
        add_title(figure, heading(dataset), details, wrap(early, 100) if early else ())
        _add_key(figure, dataset, spans)
        label_phases(bar, spans, bar.get_position().width * width)
    return figure


def _draw_height(axes: Axes, dataset: xr.Dataset) -> None:
    axes.plot(dataset["time"], dataset["com_y"], color=INK, label="CoM")
    axes.set_ylabel("CoM height (m)")
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10], min_n_ticks=3))
    way = Way.of(dataset)
    if way is not None:
        _draw_ground(axes, dataset, way)
    widen(axes, 0.01)


def _draw_ground(axes: Axes, dataset: xr.Dataset, way: Way) -> None:
    """Draw the ground under the CoM, raised so that both fit to one scale."""
    time, under = dataset["time"].values, way.height(dataset["com_x"].values)
    least = float((dataset["com_y"].values - under).min())
    raised = max(np.floor((least - AIR) / AIR) * AIR, 0.0)
    name = f"ground below,\nraised by {raised:.2f} m" if raised else "ground below"
    axes.plot(time, under + raised, color=FAINT, linewidth=1.0, label=name)
    low, high = axes.get_ylim()
    axes.fill_between(time, low - 1, under + raised, color=FAINT, alpha=0.25, linewidth=0)
    axes.set_ylim(low, high)
    add_legend(axes)


def _draw_pitch(axes: Axes, dataset: xr.Dataset) -> None:
    time = dataset["time"].values
    if "pitch" in dataset:
        axes.plot(time, np.degrees(dataset["pitch"]), color=INK, label="body")
    else:
        fore, hind = (np.degrees(dataset[f"{side}_pitch"].values) for side in SIDES)
        for side, values in zip(SIDES, (fore, hind), strict=True):
            axes.plot(time, values, color=SIDE_COLORS[side], label=f"{side} segment")
        axes.fill_between(
            time, hind, fore, color=ENERGY_COLORS["spine"], alpha=0.22, linewidth=0,
            label="bend of spine",
        )  # fmt: skip
    axes.set_ylabel("pitch (°)\nnose up positive")
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10], min_n_ticks=3))
    widen(axes, 2.0)
    add_legend(axes)


def _draw_forces(axes: Axes, dataset: xr.Dataset) -> None:
    # Dashes let the fore legs show where both carry the same.
    for side, style in zip(SIDES, ("-", (0, (4, 1.5))), strict=True):
        force = dataset[f"{side}_grf"].values
        loaded = np.convolve(force > 0, np.ones(3))[1:-1] > 0
        axes.plot(
            dataset["time"], np.where(loaded, force, np.nan), color=SIDE_COLORS[side],
            linestyle=style, label=f"{side} legs",
        )  # fmt: skip
    axes.set_ylabel("GRF magnitude\n(N per leg pair)")
    top = max(float(dataset[f"{side}_grf"].max()) for side in SIDES)
    axes.set_ylim(0, 1.06 * top or 1.0)
    add_legend(axes)


def _draw_energy(axes: Axes, elastic: Axes, dataset: xr.Dataset) -> None:
    """Stack all shares, spine and legs lowest; below it these alone, each from zero."""
    time = dataset["time"].values
    names = ["spine", "legs", "gravity", "kinetic", "dissipated"]
    shares = _shares(dataset)
    shown = [name for name in names if name in shares]
    axes.stackplot(
        time, [shares[name] for name in shown], labels=shown, linewidth=0,
        colors=[ENERGY_COLORS[name] for name in shown],
    )  # fmt: skip
    given = _given(dataset)
    if given is not None:
        axes.plot(time, given, color=INK, linewidth=1.0, label="start and work")
    top = 100 if given is None else max(100.0, float(given.max()) + 2)
    axes.set_ylim(0, top)
    axes.yaxis.set_major_locator(MultipleLocator(25 * np.ceil(top / MOST_TICKED)))
    axes.set_ylabel("energy (% of\ninitial total)")
    add_legend(axes, *_reversed(axes))
    for name in ("legs", "spine", "dissipated"):
        if name in shares:
            color = ENERGY_COLORS[name]
            style = "--" if name == "dissipated" else "-"
            elastic.plot(time, shares[name], color=color, linestyle=style, label=name)
            if name != "dissipated":
                elastic.fill_between(time, shares[name], color=color, alpha=0.25, linewidth=0)
    elastic.set_ylim(bottom=0)
    elastic.yaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 2.5, 5, 10], min_n_ticks=3))
    elastic.set_ylabel("enlarged, not\nstacked (%)")
    add_legend(elastic)


def _given(dataset: xr.Dataset) -> Array | None:
    """What there was at first and what actuators have put in since, in % of the former."""
    works = [dataset[str(name)].values for name in dataset if str(name).endswith("_work")]
    if not works:
        return None
    total = float(dataset["total_energy"][0])
    given: Array = 100 * (1 + sum(work - work[0] for work in works) / total)
    return given


def _shares(dataset: xr.Dataset) -> dict[str, Array]:
    """The energies in % of the first total; those that the model lacks are left out.

    What is dissipated counts from the first sample on.
    """
    columns = {
        "spine": "spine_energy",
        "legs": "leg_energy",
        "gravity": "gravity_energy",
        "kinetic": "kinetic_energy",
        "dissipated": "dissipated_energy",
    }
    energies = {name: dataset[column].values for name, column in columns.items()}
    energies["dissipated"] = energies["dissipated"] - energies["dissipated"][0]
    total = sum(float(energy[0]) for energy in energies.values())
    return {
        name: 100 * energy / total
        for name, energy in energies.items()
        if name in ("legs", "gravity", "kinetic") or np.any(energy > 1e-9 * total)
    }


def _event_lines(dataset: xr.Dataset) -> list[tuple[Any, str, Array]]:
    """Line style, name and times (s) of the events, without those too many to be told apart."""
    times, kinds = events(dataset)
    apex = np.array(["apex" in kind for kind in kinds], dtype=bool)
    contact = np.array(["touchdown" in k or "lift-off" in k for k in kinds], dtype=bool) & ~apex
    rest = ~apex & ~contact
    others = _without_sides({name for kind in kinds[rest] for name in str(kind).split(" + ")})
    lines = [("--", "apex", times[apex]), (":", ", ".join(others), times[rest])]
    if len(times) <= MAX_EVENT_LINES:
        lines.insert(0, ("-", "touchdown, lift-off", times[contact]))
    return [line for line in lines if 0 < len(line[2]) <= MAX_EVENT_LINES]


def _without_sides(names: set[str]) -> list[str]:
    """Events that both fore and hind legs have once, without the side."""
    fore, hind = SIDES
    return sorted(
        {
            plain if {f"{fore} {plain}", f"{hind} {plain}"} <= names else name
            for name in names
            for plain in [name.removeprefix(f"{fore} ").removeprefix(f"{hind} ")]
        }
    )


def _draw_events(panels: list[Axes], dataset: xr.Dataset) -> None:
    # Unclipped, since many a run ends with an event.
    look: dict[str, Any] = {"color": FAINT, "linewidth": 0.6, "zorder": 1.5, "clip_on": False}
    for axes in panels:
        for style, _, times in _event_lines(dataset):
            for time in times:
                axes.axvline(time, linestyle=style, **look)


def _add_key(figure: Figure, dataset: xr.Dataset, spans: list[Span]) -> None:
    """Say at the foot what phase colours mean, and below it the vertical lines."""
    seen = {span.phase for span in spans}
    phases = [
        Patch(facecolor=PHASE_COLORS[phase], label=f"{phase}: {name}")
        for phase, name in PHASE_NAMES.items()
        if phase in seen
    ]
    lines = [
        Line2D([], [], color=INK, linestyle=style, linewidth=0.7, label=name)
        for style, name, _ in _event_lines(dataset)
    ]
    for columns in range(max(len(phases), len(lines)), 0, -1):
        # A legend fills its columns first.
        rows = _rows(phases, columns) + _rows(lines, columns)
        legend = figure.legend(
            handles=[handle for column in zip(*rows, strict=True) for handle in column],
            loc="outside lower left", ncols=columns, fontsize=SMALL_SIZE, columnspacing=1.6,
            handlelength=1.5,
        )  # fmt: skip
        lay_out(figure)
        if legend.get_window_extent().x1 <= figure.bbox.x1:
            return
        legend.remove()


def _rows(entries: Sequence[Artist], columns: int) -> list[list[Artist]]:
    """Entries of a legend in rows, the last one filled up."""
    blank = Line2D([], [], linestyle="none", label=" ")
    rows = [[*entries[at : at + columns]] for at in range(0, len(entries), columns)]
    return [row + [blank] * (columns - len(row)) for row in rows]


def _reversed(axes: Axes) -> tuple[list[Any], list[str]]:
    """Legend entries in the order in which the areas lie on each other."""
    handles, labels = axes.get_legend_handles_labels()
    return handles[::-1], labels[::-1]
