from __future__ import annotations

import csv
import gc
import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from flexspine import Model, load_model
from flexspine.models.presets import preset_names

REFERENCE = Path(__file__).parent / "reference"

settings.register_profile(
    "flexspine",
    deadline=None,  # the first example of a model compiles it
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("flexspine")


def pytest_configure(config: pytest.Config) -> None:
    """Compile into pytest's own cache, never the user's, and in a quarter of the time.

    `tests/hybrid/test_optimization.py` shows that the usual level computes the same.
    """
    os.environ["FLEXSPINE_CACHE_DIR"] = str(config.cache.mkdir("compiled"))
    os.environ.setdefault("FLEXSPINE_OPTIMIZATION", "0")


def pytest_collection_finish() -> None:
    """What is imported stays: no search for garbage need go through it again."""
    gc.freeze()


def reference_rows(name: str) -> list[list[str]]:
    """The rows of a reference table, without its header comments."""
    lines = (REFERENCE / name).read_text().splitlines()
    return list(csv.reader(line for line in lines if line and not line.startswith("#")))


@pytest.fixture(params=preset_names())
def preset(request: pytest.FixtureRequest) -> Model:
    return load_model(request.param)


@pytest.fixture
def flexible() -> Model:
    return load_model("kamimura2015-flexible")
