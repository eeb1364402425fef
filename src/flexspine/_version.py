"""Versions, in one place: of the package, and of the JSON that it prints."""

from collections.abc import Mapping
from typing import Any

from flexspine.errors import InputError

__version__ = "0.1.0"

SCHEMA_VERSION = 1

# What every record begins with.
STAMP = {"schema_version": SCHEMA_VERSION, "flexspine": __version__}


def check_schema(record: Mapping[str, Any], where: str) -> None:
    """Raise `InputError` for a record of a form that this version would misread.

    Whoever writes one by hand need not say which it is.
    """
    found = record.get("schema_version", SCHEMA_VERSION)
    if found != SCHEMA_VERSION:
        raise InputError(
            f"{where} has schema_version {found!r:.40}, and this flexspine reads {SCHEMA_VERSION}",
            "use the flexspine that wrote it",
        )
