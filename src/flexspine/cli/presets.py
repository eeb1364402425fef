"""``flexspine presets``: what there is, and every value with unit and provenance."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from flexspine._version import SCHEMA_VERSION
from flexspine.cli.options import Json
from flexspine.cli.output import print_json


def presets(
    name: Annotated[str | None, typer.Argument(help="A preset or a TOML file.")] = None,
    json: Json = False,
) -> None:
    """List the presets, or show every value of one with unit and provenance.

    Examples:
        flexspine presets

        flexspine presets scout2
    """
    from flexspine.models.presets import load_model, preset_names

    if name is None:
        rows = [_headline(load_model(preset)) for preset in preset_names()]
        if json:
            print_json({"schema_version": SCHEMA_VERSION, "presets": rows})
        else:
            _print_list(rows)
        return
    record = _details(load_model(name))
    if json:
        print_json(record)
    else:
        _print_details(record)


def _headline(model: Any) -> dict[str, Any]:
    source = model.source
    return {
        "name": model.name,
        "model": model.kind.name,
        "title": source.title,
        "citation": source.citation,
    }


def _details(model: Any) -> dict[str, Any]:
    from flexspine.models.dataset import VARIABLES
    from flexspine.parameters import quantities, values

    given = values(model.parameters)
    rows = [
        {
            "name": about.name,
            "value": given[about.name],
            "unit": about.unit,
            "meaning": about.meaning,
            "bounds": about.bounds,
            "provenance": model.source.of(about.name),
        }
        for about in quantities(type(model.parameters))
    ]
    renamed = {"height": "com_y", "speed": "com_x_rate"}
    apex = [
        {
            "name": f"apex.{name}",
            "value": value,
            "unit": VARIABLES[renamed.get(name, name)][0],
            "meaning": f"{VARIABLES[renamed.get(name, name)][1]} at the start",
            "provenance": model.source.of("apex"),
        }
        for name, value in model.apex.items()
    ]
    touchdown = [
        {
            "name": f"touchdown.{side}",
            "value": value,
            "unit": "rad",
            "meaning": f"touchdown angle of the {side} leg, from the vertical",
            "provenance": model.source.of("touchdown"),
        }
        for side, value in model.touchdown.items()
    ]
    return {
        "schema_version": SCHEMA_VERSION,
        **_headline(model),
        "source": model.source.source,
        "notes": list(model.source.notes),
        "doubts": list(model.source.doubts),
        "values": [*rows, *apex, *touchdown],
    }


def _print_list(rows: list[dict[str, Any]]) -> None:
    for row in rows:
        print(f"{row['name']:<24}{row['model']:<18}{row['title']}")
        print(f"{'':<24}{row['citation']}")


def _print_details(record: dict[str, Any]) -> None:
    print(f"{record['name']} ({record['model']}): {record['title']}")
    print(f"citation: {record['citation'] or '-'}")
    for kind in ("notes", "doubts"):
        for text in record[kind]:
            print(f"{kind[:-1]}: {text}")
    print()
    widths = [max(len(str(row[key])) for row in record["values"]) for key in ("name", "unit")]
    for row in record["values"]:
        print(
            f"{row['name']:<{widths[0]}}  {row['value']:<22.16g} {row['unit']:<{widths[1]}}  "
            f"{row['meaning']}  [{row['provenance']}]"
        )
