"""Versions, in one place: of the package, and of the JSON that it prints."""

__version__ = "0.1.0"

SCHEMA_VERSION = 1
