"""`python -m benchmarks.figure` draws docs/images/benchmarks.png from results/benchmarks.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from flexspine.report.style import BLUE, FAINT, INK, SKY, SMALL_SIZE, TEXT_SIZE, add_title, themed

RECORD, OUT = Path("results/benchmarks.json"), Path("docs/images/benchmarks.png")

WIDTH, ROW = 8.6, 0.42  # in; of the figure, and of a bar with its two lines of words
HEADING = 0.9  # rows; what the heading of a group takes
TIMES = "\u00d7"
PEER, GREY = "#8C8C8C", "#606060"
COLORS = {"ensemble": BLUE, "alone": SKY, "floor": "#D2D2D2", "scipy": PEER, "diffrax": PEER}


def plot_ensemble(found: dict[str, Any]) -> Figure:
    """Draw microseconds per stride of every side, at equal error and at the default tolerance."""
    matched, default = found["matched_tolerance"], found["default_tolerance"]
    rows = [row for row in found["rows"] if row["kind"] in COLORS]
    peers = [
        row for row in rows
        if row["kind"] in ("scipy", "diffrax")
        or (row["kind"] in ("ensemble", "alone") and row["tolerance"] == matched)
    ]  # fmt: skip
    floors = [
        row for row in rows
        if row["kind"] in ("ensemble", "floor") and row["tolerance"] == default
    ]  # fmt: skip
    groups = (
        (f"Error of a stride at most {found['allowed_error']:g}", peers),
        (f"Against heyoka alone, tolerance {default:g}", floors),
    )
    with themed():
        total = len(peers) + len(floors) + len(groups) * HEADING
        figure = Figure(figsize=(WIDTH, 1.3 + ROW * total))
        axes = figure.add_subplot()
        place = 0.0
        for heading, members in groups:
            axes.text(
                -0.01, place + 0.5 * HEADING, heading, transform=axes.get_yaxis_transform(),
                ha="right", va="center", fontweight="bold",
            )  # fmt: skip
            place += HEADING
            for row in sorted(members, key=lambda row: -row["us_per_stride"]):
                _bar(axes, place + 0.5, row)
                place += 1.0
        longest = max(row["us_per_stride"] for row in rows)
        axes.set(xscale="log", xlim=(1, 40 * longest), ylim=(place, 0), yticks=[])
        axes.set_xlabel("microseconds per stride or flow, one core")
        axes.spines["left"].set_visible(False)
        axes.grid(axis="x", color=FAINT, alpha=0.25, linewidth=0.5)
        axes.set_axisbelow(True)
        add_title(
            figure,
            "A stride of a bounding quadruped with a flexible spine",
            [
                f"$k_t$ = 260 N m/rad, 4.5 m/s, {found['stride_s']:.4f} s; thousands of starts "
                f"scattered by {found['spread_of_starts']:g} around the gait",
                "diffrax and heyoka alone: a smooth flow as long as a stride, without events; "
                f"{TIMES}: times as long as the ensemble",
            ],
        )
        return figure


def _bar(axes: Any, place: float, row: dict[str, Any]) -> None:
    """A bar with its name and settings on its left, time and ratio on its right."""
    pace = row["us_per_stride"]
    axes.barh(place, pace - 1, left=1, height=0.62, color=COLORS[row["kind"]])
    left = axes.get_yaxis_transform()
    axes.text(-0.01, place - 0.2, row["name"], transform=left, ha="right", va="center")
    axes.text(
        -0.01, place + 0.22, row["settings"], transform=left, ha="right", va="center",
        fontsize=SMALL_SIZE - 1, color=GREY,
    )  # fmt: skip
    words = f"{pace:.1f} µs" if pace < 1000 else f"{pace / 1000:.1f} ms"
    if "ensemble_over_floor" in row:
        words += f"   (ensemble: {row['ensemble_over_floor']:.2f} {TIMES})"
    elif "over_ensemble_matched" in row:
        times = row["over_ensemble_matched"]
        words += f"   {times:.{0 if times > 20 else 1}f} {TIMES}"
    axes.annotate(
        words, (pace, place), xytext=(4, 0), textcoords="offset points",
        va="center", fontsize=TEXT_SIZE, color=INK,
    )  # fmt: skip


def main() -> None:
    figure = plot_ensemble(json.loads(RECORD.read_text())["ensemble"])
    OUT.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT)
    print(f"written to {OUT}")


if __name__ == "__main__":
    main()
