"""The command line: the only place that joins everything."""

from flexspine.cli.app import main

__all__ = ["main"]
