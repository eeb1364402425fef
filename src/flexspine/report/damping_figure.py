"""What damping and compliance of the spine cost: gaits that an actuator keeps going.

Draws rows of the damping table as `flexspine.studies.tables` makes it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isfinite, nan
from typing import TYPE_CHECKING, Any, NamedTuple

from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from flexspine.report.branch_axis import axis_of, spread
from flexspine.report.caption import SIDES
from flexspine.report.study_figures import (
    END,
    END_NAME,
    LEG_STIFFNESS,
    LIMIT,
    LIMIT_NAME,
    setting_of,
)
from flexspine.report.study_profiles import GRID, ramp, start_figure
from flexspine.report.style import INK, ORANGE, PURPLE, SKY, YELLOW, themed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import XAxis, YAxis
    from matplotlib.figure import Figure

    Row = Mapping[str, Any]

DAMPING, STIFFNESS, MODEL = "spine.damping", "spine.stiffness", "flexible-bounder"

# Of actuators; none of them is like those of speeds.
COLORS = (ORANGE, PURPLE, SKY)

# Round marks too: of a short stretch there may be one gait only.
STABLE: dict[str, Any] = {
    "color": YELLOW, "linewidth": 9.0, "marker": "o", "markersize": 9.0, "markeredgewidth": 0.0,
    "solid_capstyle": "butt", "zorder": 1.8,
}  # fmt: skip
STABLE_NAME = "highlighted: stable"

# Of dampings, least first.
DASHES: tuple[Any, ...] = ("-", (0, (4, 1.5)), (0, (1, 1)))

FOUR_ROWS = 8.6  # in; of four rows of panels

# Branches that end below this share of the most damping are enlarged, with so much room.
SHORT, ROOM = 0.1, 1.3

# What spans more than this is drawn logarithmically.
WIDE = 5.0

# Of the largest value; less is zero but for rounding.
ROUNDING = 1e-9

# A spectral radius beyond this is off its panel: a gait on the brink has any.
HIGHEST = 10.0


class Line(NamedTuple):
    """The gaits of a branch in order along it, and how they are drawn."""

    rows: list[Row]
    color: Any = INK
    dashes: Any = "-"

    @property
    def over(self) -> str:
        """What the branch is followed in."""
        return str(self.rows[0]["over"])

    @property
    def speed(self) -> float:
        """The mean speed of its gaits."""
        return float(self.rows[0]["speed"])

    @property
    def actuator(self) -> str:
        """What keeps them going."""
        return str(self.rows[0]["actuator"])

    @property
    def damping(self) -> float:
        """The damping of the first of them."""
        return float(self.rows[0]["spine_damping"])

    def of(self, name: str) -> list[float]:
        """A column of its rows."""
        return [float(row[name]) for row in self.rows]


class Measure(NamedTuple):
    """What a row of panels shows of every gait of a line."""

    label: str
    of: Callable[[Line], list[float]]
    limit: float | None = None


def plot_damping(rows: Sequence[Row], *, leg_stiffness: float = LEG_STIFFNESS) -> Figure:
    """Draw cost of transport, actuator, peak GRF and stability over damping and over stiffness.

    From the damping table; ``leg_stiffness`` is that of a pair of legs, for the title.
    """
    with themed():
        parts = [
            *setting_of(rows, leg_stiffness),
            "cost of transport: positive work of the actuator by weight and distance",
            "peak GRF: of fore or hind legs, whichever is larger",
        ]
        lines = _lines(rows)
        actuators, speeds, stiffnesses = _by_actuator(lines), _by_speed(lines), _by_damping(lines)
        key = _key(actuators, speeds, stiffnesses)
        figure = start_figure("What damping and compliance cost", parts, FOUR_ROWS, key)
        columns = [column for column in (actuators, speeds, stiffnesses) if column]
        panels = figure.subplots(4, len(columns), sharex="col", squeeze=False)
        for column, axes in zip(columns, panels.T, strict=True):
            measures = [COST, SHARE if column is actuators else _amplitude(column[0]), PEAK, RADIUS]
            for each, measure in zip(axes, measures, strict=True):
                _draw(each, column, measure)
            axes[0].set_title(_title(column, actuators), loc="left")
            _set_along(axes[-1], column, enlarged=column is speeds)
        for axes in (*panels[0, 1:], *panels[2, 1:], *panels[3, 1:]):
            axes.set_ylabel("")
        figure.align_ylabels(panels[:, 0])
    return figure


def _peaks(line: Line) -> list[float]:
    """NaN for a gait on the brink that could not be run as far as its peak."""
    return [
        max(row[f"peak_grf_{side}"] for side in SIDES) if row["confirmed"] else nan
        for row in line.rows
    ]


def _shares(line: Line) -> list[float]:
    """The actuator's amplitude in percent of its largest."""
    values = line.of("amplitude")
    most = max(map(abs, values)) or 1.0
    return [100 * value / most for value in values]


COST = Measure("cost of transport", lambda line: line.of("cost_of_transport"))
SHARE = Measure("actuator (% of its most)", _shares)
PEAK = Measure("peak GRF (N per leg pair)", _peaks)
RADIUS = Measure("spectral radius", lambda line: line.of("spectral_radius"), limit=1.0)


def _amplitude(line: Line) -> Measure:
    """The amplitude of the actuator in its own unit."""
    axis = axis_of(line.actuator, MODEL)
    return Measure(axis.told, lambda line: [axis.shown(v) for v in line.of("amplitude")])


def _lines(rows: Sequence[Row]) -> list[Line]:
    """Every branch of the table."""
    starts = [at for at, row in enumerate(rows) if row["position"] == 0]
    return [
        Line(list(rows[start:end]))
        for start, end in zip(starts, [*starts[1:], len(rows)], strict=True)
    ]


def _by_actuator(lines: list[Line]) -> list[Line]:
    """Over damping at the fastest speed, a colour an actuator."""
    over = [line for line in lines if line.over == DAMPING]
    fastest = max((line.speed for line in over), default=0.0)
    at_it = [line for line in over if line.speed == fastest]
    return [line._replace(color=COLORS[number % len(COLORS)]) for number, line in enumerate(at_it)]


def _by_speed(lines: list[Line]) -> list[Line]:
    """Over damping with the actuator that all speeds have, a colour a speed."""
    over = [line for line in lines if line.over == DAMPING]
    same = [line for line in over if line.actuator == over[0].actuator]
    colors = dict(zip([line.speed for line in same], ramp(len(same)), strict=True))
    return [line._replace(color=colors[line.speed]) for line in same] if len(same) > 1 else []


def _by_damping(lines: list[Line]) -> list[Line]:
    """Over stiffness, a colour a speed and dashes by damping."""
    over = [line for line in lines if line.over == STIFFNESS]
    speeds = sorted({line.speed for line in lines})
    colors = dict(zip(speeds, ramp(len(speeds)), strict=True))
    dampings = sorted({line.damping for line in over})
    dashes = {value: DASHES[min(at, len(DASHES) - 1)] for at, value in enumerate(dampings)}
    return [line._replace(color=colors[line.speed], dashes=dashes[line.damping]) for line in over]


def _title(column: list[Line], actuators: list[Line]) -> str:
    """What the lines of a column share."""
    line = column[0]
    stiffnesses = {line.rows[0]["spine_stiffness"] for line in column}
    which = f"{line.speed:g} m/s" if column is actuators else axis_of(line.actuator, MODEL).label
    if line.over == DAMPING and len(stiffnesses) == 1:
        which += f", $k_t$ = {stiffnesses.pop():g} N m/rad"
    return which


def _key(
    actuators: list[Line], speeds: list[Line], stiffnesses: list[Line]
) -> dict[str, dict[str, Any]]:
    """What colours, dashes and marks mean."""
    key: dict[str, dict[str, Any]] = {}
    for line in actuators:
        axis = axis_of(line.actuator, MODEL)
        most = axis.shown(max(line.of("amplitude"), key=abs))
        key[f"{axis.label}, at most {most:.3g} {axis.unit}"] = {"color": line.color}
    for line in (*speeds, *stiffnesses):
        key[f"{line.speed:g} m/s"] = {"color": line.color}
    for line in stiffnesses:
        key[f"$c_t$ = {line.damping:g} N m s/rad"] = {"color": INK, "linestyle": line.dashes}
    if any(row["stable"] for line in (*actuators, *speeds, *stiffnesses) for row in line.rows):
        key[STABLE_NAME] = {**STABLE, "marker": None}
    return {**key, LIMIT_NAME: LIMIT, END_NAME: {**END, "markeredgecolor": INK}}


def _draw(axes: Axes, column: list[Line], measure: Measure) -> None:
    axes.set_ylabel(measure.label)
    axes.grid(True, **GRID)
    if measure.limit is not None:
        axes.axhline(measure.limit, **LIMIT)
    drawn: list[float] = []
    for line in column:
        along, values = line.of(f"spine_{line.over.partition('.')[2]}"), measure.of(line)
        axes.plot(along, values, color=line.color, linestyle=line.dashes)
        for at in (0, -1):
            axes.plot([along[at]], [values[at]], **END, markeredgecolor=line.color)
        axes.plot(*_steady(line, along, values), **STABLE)
        drawn += [value for value in values if isfinite(value)]
    if measure is RADIUS and max(drawn) > HIGHEST:
        drawn = [value for value in drawn if value < HIGHEST]
        axes.set_ylim(0.9 * min(drawn, default=1.0), HIGHEST)
    low, high = min(drawn, default=0.0), max(drawn, default=0.0)
    if low > ROUNDING * high and high > WIDE * low:
        axes.set_yscale("log")
        _label(axes.yaxis)
    else:
        axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))


def _steady(line: Line, along: list[float], values: list[float]) -> list[list[float]]:
    """The stable stretches of a curve, NaN between them, up to where the spectral radius is 1."""
    radii, found = line.of("spectral_radius"), [[nan], [nan]]
    for at, row in enumerate(line.rows):
        before = at and line.rows[at - 1]["stable"]
        if at and bool(row["stable"]) != bool(before):
            inner, outer = (at - 1, at) if before else (at, at - 1)
            share = (1 - radii[inner]) / ((radii[outer] - radii[inner]) or nan)
            share = share if 0 < share < 1 else 0.0
            for column, known in zip(found, (along, values), strict=True):
                end = known[inner] + share * (known[outer] - known[inner])
                column += [end, nan] if before else [end]
        if row["stable"]:
            found[0].append(along[at])
            found[1].append(values[at])
    return found


def _label(axis: XAxis | YAxis) -> None:
    """Label a logarithmic axis at 1, 2, 5, 10 and so on."""
    axis.set_major_locator(LogLocator(10, subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _set_along(axes: Axes, column: list[Line], *, enlarged: bool) -> None:
    """Set up the horizontal axis of a column; enlarged, for those that end early."""
    over = column[0].over
    name = f"spine_{over.partition('.')[2]}"
    axes.set_xlabel(axis_of(over, MODEL).told)
    if over == STIFFNESS:
        axes.set_xscale("log")
        _label(axes.xaxis)
        return
    most = [max(line.of(name)) for line in column]
    short = [value for value in most if value < SHORT * max(most)]
    if enlarged and short:
        axes.set_xlim(-0.05 * max(short), ROOM * max(short))
    else:
        spread(axes, [value for line in column for value in line.of(name)])
