"""What a sweep does, written down so that it can be repeated."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import ceil
from typing import Any

from flexspine.errors import InputError, PresetError
from flexspine.hybrid.compile import Array
from flexspine.models.model import Model, Source
from flexspine.models.registry import find_kind
from flexspine.models.simulation import DEFAULT_TOLERANCE
from flexspine.parameters import build, values
from flexspine.studies.axes import (
    GRID,
    Axis,
    grid_points,
    grid_size,
    sampled_points,
)
from flexspine.studies.plan_check import check_plan
from flexspine.studies.task_kinds import GAITS, RUNS, SEARCHES, WALK_SECONDS, WALKS
from flexspine.studies.walkers import Walker

# What one piece of work and one file hold: some seconds of it.
MOST_STRIDES, MOST_RUNS, FEWEST_RUNS = 400_000, 16384, 256
EACH = {SEARCHES: 16, WALKS: 4}


@dataclass(frozen=True)
class Plan:
    """A sweep: a task at points of axes, for each of some models.

    ``models`` are a `Model` each, or a `Walker` each if they walk; ``axes`` an `Axis` each.
    ``task`` is ``runs``, ``searches`` (of gaits), ``gaits`` (followed over the last axis) or
    ``walks``. ``method`` is ``grid``, ``random`` or ``sobol``; the latter two draw ``samples``
    points a model from ``seed``. ``chunk`` points make a piece of work and a file. ``options`` are
    the task's: ``strides`` of runs; ``starts``, ``symmetric`` and ``fixed`` of searches; the axis
    ``over`` which gaits are followed, and ``symmetric``; ``tolerance`` of all these; ``seconds``
    and ``sensing`` (rad) of walks. Raises `InputError` for what cannot be done.
    """

    models: tuple[Model | Walker, ...]
    axes: tuple[Axis, ...]
    task: str = RUNS
    method: str = GRID
    samples: int | None = None
    seed: int = 0
    chunk: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_plan(self)

    @property
    def points(self) -> int:
        """How many points each model has."""
        return grid_size(self.axes) if self.method == GRID else self.samples or 0

    @property
    def chunk_points(self) -> int:
        """How many points a chunk has; following gaits, those on one line over its axis."""
        if self.task == GAITS:
            axis = self.axes[-1]
            return len(axis.values) or axis.steps or 1
        if self.chunk is not None:
            return self.chunk
        if self.task in EACH:
            return EACH[self.task]
        runs = MOST_STRIDES // int(self.options.get("strides", 1))
        return min(max(runs, FEWEST_RUNS), MOST_RUNS)

    @property
    def chunks_each(self) -> int:
        """How many chunks each model has."""
        return ceil(self.points / self.chunk_points)

    @property
    def chunks(self) -> int:
        """How many chunks there are."""
        return self.chunks_each * len(self.models)

    def body(self, model: Model) -> Model:
        """Return a model with every parameter as far from zero as the axes make it."""
        known = values(model.parameters)
        own = {axis.name: known[axis.name] for axis in self.axes if axis.name in known}
        return model.with_values(
            {a.name: max(a.range(own[a.name]), key=abs) for a in self.axes if a.name in own}
        )

    @property
    def tolerance(self) -> float:
        """The integrator's tolerance."""
        return float(self.options.get("tolerance", DEFAULT_TOLERANCE))

    @property
    def bounders(self) -> tuple[Model, ...]:
        """The models of a sweep in which nobody walks."""
        return tuple(model for model in self.models if isinstance(model, Model))

    @property
    def walkers(self) -> tuple[Walker, ...]:
        """The models of a sweep of walks."""
        return tuple(model for model in self.models if isinstance(model, Walker))

    def of_chunk(self, chunk: int) -> tuple[Model | Walker, int, int]:
        """Return a chunk's model, its first point among that model's and how many it has."""
        number, part = divmod(chunk, self.chunks_each)
        first = part * self.chunk_points
        return self.models[number], first, min(self.chunk_points, self.points - first)

    def at(self, chunk: int) -> dict[str, Array]:
        """Return the points of a chunk: values of every axis by name, each (points,)."""
        model, first, count = self.of_chunk(chunk)
        if self.method == GRID:
            return grid_points(model, self.axes, first, count)
        seed = (self.seed, chunk // self.chunks_each)
        return sampled_points(model, self.axes, self.method, seed, first, count)

    def record(self) -> dict[str, Any]:
        """Return all that decides the rows, as JSON holds it."""
        record = {
            "task": self.task,
            "method": self.method,
            "samples": self.samples,
            "seed": self.seed,
            "options": self.all_options,
            "axes": {axis.name: axis.record() for axis in self.axes},
            "models": [
                model.record()
                if isinstance(model, Walker)
                else {"name": model.name, **model.record()}
                for model in self.models
            ],
            "chunk": self.chunk_points,
        }
        # NumPy's numbers become plain ones.
        return dict(json.loads(json.dumps(record, default=lambda number: number.item())))

    @property
    def all_options(self) -> dict[str, Any]:
        """The options with those that were not told."""
        if self.task == WALKS:
            return {"seconds": WALK_SECONDS, "sensing": 0.0, **self.options}
        return {**self.options, "tolerance": self.tolerance}

    @classmethod
    def revive(cls, record: Mapping[str, Any]) -> Plan:
        """Make the plan of a record. Raises `InputError` if it is none."""
        try:
            return cls(
                models=tuple(_revived(model) for model in record["models"]),
                axes=tuple(Axis.read(n, content) for n, content in record["axes"].items()),
                task=record["task"],
                method=record["method"],
                samples=record["samples"],
                seed=record["seed"],
                chunk=record["chunk"],
                options=record["options"],
            )
        except (KeyError, TypeError, AttributeError, ValueError):
            raise InputError("the record of a sweep is damaged", "begin it anew") from None

    @property
    def key(self) -> str:
        """A short name of all that decides the rows."""
        text = json.dumps(self.record(), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _revived(record: Mapping[str, Any]) -> Model | Walker:
    if "walk" in record:
        return Walker.revive(record)
    kind = find_kind(record["model"])
    try:
        parameters = build(kind.parameters, record["parameters"])
    except InputError as failure:
        raise PresetError(failure.message, failure.remedy) from None
    title = Source(title=str(record["name"]), source="the record of a sweep")
    return Model(record["name"], kind, parameters, record["apex"], record["touchdown"], title)
