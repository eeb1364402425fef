"""One chunk of a sweep: its rows, as a finished Parquet file in memory."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from flexspine.engines.installed import mujoco_module
from flexspine.errors import InputError, ParameterError
from flexspine.gaits.gait import Gait, examine
from flexspine.gaits.search import DEFAULT_STARTS, find_gaits, pose_problems
from flexspine.gaits.stability import floquet_multipliers
from flexspine.hybrid.compile import Array
from flexspine.models.many import make_cases, run_cases
from flexspine.models.model import Model
from flexspine.models.presets import load_model
from flexspine.parameters import values
from flexspine.studies.axes import OF_GAITS
from flexspine.studies.following import Line, LostGaitError, carried
from flexspine.studies.parts import Part, make_part
from flexspine.studies.plan import Plan
from flexspine.studies.tables import Row, gait_row
from flexspine.studies.task_kinds import GAITS, RUNS, SEARCHES, WALKS
from flexspine.studies.walkers import Walker, row_names

if TYPE_CHECKING:
    import pyarrow as pa

FOUND, NONE = "found", "none"

# Columns that hold no real numbers.
_TEXTS = {"outcome", "reason", "phases", "family", "floquet_multipliers"}
_COUNTS = {"point", "strides", "gait"}
_FLAGS = {"stable", "confirmed"}

# The gait by which the columns of gaits are known.
_SAMPLE = "kamimura2015-flexible"


def do_chunk(work: tuple[Plan, int]) -> Part:
    """Do the task at the points of a chunk."""
    plan, chunk = work
    make = {RUNS: _runs, WALKS: _walks}.get(plan.task, _gaits)
    return make_part(make(plan, chunk))


def check_task(plan: Plan) -> None:
    """Try what can be known before anything is done.

    Raises `InputError`, and `MachineError` where there is no MuJoCo to walk in.
    """
    if plan.task == WALKS:
        mujoco_module()
    for number, model in enumerate(plan.bounders):
        if plan.task == GAITS:
            own = examine(model, tolerance=plan.tolerance)
            if own.flaw is not None:
                raise InputError(
                    f"the start of '{model.name}' is no gait to follow: {own.flaw}",
                    "give a gait file, as 'flexspine gait --out' makes it",
                )
        elif plan.task == SEARCHES:
            given = _given(model, plan.at(number * plan.chunks_each))
            first = {name: float(column[0]) for name, column in given.items()}
            body, fixed = _request(
                model, first, dict(plan.options.get("fixed", {})), plan.tolerance
            )
            pose_problems(body, fixed, symmetric=plan.options.get("symmetric"))


def _given(model: Model, points: dict[str, Array]) -> dict[str, Array]:
    """The points of what a model has."""
    return {name: column for name, column in points.items() if name in {*model.numbers, *OF_GAITS}}


def column_of(axis: str) -> str:
    """The column with the values of an axis, such as ``at_spine_stiffness``."""
    return f"at_{axis.replace('.', '_')}"


def _bounder(plan: Plan, chunk: int) -> tuple[Model, int, int]:
    """The model of a chunk of a sweep in which nobody walks, its first point and their number."""
    model, first, count = plan.of_chunk(chunk)
    assert isinstance(model, Model)
    return model, first, count


def _walks(plan: Plan, chunk: int) -> pa.Table:
    """A walk at every point, each with a seed of its own."""
    import pyarrow as pa

    walker, first, count = plan.of_chunk(chunk)
    assert isinstance(walker, Walker)
    points, options = plan.at(chunk), plan.all_options
    own = {name: column for name, column in points.items() if name in walker.numbers}
    names = ["point", *(column_of(axis.name) for axis in plan.axes), *row_names()]
    rows = []
    for i in range(count):
        given = {name: float(column[i]) for name, column in own.items()}
        seed = np.random.SeedSequence((plan.seed, first + i)).generate_state(1)
        row: Row = {"point": first + i, **{column_of(n): value for n, value in given.items()}}
        there = walker.with_values(given) if given else walker
        rows.append(row | there.row(options["seconds"], options["sensing"], int(seed[0])))
    schema = pa.schema([(name, _type(name)) for name in names])
    return pa.Table.from_pylist(rows, schema=schema)


def _runs(plan: Plan, chunk: int) -> pa.Table:
    import pyarrow as pa

    model, first, count = _bounder(plan, chunk)
    points = plan.at(chunk)
    own = {name: column for name, column in points.items() if name in model.numbers}
    own = own or {"height": np.full(count, model.apex["height"])}
    cases = make_cases(model, own, plan.body(model))
    columns = run_cases(cases, plan.options.get("strides", 1), plan.tolerance)
    given = {column_of(name): column for name, column in own.items()}
    apexes = [f"apex_{name}" for each in plan.bounders for name in each.apex]
    names = ["point", *(column_of(axis.name) for axis in plan.axes), "outcome", "strides"]
    names += ["duration", "distance", "apex_time", *dict.fromkeys(apexes)]
    names += [name for name in columns if name not in names]
    made = {"point": np.arange(first, first + count), **given, **columns}
    schema = pa.schema([(name, _type(name)) for name in names])
    nothing = pa.nulls(count)
    arrays = [
        pa.array(made[field.name]).cast(field.type)
        if field.name in made
        else nothing.cast(field.type)
        for field in schema
    ]
    return pa.Table.from_arrays(arrays, schema=schema)


def _gaits(plan: Plan, chunk: int) -> pa.Table:
    import pyarrow as pa

    rows = list(_followed(plan, chunk) if plan.task == GAITS else _searched(plan, chunk))
    names = ["point", *(column_of(axis.name) for axis in plan.axes), "outcome", "reason", "gait"]
    if plan.task == GAITS:
        names += ["branch_from", "branch_to"]
    schema = pa.schema([(name, _type(name)) for name in [*names, *_gait_columns()]])
    return pa.Table.from_pylist(rows, schema=schema)


def _type(name: str) -> Any:
    import pyarrow as pa

    if name in _TEXTS:
        return pa.string()
    if name in _COUNTS:
        return pa.int64()
    return pa.bool_() if name in _FLAGS else pa.float64()


@lru_cache
def _gait_columns() -> tuple[str, ...]:
    gait = examine(load_model(_SAMPLE))
    return tuple(gait_row(gait, floquet_multipliers(gait)))


def _searched(plan: Plan, chunk: int) -> Iterator[Row]:
    """Every gait found at every point of a chunk, or one row that says that there is none."""
    model, first, count = _bounder(plan, chunk)
    points, options = plan.at(chunk), plan.options
    for i in range(count):
        row: Row = {"point": first + i}
        given = {n: float(column[i]) for n, column in _given(model, points).items()}
        row |= {column_of(name): value for name, value in given.items()}
        seed = np.random.SeedSequence((plan.seed, chunk // plan.chunks_each, first + i))
        try:
            body, fixed = _request(model, given, dict(options.get("fixed", {})), plan.tolerance)
            search = find_gaits(
                body,
                fixed,
                symmetric=options.get("symmetric"),
                starts=options.get("starts", DEFAULT_STARTS),
                seed=int(seed.generate_state(1)[0]),
                tolerance=plan.tolerance,
            )
        except InputError as failure:
            yield {**row, "outcome": NONE, "reason": failure.message}
            continue
        if not search.gaits:
            yield {**row, "outcome": NONE, "reason": search.advice}
        for number, gait in enumerate(search.gaits):
            yield {**row, **_found(gait), "gait": number}


def _request(
    model: Model, given: dict[str, float], fixed: dict[str, float], tolerance: float
) -> tuple[Model, dict[str, float]]:
    """The body to search gaits of and what is fixed: by default the model's own gait's."""
    parameters = {n: v for n, v in given.items() if n in values(model.parameters)}
    body = model.with_values(parameters) if parameters else model
    if not fixed:
        own = examine(model, tolerance=tolerance)
        if own.flaw is not None:
            raise ParameterError(f"the start of '{model.name}' is no gait", "say what is fixed")
        fixed = own.quantities
    return body, {**fixed, **{n: v for n, v in given.items() if n not in parameters}}


def _followed(plan: Plan, chunk: int) -> Iterator[Row]:
    """The gait at every point of a line, followed from the model's own."""
    model, first, count = _bounder(plan, chunk)
    points, over = plan.at(chunk), plan.axes[-1].name
    given = _given(model, points)
    rows: list[Row] = [
        {"point": first + i, **{column_of(n): float(c[i]) for n, c in given.items()}}
        for i in range(count)
    ]
    try:
        gait = examine(model, tolerance=plan.tolerance)
        if gait.flaw is not None:
            raise LostGaitError(f"the start of '{model.name}' is no gait: {gait.flaw}")
        for name, column in given.items():
            if name != over:
                gait = carried(gait, name, float(column[0]))
        line = Line.through(gait, over, given[over], plan.options.get("symmetric"))
    except (LostGaitError, InputError) as failure:
        for row in rows:
            yield {**row, "outcome": NONE, "reason": str(failure)}
        return
    for row, value in zip(rows, given[over].tolist(), strict=True):
        row |= {"branch_from": line.reached[0], "branch_to": line.reached[1]}
        there = line.at(value)
        if there is None:
            yield {**row, "outcome": NONE, "reason": line.end}
        else:
            yield {**row, **gait_row(*there), "outcome": FOUND, "gait": 0}


def _found(gait: Gait) -> Row:
    return {**gait_row(gait, floquet_multipliers(gait)), "outcome": FOUND}
