"""What a sweep cannot be asked for, told before anything is done."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexspine.errors import InputError, ParameterError, UnknownNameError
from flexspine.models.legs import ANGLES
from flexspine.models.many import make_cases
from flexspine.models.model import TOLERANCES, Model, check_between
from flexspine.models.simulation import DEFAULT_TOLERANCE, check_count
from flexspine.parameters import is_finite, shortened
from flexspine.studies.axes import GRID, METHODS, OF_GAITS, check_points, free_axes, grid_size
from flexspine.studies.task_kinds import GAITS, OPTIONS, RUNS, SEARCHES, TASKS, WALK_SECONDS, WALKS
from flexspine.studies.walkers import Walker

if TYPE_CHECKING:
    from flexspine.studies.plan import Plan

WORDS = {bool: "true or false", dict: "a table", str: "the name of an axis"}

# Seeds fit into a TOML file and into a manifest.
SEEDS = 2**63


def check_plan(plan: Plan) -> None:
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
