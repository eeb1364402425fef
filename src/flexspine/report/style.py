"""How the pictures look: colours that colour-blind readers can tell apart, and type sizes.

Colours are those of Okabe & Ito (2008), "Color Universal Design". Fore and hind keep theirs in
every picture.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
BLUE = "#0072B2"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
YELLOW = "#F0E442"

INK = "#1A1A1A"
FAINT = "#9A9A9A"

SIDE_COLORS = {"fore": BLUE, "hind": VERMILION}

# Tints of the leg that stands, so that a phase is told by the colour of its legs.
PHASE_COLORS = {"DF": "#E3E3E3", "FS": "#94C3E3", "HS": "#F3B48A", "DS": "#DDA9C6"}

ENERGY_COLORS = {
    "spine": GREEN,
    "legs": ORANGE,
    "gravity": "#B5B5B5",
    "kinetic": SKY,
    "dissipated": "#4D4D4D",
}

# Arched, straight, sagging: one end is warm and light, the other cold and dark.
BEND_COLORS = (ORANGE, "#F4F4F4", "#5E3C99")

# Shape and colour of what happens on a branch, by its place in a list of kinds.
MARKS = (
    ("D", ORANGE),
    ("P", GREEN),
    ("s", SKY),
    ("o", PURPLE),
    ("^", YELLOW),
    ("v", "#B5B5B5"),
    ("X", INK),
    ("p", ORANGE),
    ("h", GREEN),
    (">", SKY),
    ("<", PURPLE),
)

TEXT_SIZE = 9.0  # pt
SMALL_SIZE = 8.0  # pt
TITLE_SIZE = 11.0  # pt

LINE = 0.175  # in; from one line of a title to the next

_SETTINGS: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": TEXT_SIZE,
    "axes.labelsize": TEXT_SIZE,
    "axes.titlesize": TEXT_SIZE,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "figure.facecolor": "white",
    "figure.dpi": 100,
    "legend.fontsize": SMALL_SIZE,
    "legend.frameon": False,
    "lines.linewidth": 1.5,
    "savefig.bbox": None,
    "savefig.dpi": "figure",
    "savefig.facecolor": "auto",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    "text.color": INK,
    "text.usetex": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": SMALL_SIZE,
    "ytick.labelsize": SMALL_SIZE,
}


@contextmanager
def themed(changes: dict[str, Any] | None = None) -> Iterator[None]:
    """Draw with these settings inside the ``with`` block, whatever the user's are outside."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        settings: Any = {**_SETTINGS, **(changes or {})}
        mpl.rcParams.update(settings)
        yield


def add_title(
    figure: Figure, heading: str, details: list[str], warnings: Sequence[str] = ()
) -> None:
    """Write a heading and lines of small type over a figure, which makes room for them."""
    height = figure.get_size_inches()[1]
    lines = [(heading, TITLE_SIZE, "bold"), *((line, SMALL_SIZE, "normal") for line in details)]
    lines += [(line, SMALL_SIZE, "bold") for line in warnings]
    for number, (text, size, weight) in enumerate(lines):
        figure.text(
            0.015, 1 - (0.14 + LINE * number + (0.05 if number else 0)) / height, text,
            fontsize=size, fontweight=weight, va="top", in_layout=False,
        )  # fmt: skip
    room = 0.38 + LINE * (len(lines) - 1)
    figure.set_layout_engine("constrained", rect=(0, 0, 1, 1 - room / height))


def lay_out(figure: Figure) -> None:
    """Give everything its place and size, as drawing would."""
    engine = figure.get_layout_engine()
    assert engine is not None
    engine.execute(figure)


def add_legend(axes: Axes, *entries: list[Any], aside: float = 0.0) -> None:
    """Put a legend to the right of a panel, ``aside`` widths of it further where a scale stands.

    ``entries`` are handles and labels, if not all.
    """
    axes.legend(
        *entries, loc="center left", bbox_to_anchor=(1.0 + aside, 0.5), borderaxespad=0.6,
        handlelength=1.6,
    )  # fmt: skip


def widen(axes: Axes, least: float) -> None:
    """Keep rounding errors of a constant from filling the panel."""
    low, high = axes.get_ylim()
    if high - low < least:
        middle = (low + high) / 2
        axes.set_ylim(middle - least / 2, middle + least / 2)


def paler(color: str) -> str:
    """Return a tint of a colour."""
    from matplotlib.colors import to_hex, to_rgb

    red, green, blue = (1 - 0.45 * (1 - part) for part in to_rgb(color))
    return to_hex((red, green, blue))
