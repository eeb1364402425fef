"""A compiled system with parameter values, ready to be integrated."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexspine.hybrid.compile import Array, CompiledMode, CompiledSystem


class BoundMode:
    """A compiled mode with the numbers of one run."""

    __slots__ = ("_answer", "_inputs", "_n_held", "_n_inputs_held", "_numbers", "code")

    def __init__(self, code: CompiledMode, n_held: int, parameters: Array) -> None:
        self.code = code
        # Code that needs few numbers may not reach as far as all held variables.
        count, inputs = code.numbers.size, code.n_inputs
        self._numbers = np.zeros(count)
        if count > n_held:
            self._numbers[n_held:] = code.coefficients(parameters)[: count - n_held]
        self._inputs = np.zeros(inputs)
        if inputs > n_held:
            self._inputs[n_held:] = parameters[: inputs - n_held]
        self._answer = np.empty(code.n_answers)
        self._n_held = min(n_held, count)
        self._n_inputs_held = min(n_held, inputs)

    def enter(self, time: float, states: Array, held: Array) -> Any:
        """Return the integrator, set to a point of this mode."""
        code = self.code
        if code.owner is not self:
            code.numbers[:] = self._numbers
            code.owner = self
        n = self._n_held
        code.numbers[:n] = held[:n]
        code.state[:] = states
        integrator = code.integrator
        integrator.time = time
        if code.jumps:
            integrator.reset_cooldowns()
        return integrator

    def evaluate(self, states: Array, held: Array) -> Array:
        """Run the event kernel; the array returned is overwritten by the next call."""
        n = self._n_inputs_held
        self._inputs[:n] = held[:n]
        self.code.kernel(states, self._answer, self._inputs)
        return self._answer

    def evaluate_many(self, states: Array, held: Array) -> Array:
        """Run the event kernel at states of shape (k, n); returns shape (answers, k)."""
        n = self._n_inputs_held
        self._inputs[:n] = held[:n]
        return evaluate_columns(self.code.kernel, states, self._inputs)


def evaluate_columns(function: Any, states: Array, parameters: Array) -> Array:
    """Evaluate a compiled function at states of shape (k, n); parameters (p,) or (k, p)."""
    needed = np.broadcast_to(parameters, (len(states), parameters.shape[-1]))
    spread = np.ascontiguousarray(needed[:, : function.nparams].T)
    result: Array = function(np.ascontiguousarray(states.T), pars=spread)
    return result


class BoundSystem:
    """A compiled system with parameter values, ready to be integrated.

    ``parameters`` has shape (number of parameters,), in the order of ``system.parameters``.
    """

    def __init__(self, compiled: CompiledSystem, parameters: Array) -> None:
        self.compiled = compiled
        self.system = compiled.system
        self.parameters = np.asarray(parameters, dtype=float)
        self._modes: dict[str, BoundMode] = {}

    def mode(self, name: str) -> BoundMode:
        """Return the named mode, compiled and bound."""
        bound = self._modes.get(name)
        if bound is None:
            code = self.compiled.mode(name)
            bound = BoundMode(code, len(self.system.held), self.parameters)
            self._modes[name] = bound
        return bound

    def observe(self, mode: str, states: Array, held: Array) -> dict[str, Array]:
        """Evaluate the observables of a mode at states of shape (k, n), each shape (k,).

        ``held`` has shape (m,), or (k, m) if it differs between the states.
        """
        names, function = self.compiled.observables(mode)
        parameters = np.broadcast_to(self.parameters, (*held.shape[:-1], self.parameters.size))
        inputs = np.concatenate([held, parameters], axis=-1)
        return dict(zip(names, evaluate_columns(function, states, inputs), strict=True))
