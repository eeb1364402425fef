"""Run a bounder many times, from many apexes and with many parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexspine.errors import ParameterError, UnknownNameError
from flexspine.hybrid.batch import Ends, Starts
from flexspine.hybrid.compile import Array, compile_system
from flexspine.hybrid.ensemble import run_many
from flexspine.hybrid.functions import section_quantities
from flexspine.hybrid.lanes import compile_lanes
from flexspine.models.legs import ANGLES, SIDES
from flexspine.models.model import LARGEST_START, TOLERANCES, Model, check_between
from flexspine.models.simulation import DEFAULT_TOLERANCE, Run, check_count, simulate
from flexspine.parameters import quantities, shortened, values
from flexspine.workers.local import LocalWorkers

# Runs in one piece of work; whoever does a piece, it comes out the same.
PIECE = 8192

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Cases:
    """A model and what differs from run to run: values by name, each of shape (k,).

    Names are those of `Model.numbers`: apex coordinates, ``touchdown.fore``, ``spine.stiffness``.
    ``body`` is the model whose system serves all of them: no term of it is missing in any case.
    """

    model: Model
    varied: Mapping[str, Array]
    body: Model

    def __len__(self) -> int:
        return len(next(iter(self.varied.values())))

    def piece(self, part: slice) -> Cases:
        """Some of the cases."""
        varied = {name: column[part] for name, column in self.varied.items()}
        return Cases(self.model, varied, self.body)

    def one(self, index: int) -> Model:
        """The model of one case."""
        chosen = {name: float(column[index]) for name, column in self.varied.items()}
        apex = {n: chosen.pop(n) for n in list(chosen) if n in self.model.apex}
        angles = {s: chosen.pop(f"touchdown.{s}") for s in SIDES if f"touchdown.{s}" in chosen}
        return self.model.with_values(chosen, apex=apex, touchdown=angles, origin="one of many")


@dataclass(frozen=True)
class Ensemble:
    """What came of many runs, in ``columns`` of shape (k,), which ``ensemble[name]`` gives too.

    ``outcome`` is the name of each; ``strides`` completed; ``duration`` in s and ``distance`` in m
    to the end; ``apex_...`` and ``apex_time`` the last apex reached, or the start;
    ``peak_grf_...`` in N per pair of legs; ``energy_start`` and ``energy_end`` in J at the first
    and the last apex; ``dissipated`` in J at the end. ``cases`` are the model and what differed,
    ``strides`` how many were asked for. A column that there is not raises `UnknownNameError`.
    """

    cases: Cases
    strides: int
    tolerance: float
    columns: Mapping[str, NDArray[Any]]

    def __len__(self) -> int:
        return len(self.cases)

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self.columns:
            raise UnknownNameError("column", str(name), self.columns)
        return self.columns[name]

    def __repr__(self) -> str:
        return f"<Ensemble of {len(self)} runs of {self.cases.model.name}: {self.tally}>"

    @property
    def tally(self) -> dict[str, int]:
        """How many runs ended with each outcome."""
        names, counts = np.unique(self.columns["outcome"], return_counts=True)
        return dict(zip(names.tolist(), counts.tolist(), strict=True))

    def run(self, index: int) -> Run:
        """Simulate one of the runs again, alone and with all that it leaves behind.

        Raises `ParameterError` for a number that no run has.
        """
        if not -len(self) <= index < len(self):
            raise ParameterError(f"there is no run {index}", f"give 0 to {len(self) - 1}")
        return simulate(self.cases.one(index), strides=self.strides, tolerance=self.tolerance)


def simulate_many(
    model: Model,
    states: Mapping[str, ArrayLike] | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    strides: int = 1,
    tolerance: float = DEFAULT_TOLERANCE,
    processes: int = 1,
    progress: Callable[[float], None] | None = None,
) -> Ensemble:
    """Simulate ``strides`` strides of many animals at once, each from its own apex.

    ``states`` are apex coordinates by name, ``parameters`` parameters by dotted name and
    ``touchdown.fore``, ``touchdown.hind``: numbers, or arrays of one value a run; what is not
    given is the model's. SI and radians. Events, outcomes and results are those of `simulate`,
    save that a body that starts in the ground has fallen there. ``processes`` share the work
    without a change to the results; ``progress`` is told the share that is done, 0 to 1. Raises
    `UnknownNameError` and `ParameterError`.

    >>> from flexspine import load_model, simulate_many
    >>> runs = simulate_many(load_model("slip"), {"height": [0.9, 1.0, 1.1]}, strides=5)
    >>> runs["strides"]
    array([0, 1, 3])
    """
    for given in (states, parameters):
        if not (given is None or isinstance(given, Mapping)):
            raise ParameterError(
                f"{shortened(given)} does not tell what varies", 'give {"height": [...], ...}'
            )
    cases = make_cases(model, {**(states or {}), **(parameters or {})})
    parts = [slice(at, at + PIECE) for at in range(0, len(cases), PIECE)]
    pieces = []
    workers = min(check_count("processes", processes), len(parts))
    for piece in _stream(map(cases.piece, parts), strides, tolerance, workers):
        pieces.append(piece.columns)
        if progress is not None:
            progress(len(pieces) / len(parts))
    columns = {name: np.concatenate([p[name] for p in pieces]) for name in pieces[0]}
    return Ensemble(cases, strides, tolerance, columns)


def stream_many(
    model: Model,
    batches: Iterable[Mapping[str, ArrayLike]],
    *,
    strides: int = 1,
    tolerance: float = DEFAULT_TOLERANCE,
    processes: int = 1,
) -> Iterator[Ensemble]:
    """Simulate batch after batch, an `Ensemble` each.

    A batch maps names to values as ``states`` and ``parameters`` of `simulate_many` do. Batches are
    taken as they are needed and given back in order, so that memory does not grow with their
    number. Raises as `simulate_many`.
    """
    return _stream((make_cases(model, b) for b in batches), strides, tolerance, processes)


def _stream(
    batches: Iterable[Cases], strides: int, tolerance: float, processes: int
) -> Iterator[Ensemble]:
    """Check what is asked for at once, and do it when it is wanted."""
    check_between("tolerance", tolerance, *TOLERANCES)
    workers = LocalWorkers(check_count("processes", processes))
    return _in_order(batches, check_count("strides", strides), tolerance, workers)


def _in_order(
    batches: Iterable[Cases], strides: int, tolerance: float, workers: LocalWorkers
) -> Iterator[Ensemble]:
    taken: dict[int, Cases] = {}
    done: dict[int, Columns] = {}

    def jobs() -> Iterator[tuple[int, tuple[Cases, int, float]]]:
        for number, cases in enumerate(batches):
            taken[number] = cases
            yield number, (cases, strides, tolerance)

    with workers as crew:
        following = 0
        for number, columns in crew.map(_run_piece, jobs()):
            done[number] = columns
            while following in done:
                cases = taken.pop(following)
                yield Ensemble(cases, strides, tolerance, done.pop(following))
                following += 1


def make_cases(model: Model, given: Mapping[str, ArrayLike], body: Model | None = None) -> Cases:
    """Check what varies, and make all of it equally long. Raises as `simulate_many`.

    ``body`` is given where there are other cases that have to share a system with these.
    """
    if not isinstance(model, Model):
        raise ParameterError(f"{shortened(model)} is no model", "load one with load_model")
    model.on_flat_ground("many runs at once")
    known = {*model.apex, *model.parameter_names}
    bounds = _bounds(model)
    varied: dict[str, Array] = {}
    for name, value in given.items():
        if name not in known:
            raise UnknownNameError("quantity", name, known)
        try:
            column = np.atleast_1d(np.asarray(value, dtype=float))
        except (TypeError, ValueError):
            raise ParameterError(f"'{name}' is not made of numbers", "give numbers") from None
        if column.ndim != 1 or not column.size:
            raise ParameterError(
                f"'{name}' has shape {column.shape}", "give a number, or one number a run"
            )
        low, high, wanted = bounds[name]
        wrong = np.flatnonzero(~((column >= low) & (column <= high)))
        if wrong.size:
            raise ParameterError(
                f"'{name}' = {shortened(float(column[wrong[0]]))} is not usable", wanted
            )
        varied[name] = column
    if not varied:
        varied = {"height": np.array([model.apex["height"]])}
    longest = max(len(column) for column in varied.values())
    for name, column in varied.items():
        if len(column) not in (1, longest):
            raise ParameterError(
                f"'{name}' has {len(column)} values where others have {longest}",
                "give as many of each, or a single number",
            )
    varied = {name: np.broadcast_to(column, (longest,)) for name, column in varied.items()}
    return Cases(model, varied, body or _with_largest(model, varied))


def _with_largest(model: Model, varied: Mapping[str, Array]) -> Model:
    """A model with every parameter as far from zero as it gets; terms that vanish leave it."""
    known = values(model.parameters)
    largest = {
        name: float(column[np.argmax(np.abs(column))])
        for name, column in varied.items()
        if name in known
    }
    return model.with_values(largest) if largest else model


def _bounds(model: Model) -> dict[str, tuple[float, float, str]]:
    """What each quantity may be: lowest, highest, and how to say it."""
    any_number = (-LARGEST_START, LARGEST_START, f"give a number no larger than {LARGEST_START:g}")
    upright = np.nextafter(pi / 2, 0)
    angle = (-upright, upright, "give an angle from the vertical between -1.57 and 1.57 rad")
    bounds = dict.fromkeys(model.apex, any_number)
    bounds |= dict.fromkeys(ANGLES, angle)
    for item in quantities(type(model.parameters)):
        low = np.nextafter(item.lower, np.inf) if item.lower_is_open else item.lower
        told = f"give a number in {item.told} ({item.meaning})"
        bounds[item.name] = (float(low), item.upper, told)
    return bounds


def _run_piece(work: tuple[Cases, int, float]) -> Columns:
    return run_cases(*work)


def start_energies(cases: Cases) -> Array:
    """Total energy of all cases at their start, in J."""
    model, starts = _starts(cases)
    return _energies(model, starts, starts.states)


def run_cases(cases: Cases, strides: int, tolerance: float) -> Columns:
    """Simulate all cases in this process; returns the columns of an `Ensemble`."""
    model, starts = _starts(cases)
    lanes = compile_lanes(compile_system(model.system, tolerance))
    ends = run_many(lanes, starts, strides)
    return _columns(model, starts, ends)


def _starts(cases: Cases) -> tuple[Model, Starts]:
    """The model whose system serves all cases, and where they start."""
    model, count = cases.body, len(cases)
    start = replace(cases.model, kept=model.features).apex_state()
    states = np.repeat(start.states[:, None], count, axis=1)
    parameters = np.repeat(cases.model.parameter_vector[:, None], count, axis=1)
    coordinates, names = model.system.section.coordinates, model.parameter_names
    for name, column in cases.varied.items():
        if name in coordinates:
            states[model.system.places[coordinates[name]]] = column
        else:
            parameters[names.index(name)] = column
    held = np.repeat(start.held[:, None], count, axis=1)
    return model, Starts(start.mode, states, held, parameters)


def _columns(model: Model, starts: Starts, ends: Ends) -> Columns:
    names, system = np.array([kind.name for kind in ends.outcomes]), model.system
    x, dissipated = (model.state_names.index(n) for n in ("com_x", "dissipated_energy"))
    return {
        "outcome": names[ends.kinds],
        "strides": ends.crossings,
        "duration": ends.time,
        "distance": ends.states[x] - starts.states[x],
        "apex_time": ends.section_time,
        **{
            f"apex_{name}": ends.section_states[system.places[symbol]]
            for name, symbol in system.section.coordinates.items()
        },
        **{
            f"peak_grf_{name.removesuffix('_grf')}": peak
            for name, peak in zip(system.tracked, ends.largest, strict=True)
        },
        "energy_start": _energies(model, starts, starts.states),
        "energy_end": _energies(model, starts, ends.section_states),
        "dissipated": ends.states[dissipated],
    }


def _energies(model: Model, starts: Starts, states: Array) -> Array:
    """Total energy of all cases in flight at these states, in J."""
    quantity, names = section_quantities(model.system), list(model.system.section.quantities)
    values = quantity.many(states, starts.held, starts.parameters)
    found: Array = values[names.index("energy")]
    return found
