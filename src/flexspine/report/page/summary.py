"""What a record says: its outcome first, then its main numbers in words with units."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

from flexspine.parameters import is_number
from flexspine.report.page.holdings import is_gait
from flexspine.report.page.markup import Markup, code, folded, joined, table, tag, told

# What a number means, by its name in a record: words and unit.
WORDS: dict[str, tuple[str, str]] = {
    "asked_speeds": ("speeds asked for", "m/s"),
    "compared": ("speeds compared", "m/s"),
    "speeds": ("range of mean speeds", "m/s"),
    "stiffnesses": ("spine stiffness", "N m/rad"),
    "strides": ("strides", ""),
    "achieved_speed": ("mean speed that came of it", "m/s"),
    "bounce": ("CoM height, standard deviation", "m"),
    "com_amplitude": ("amplitude of the CoM's height", "m"),
    "contact_loss": ("energy lost to the ground, per stride", "J"),
    "cost_of_transport": ("cost of transport", ""),
    "damper_loss": ("energy lost in dampers, per stride", "J"),
    "deepest": ("deepest a foot got into the ground", "m"),
    "dissipated": ("energy lost in dampers", "J"),
    "distance": ("distance", "m"),
    "drift": ("largest drift of a standing foot", "m"),
    "duration": ("duration", "s"),
    "duty_factor": ("duty factor", ""),
    "energy": ("total energy", "J"),
    "energy_at_end": ("energy at the end", "J"),
    "energy_at_start": ("energy at the start", "J"),
    "energy_unaccounted": ("energy not accounted for", "J"),
    "error": ("tracking error", "rad"),
    "flight": ("share of time in flight", ""),
    "friction_demand": ("largest ratio of tangential to normal force", ""),
    "froude": ("Froude number", ""),
    "heading": ("heading, from x", "rad"),
    "height": ("height", "m"),
    "impact": ("mean of the largest normal force in touchdowns", "N"),
    "imbalance": ("energy not accounted for", "J"),
    "impulse": ("largest impulse of an impact", "N s"),
    "mean_error": ("tracking error (rms)", "rad"),
    "mean_speed": ("mean speed", "m/s"),
    "net_work": ("net work", "J"),
    "normal": ("normal force on a foot that stands", "N"),
    "peak_force": ("peak force on a foot", "N"),
    "peak_grf": ("peak ground reaction force, per pair of legs", "N"),
    "peak_grf_vertical": ("peak vertical ground reaction force, per pair of legs", "N"),
    "peak_normal": ("largest normal force on a foot", "N"),
    "period": ("stride period", "s"),
    "pitch": ("pitch of the trunk", "rad"),
    "push": ("push", "N s"),
    "roll": ("roll of the trunk, standard deviation", "rad"),
    "seconds": ("duration asked for", "s"),
    "sliding": ("share of time in which a foot slides", ""),
    "speed": ("steady speed", "m/s"),
    "spine_range": ("spine angle", "rad"),
    "spine": ("spine", "rad"),
    "spectral_radius": ("spectral radius", ""),
    "level_spectral_radius": ("spectral radius on the energy level", ""),
    "stride_frequency": ("stride frequency", "Hz"),
    "stride_length": ("stride length", "m"),
    "sway": ("CoM sideways, standard deviation", "m"),
    "torque": ("largest torque of a motor", "N m"),
    "turning": ("turning", "rad/s"),
    "wanted_speed": ("speed asked for", "m/s"),
    "work": ("work of actuators", "J"),
}

# Parts of a compound number that have a unit of their own.
PARTS = {"relative_drift": "", "stiffness": "N m/rad", "damping": "N m s/rad", "rest": "rad"}

# Told elsewhere on the page, or of no use to a reader of it.
ELSEWHERE = (
    "schema_version", "outcome", "message", "advice", "parameters", "apex", "touchdown_angles",
    "liftoff_angles", "provenance", "settings", "gains", "usual", "shown", "contact",
    "digest", "key", "verdicts", "walk",
    "tolerance", "preset", "model", "flexspine", "seed", "kind", "finished", "notes",
)  # fmt: skip

# Longer lists are for machines.
LONGEST_LIST = 12

# Names of what has more numbers inside, to be unfolded.
NESTED = ("measures", "setting")

# Lists of two that are a least and a largest value.
RANGES = ("normal", "height", "pitch", "speeds", "spine")

GOOD = "completed"


def record_summary(name: str, record: Mapping[str, Any]) -> Markup:
    """Return the outcome of a record in words, its main numbers, and all of it, folded."""
    parts = [outcome(record), *_told(record)]
    rows = list(_rows(record))
    if rows:
        parts.append(table(("quantity", "value", "unit"), rows))
    whole = folded(f"all of {name}", code(json.dumps(record, indent=2)))
    return joined([*parts, whole])


def outcome(record: Mapping[str, Any]) -> Markup:
    """Return how a run ended, with advice if it ended early; nothing for what is no run."""
    if "outcome" not in record:
        return Markup()
    name = str(record["outcome"])
    good = name == GOOD
    told_ = [tag("strong", name.replace("_", " ")), f": {record.get('message', '')}"]
    if not good and record.get("advice"):
        told_.append(f". Advice: {record['advice']}")
    return tag("p", *told_, class_="outcome good" if good else "outcome bad")


def _told(record: Mapping[str, Any]) -> list[Markup]:
    """What a record says itself in sentences."""
    texts = [record.get(name) for name in ("told", "verdict", "about", "ground")]
    verdicts = Counter(verdict["verdict"] for verdict in record.get("verdicts", ()))
    if verdicts:
        counts = ", ".join(f"{count} {verdict}" for verdict, count in verdicts.items())
        texts.insert(0, f"{verdicts.total()} claims are judged: {counts}.")
    advice = record.get("advice") if "outcome" not in record else None
    return [tag("p", text) for text in (*texts, advice) if isinstance(text, str)]


def _rows(record: Mapping[str, Any]) -> Iterator[tuple[str, Any, str]]:
    for name, value in record.items():
        if name in ELSEWHERE or isinstance(value, str) or is_gait(value):
            continue
        if name in NESTED and isinstance(value, Mapping):
            yield from _rows(value)
        else:
            yield from _entries(name, value)


def _entries(name: str, value: Any) -> Iterator[tuple[str, Any, str]]:
    """A number, or those of one name by their parts."""
    words, unit = WORDS.get(name, (name.replace("_", " "), ""))
    if isinstance(value, Mapping):
        for part, each in value.items():
            if _is_plain(each) and part not in ELSEWHERE:
                usual = part.replace("_", " "), PARTS.get(part, unit)
                inner, own = WORDS.get(part, usual)
                yield f"{words}: {inner}", _shown(name, each), own
    elif _is_plain(value):
        yield words, _shown(name, value), unit


def _is_plain(value: Any) -> bool:
    if isinstance(value, list):
        return 0 < len(value) <= LONGEST_LIST and not any(
            isinstance(each, list | dict) for each in value
        )
    return is_number(value) or isinstance(value, bool | str)


def _shown(name: str, value: Any) -> Any:
    if isinstance(value, list):
        if name in RANGES and len(value) == 2:
            return f"{told(value[0])} to {told(value[1])}"
        return told(value)
    return value
