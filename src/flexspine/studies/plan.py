"""What a sweep does: read from a TOML file, written down so that it can be repeated."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import ceil
from typing import Any

import numpy as np

from flexspine.errors import InputError, ParameterError, PresetError, UnknownNameError
from flexspine.hybrid.compile import Array
from flexspine.models.legs import SIDES
from flexspine.models.many import make_cases
from flexspine.models.model import TOLERANCES, Model, Source, check_between
from flexspine.models.registry import find_kind
from flexspine.models.simulation import DEFAULT_TOLERANCE, check_count
from flexspine.parameters import build, is_finite, shortened, values
from flexspine.studies.axes import (
    GRID,
    METHODS,
    OF_GAITS,
    Axis,
    check_points,
    free_axes,
    grid_points,
    grid_size,
    sampled_points,
)
from flexspine.studies.walkers import Walker

RUNS, SEARCHES, GAITS, WALKS = "runs", "searches", "gaits", "walks"
TASKS = (RUNS, SEARCHES, GAITS, WALKS)

# What one piece of work and one file hold: some seconds of it.
MOST_STRIDES, MOST_RUNS, FEWEST_RUNS = 400_000, 16384, 256
SEARCHES_EACH, WALKS_EACH = 16, 4

# s; how long a walk is, if it is not told.
WALK_SECONDS = 10.0

WORDS = {bool: "true or false", dict: "a table", str: "the name of an axis"}

ANGLES = tuple(f"touchdown.{side}" for side in SIDES)

# Seeds fit into a TOML file and into a manifest.
SEEDS = 2**63

# What each task can be told, besides the tolerance.
OPTIONS: dict[str, dict[str, type]] = {
    RUNS: {"strides": int},
    SEARCHES: {"starts": int, "symmetric": bool, "fixed": dict},
    GAITS: {"over": str, "symmetric": bool},
    WALKS: {"seconds": float, "sensing": float},
}


@dataclass(frozen=True)
class Plan:
    """A sweep: a ``task`` at points of ``axes``, for each of ``models``, walkers if they walk.

    ``method`` is ``grid``, ``random`` or ``sobol``; the latter two draw ``samples`` points a model
    from ``seed``. ``chunk`` points make a piece of work and a file. ``options`` are the task's:
    ``strides`` of runs; ``starts``, ``symmetric`` and ``fixed`` of searches; the axis ``over``
    which gaits are followed, and ``symmetric``; ``tolerance`` of all these; ``seconds`` and
    ``sensing`` of walks.
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
        _check(self)

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
        if self.task in (SEARCHES, WALKS):
            return SEARCHES_EACH if self.task == SEARCHES else WALKS_EACH
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
        """A model with every parameter as far from zero as the axes make it; see `make_cases`."""
        known = values(model.parameters)
        own = {axis.name: known[axis.name] for axis in self.axes if axis.name in known}
        return model.with_values(
            {a.name: max(a.range(own[a.name]), key=abs) for a in self.axes if a.name in own}
        )

    @property
    def tolerance(self) -> float:
        """The integrator's."""
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
        """A chunk's model, its first point among that model's and how many points it has."""
        number, part = divmod(chunk, self.chunks_each)
        first = part * self.chunk_points
        return self.models[number], first, min(self.chunk_points, self.points - first)

    def at(self, chunk: int) -> dict[str, Array]:
        """The points of a chunk: values of every axis by name."""
        model, first, count = self.of_chunk(chunk)
        if self.method == GRID:
            return grid_points(model, self.axes, first, count)
        seed = (self.seed, chunk // self.chunks_each)
        return sampled_points(model, self.axes, self.method, seed, first, count)

    def record(self) -> dict[str, Any]:
        """All that decides the rows, as JSON holds it."""
        record = {
            "task": self.task,
            "method": self.method,
            "samples": self.samples,
            "seed": self.seed,
            "options": self._options,
            "axes": {axis.name: axis.record() for axis in self.axes},
            "models": [
                model.record() if isinstance(model, Walker) else model_record(model)
                for model in self.models
            ],
            "chunk": self.chunk_points,
        }
        # NumPy's numbers become plain ones.
        return dict(json.loads(json.dumps(record, default=lambda number: number.item())))

    @property
    def _options(self) -> dict[str, Any]:
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


def _check(plan: Plan) -> None:
    """Refuse a plan that cannot be done, before anything is."""
    for what, given, known in (
        ("task", plan.task, TASKS),
        ("method", plan.method, METHODS),
    ):
        if given not in known:
            raise UnknownNameError(what, str(given), known)
    if not plan.models:
        raise InputError("there is no model", "give one or more")
    for model in plan.models:
        if (plan.task == WALKS) != isinstance(model, Walker):
            raise InputError(
                f"'{model.name}' is not for a sweep of {plan.task}",
                f"give task = '{WALKS}' and a robot together",
            )
        if isinstance(model, Model):
            model.on_flat_ground("a sweep")
        else:
            model.check()
    _check_once("model", [model.name for model in plan.models])
    _check_once("axis", [axis.name for axis in plan.axes])
    if not (type(plan.seed) is int and 0 <= plan.seed < SEEDS):
        raise ParameterError(
            f"seed = {shortened(plan.seed)} is not usable",
            f"give a whole number from 0 to {SEEDS - 1}",
        )
    if plan.chunk is not None:
        check_count("chunk", plan.chunk)
    if plan.method == GRID:
        grid_size(plan.axes)
        if plan.samples is not None:
            raise InputError("a grid has no samples", "leave 'samples' out, or sample at random")
    elif plan.samples is None:
        raise InputError(f"method '{plan.method}' needs samples", "give samples = COUNT")
    else:
        check_points(check_count("samples", plan.samples))
    if not free_axes(plan.axes):
        raise InputError("no axis varies", "add one under [axes]")
    if plan.task != RUNS and any(axis.keeps for axis in plan.axes):
        raise InputError("an axis that keeps the energy is for runs", "leave it out")
    for axis in plan.axes:
        if plan.method != GRID and axis.steps is not None:
            raise InputError(
                f"axis '{axis.name}' has steps, which are for a grid", "leave them out"
            )
    _check_options(plan)
    for model in plan.models:
        _check_axes(plan, model)


def _check_once(what: str, names: list[str]) -> None:
    for name in names:
        if not isinstance(name, str):
            raise InputError(f"the {what} {shortened(name)} has no name", "name it")
        if names.count(name) > 1:
            raise InputError(
                f"{what} '{name}' is there twice", "give it once, or rename one; rows go by names"
            )


def _check_options(plan: Plan) -> None:
    known = dict(OPTIONS[plan.task])
    if plan.task != WALKS:
        known["tolerance"] = float
    for name, value in plan.options.items():
        if name not in known:
            raise UnknownNameError(f"option of {plan.task}", name, known)
        if known[name] not in (int, float) and not isinstance(value, known[name]):
            raise ParameterError(
                f"{name} = {shortened(value)} is not usable", f"give {WORDS[known[name]]}"
            )
    check_between("tolerance", plan.options.get("tolerance", DEFAULT_TOLERANCE), *TOLERANCES)
    fixable = {*OF_GAITS, *ANGLES, *(name for model in plan.bounders for name in model.apex)}
    for name, value in plan.options.get("fixed", {}).items():
        if name not in fixable:
            raise UnknownNameError("quantity to fix", name, fixable)
        if name in [axis.name for axis in plan.axes]:
            raise InputError(f"{name} is both fixed and an axis", "keep one of them")
        if not is_finite(value):
            raise ParameterError(f"fixed {name} = {shortened(value)} is no number", "give a number")
    if plan.task == WALKS:
        check_between("seconds", plan.options.get("seconds", WALK_SECONDS), 0.01, 3600)
        if plan.options.get("sensing", 0.0) != 0.0:
            check_between("sensing", plan.options["sensing"], 0, 1)
    for name in ("strides", "starts"):
        if name in plan.options:
            check_count(name, plan.options[name])
    if plan.task == GAITS:
        over = plan.options.get("over", plan.axes[-1].name)
        if plan.method != GRID or over != plan.axes[-1].name:
            raise InputError(
                "gaits are followed over the last axis of a grid",
                f"put '{over}' last, on a grid",
            )
        for model in plan.models:
            if over not in {*model.numbers, *OF_GAITS}:
                raise InputError(
                    f"'{model.name}' has no {over} over which its gaits could be followed",
                    "sweep it by itself, over something else",
                )


def _check_axes(plan: Plan, model: Model | Walker) -> None:
    """Try the ends of every axis."""
    quantities = set(OF_GAITS) if plan.task in (SEARCHES, GAITS) else set()
    anywhere = {name for each in plan.models for name in each.numbers}
    for axis in plan.axes:
        if axis.around is not None and model.numbers.get(axis.name) == 0:
            raise InputError(
                f"axis '{axis.name}' is around 0 with '{model.name}', where a share is nothing",
                "give {within = AMOUNT}",
            )
        if axis.name in quantities and isinstance(model, Model):
            axis.own(model)
            continue
        if axis.name not in model.numbers:
            if axis.name in anywhere:
                continue
            members = [known for known in anywhere if known.startswith(f"{axis.name}.")]
            if members:
                raise InputError(f"axis '{axis.name}' is a group", f"write {sorted(members)[0]}")
            raise UnknownNameError("axis", axis.name, anywhere | quantities)
        ends = axis.range(model.numbers[axis.name])
        if isinstance(model, Walker):
            for end in ends:
                model.with_values({axis.name: end})
        else:
            make_cases(model, {axis.name: np.array(ends)})


def model_record(model: Model) -> dict[str, Any]:
    """A model's numbers, from which it can be made again."""
    return {
        "name": model.name,
        "model": model.kind.name,
        "parameters": values(model.parameters),
        "apex": dict(model.apex),
        "touchdown": dict(model.touchdown),
    }


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
