"""The exceptions that flexspine raises.

    FlexspineError
    ├── InputError              what the caller gave cannot be used        exit code 2
    │   ├── UnknownNameError    no such preset, parameter, model, option
    │   ├── ParameterError      a value of the wrong type or out of bounds
    │   ├── PresetError         a preset, robot, walk or gait that cannot be read
    │   ├── StateError          an initial state that cannot be simulated
    │   └── OutputError         a place that results cannot be written to
    ├── MachineError            the machine failed, such as a full disk    exit code 3
    ├── NoGaitError             nothing to optimise (`flexspine.studies.optimise`)
    └── NoWalkError             no walk lasts (`flexspine.studies.tuning`)

All but the first two kinds end the command line with exit code 1. A run that merely ends badly
(it fell) raises nothing: that is an `Outcome`.
"""

from __future__ import annotations

import errno
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, ClassVar

# What the system says of a full disk: the machine's failure, not the caller's.
OUT_OF_SPACE = (errno.ENOSPC, errno.EDQUOT)


class FlexspineError(Exception):
    """An error with what went wrong and what to do about it, in one line each.

    ``message`` and ``remedy`` are these lines; ``code`` is a short name of its kind, and
    ``exit_code`` what the command line ends with. The base of all errors that flexspine raises.
    """

    code: ClassVar[str] = "error"
    exit_code: ClassVar[int] = 1

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(message, remedy)
        self.message = message
        self.remedy = remedy

    def __reduce__(self) -> tuple[Any, ...]:
        # Subclasses are made of other things; between processes only what is told counts.
        return _again, (type(self), self.message, self.remedy), self.__dict__

    def __str__(self) -> str:
        return f"{self.message}; {self.remedy}"


def _again(kind: type[FlexspineError], message: str, remedy: str) -> FlexspineError:
    error = kind.__new__(kind, message, remedy)
    FlexspineError.__init__(error, message, remedy)
    return error


class InputError(FlexspineError):
    """The caller's input cannot be used; the base of all errors about it. Exit code 2."""

    code = "bad_input"
    exit_code = 2


class UnknownNameError(InputError):
    """A name that is not in a known list; the remedy is the nearest one, or all of them."""

    code = "unknown_name"

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        choices = sorted(known)
        close = get_close_matches(name, choices, n=1, cutoff=0.5)
        remedy = f"did you mean '{close[0]}'?" if close else f"known: {', '.join(choices)}"
        super().__init__(f"unknown {kind} '{name}'", remedy)


class ParameterError(InputError):
    """A parameter value of the wrong type or outside its bounds."""

    code = "bad_parameter"


class PresetError(InputError):
    """A file of a preset, robot, walk or gait that is missing or malformed."""

    code = "bad_preset"


class StateError(InputError):
    """An initial state from which no run can start."""

    code = "bad_state"


class OutputError(InputError):
    """A place that results cannot be written to."""

    code = "bad_output"


class MachineError(FlexspineError):
    """The machine failed: a full disk, workers that died, a missing library. Exit code 3."""

    code = "environment"
    exit_code = 3
