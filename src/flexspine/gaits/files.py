"""Gaits saved to and loaded from JSON files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from flexspine._version import check_schema
from flexspine.errors import OUT_OF_SPACE, InputError, OutputError, PresetError
from flexspine.gaits.gait import Gait, examine
from flexspine.gaits.gait_record import gait_record
from flexspine.models.model import Model, Source
from flexspine.models.registry import find_kind
from flexspine.models.simulation import DEFAULT_TOLERANCE
from flexspine.parameters import build

# Period doubling leads to a few strides per period, never to this many.
MOST_STRIDES = 64

NEEDED = ("model", "parameters", "apex", "touchdown_angles")


def save_gait(gait: Gait, path: str | Path) -> None:
    """Write a gait to a JSON file that `load_gait` and ``flexspine bound --gait`` take.

    Raises `OutputError`.
    """
    text = json.dumps(gait_record(gait), indent=2, allow_nan=False)
    try:
        Path(path).write_text(text + "\n", encoding="utf-8")
    except OSError as failure:
        if failure.errno in OUT_OF_SPACE:
            raise
        raise OutputError(
            f"cannot write '{path}' ({failure.strerror})", "give another path"
        ) from None


def load_gait(path: str | Path) -> Gait:
    """Read a gait from a file written by `save_gait` or by ``flexspine gait``.

    It is run anew; its ``flaw`` tells if it does not close any more. Raises `PresetError` for a
    file that cannot be read, holds no gait, or more than one.
    """
    record = _only_gait(str(path), _parse(str(path)))
    try:
        check_schema(record, "the gait")
        model = Model(
            name=str(record.get("preset", Path(path).stem)),
            kind=find_kind(str(record["model"])),
            parameters=build(find_kind(str(record["model"])).parameters, record["parameters"]),
            apex=record["apex"],
            touchdown=record["touchdown_angles"],
            source=Source(title=str(record.get("family", "a gait")), source=f"file {path}"),
        )
        strides = record.get("strides", 1)
        if not (isinstance(strides, int) and 1 <= strides <= MOST_STRIDES):
            raise PresetError(f"{strides} strides", f"give 1 to {MOST_STRIDES}")
        tolerance = record.get("tolerance", DEFAULT_TOLERANCE)
        return examine(model, strides=strides, tolerance=tolerance)
    except InputError as failure:
        raise PresetError(f"'{path}': {failure.message}", failure.remedy) from None
    except (TypeError, AttributeError):
        raise PresetError(
            f"'{path}' is not a gait", "give a file written by 'flexspine gait --out'"
        ) from None


def _parse(path: str) -> Any:
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as failure:
        raise PresetError(
            f"cannot read '{path}' ({failure.strerror})", "give a readable gait file"
        ) from None
    except ValueError:
        raise PresetError(
            f"'{path}' is not JSON", "give a file written by 'flexspine gait --out'"
        ) from None


def _only_gait(path: str, content: Any) -> dict[str, Any]:
    gaits = content.get("gaits") if isinstance(content, dict) else None
    if isinstance(gaits, list):
        if len(gaits) != 1:
            raise PresetError(
                f"'{path}' holds {len(gaits)} gaits", "give a file that holds one of them"
            )
        content = gaits[0]
    missing = [name for name in NEEDED if not isinstance(content, dict) or name not in content]
    if missing:
        raise PresetError(
            f"'{path}' is not a gait, it has no '{missing[0]}'",
            "give a file written by 'flexspine gait --out'",
        )
    return dict(content)
