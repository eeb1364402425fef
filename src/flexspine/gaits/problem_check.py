"""What a problem cannot be asked for, told before it is solved."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from flexspine.errors import ParameterError, UnknownNameError
from flexspine.models.legs import ANGLES, SIDES
from flexspine.parameters import is_number, shortened

if TYPE_CHECKING:
    from flexspine.gaits.problem import Problem


def check_problem(problem: Problem) -> None:
    """Refuse what cannot be fixed, set free, or symmetric.

    Raises `UnknownNameError` and `ParameterError`.
    """
    model, coordinates = problem.model, problem.system.section.coordinates
    model.on_flat_ground("a gait")
    known = (*coordinates, *ANGLES, "energy", "mean_speed")
    for name, value in problem.fixed.items():
        if name not in known:
            raise UnknownNameError("quantity", name, known)
        if not (is_number(value) and isfinite(value)):
            raise ParameterError(f"{name} = {shortened(value)} is not usable", "give a number")
        if name in ("mean_speed", "speed") and value < 0:
            raise ParameterError(f"{name} = {value:g} is backward", "give 0 or more")
    parameters = model.parameter_names[: -len(ANGLES)]
    for name in problem.free:
        if name not in parameters:
            raise UnknownNameError("parameter", name, parameters)
    if problem.symmetric:
        _check_symmetry(problem)


def _check_symmetry(problem: Problem) -> None:
    model, reversal = problem.model, problem.system.reversal
    if not (reversal and model.alike):
        reason = "its ends differ" if reversal else "it has dampers or actuators"
        raise ParameterError(
            f"'{model.name}' has no symmetric gaits, as {reason}",
            "look for general ones, or make both ends alike, without dampers and thrust",
        )
    for name in problem.fixed:
        if name in problem.system.section.coordinates and name not in reversal.coordinates:
            raise ParameterError(
                f"symmetry decides '{name}' already", "leave it, or look for general gaits"
            )
    for name in problem.free:
        if set(name.split(".")) & {*SIDES}:
            raise ParameterError(f"'{name}' would make the ends differ", "look for general gaits")
