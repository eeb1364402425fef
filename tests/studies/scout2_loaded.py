"""Imported for its effect: what a sweep of Scout II takes long to load is there, to be forked."""

from __future__ import annotations

import pandas  # noqa: F401  # by pyarrow, for the first table
import pyarrow.parquet  # noqa: F401

import flexspine.cli.app
import flexspine.studies.sweep  # noqa: F401
from flexspine import load_model
from flexspine.models.many import make_cases, run_cases
from flexspine.models.simulation import DEFAULT_TOLERANCE

run_cases(make_cases(load_model("scout2"), {"speed": [4.0]}), 1, DEFAULT_TOLERANCE)
