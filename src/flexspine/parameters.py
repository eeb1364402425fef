"""Frozen, validated parameters with unit, bounds and meaning, reached by dotted names.

A model declares its parameters as nested `ParameterSet` classes whose fields are made by
`quantity`. Everything else (the preset listing, ``--set spine.stiffness=240``, provenance in a
result file) works from those declarations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from numbers import Integral, Real
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo

from flexspine.errors import ParameterError, UnknownNameError


@dataclass(frozen=True)
class Quantity:
    """What is declared about one parameter.

    ``lower`` and ``upper`` are bounds in ``unit``; ``lower_is_open`` tells ``>`` from ``>=``.
    Without a ``default`` a value has to be given.
    """

    name: str
    unit: str
    meaning: str
    lower: float
    upper: float
    lower_is_open: bool
    default: float | None

    @property
    def told(self) -> str:
        """The bounds with their unit."""
        return self.bounds if self.unit == "1" else f"{self.bounds} {self.unit}"

    @property
    def bounds(self) -> str:
        """The bounds as an interval, such as ``(0, 1e+06]``."""
        return f"{'(' if self.lower_is_open else '['}{self.lower:g}, {self.upper:g}]"


class ParameterSet(BaseModel):
    """A frozen group of parameters; unknown names, wrong types and NaN are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    def __init__(self, **given: Any) -> None:
        """Take every parameter by name. Raises `ParameterError`."""
        try:
            super().__init__(**given)
        except ValidationError as failure:
            declared = {item.name: item for item in quantities(type(self))}
            raise _explained(failure, declared) from None

    # As pydantic marks its own: groups inside are checked as parts of the whole, by their full
    # names, without this.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]


P = TypeVar("P", bound=ParameterSet)


def quantity(
    unit: str,
    meaning: str,
    *,
    upper: float,
    above: float | None = None,
    at_least: float | None = None,
    default: Any = ...,
) -> Any:
    """Declare one parameter: its unit, what it means and the bounds it must keep."""
    return Field(
        default,
        description=meaning,
        gt=above,
        ge=at_least,
        le=upper,
        allow_inf_nan=False,
        json_schema_extra={"unit": unit},
    )


def quantities(kind: type[ParameterSet], prefix: str = "") -> Iterator[Quantity]:
    """Yield every parameter of a class, nested ones by dotted name, in declared order."""
    for name, field in kind.model_fields.items():
        annotation = field.annotation
        if isinstance(annotation, type) and issubclass(annotation, ParameterSet):
            yield from quantities(annotation, f"{prefix}{name}.")
        else:
            yield _quantity(f"{prefix}{name}", field)


def values(parameters: ParameterSet, prefix: str = "") -> dict[str, float]:
    """Return every value by dotted name, in declared order (SI units, radians)."""
    flat: dict[str, float] = {}
    for name in type(parameters).model_fields:
        value = getattr(parameters, name)
        if isinstance(value, ParameterSet):
            flat |= values(value, f"{prefix}{name}.")
        else:
            flat[f"{prefix}{name}"] = float(value)
    return flat


def build(kind: type[P], flat: Mapping[str, Any]) -> P:
    """Make a parameter set from values by dotted name.

    Raises `UnknownNameError` for a name the model does not have and `ParameterError` for a
    missing value, a wrong type or a value outside its bounds.
    """
    declared = {item.name: item for item in quantities(kind)}
    for name in flat:
        members = [known for known in declared if known.startswith(f"{name}.")]
        if members:
            raise ParameterError(f"'{name}' is a group", f"set one of {', '.join(members)}")
        if name not in declared:
            raise UnknownNameError("parameter", name, declared)
    try:
        return kind.model_validate(nested(flat))
    except ValidationError as failure:
        raise _explained(failure, declared) from None


def replaced(parameters: P, changes: Mapping[str, Any]) -> P:
    """Return the same parameters with some values changed, by dotted name."""
    return build(type(parameters), {**values(parameters), **changes})


def nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Turn ``{"a.b": 1}`` into ``{"a": {"b": 1}}``."""
    tree: dict[str, Any] = {}
    for dotted, value in flat.items():
        *groups, leaf = dotted.split(".")
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        branch[leaf] = value
    return tree


def flattened(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Turn ``{"a": {"b": 1}}`` into ``{"a.b": 1}``.

    Raises `ParameterError` for what is given both ways.
    """
    flat: dict[str, Any] = {}
    for name, value in tree.items():
        dotted = f"{prefix}{name}"
        inner = flattened(value, f"{dotted}.") if isinstance(value, Mapping) else {dotted: value}
        twice = flat.keys() & inner.keys()
        if twice:
            raise ParameterError(f"'{min(twice)}' is given twice", "keep one of them")
        flat |= inner
    return flat


def is_number(value: Any) -> bool:
    """Whether a value is a real number of any kind, NaN included, and no truth value."""
    return isinstance(value, Real) and not isinstance(value, bool)


def is_finite(value: Any) -> bool:
    """Whether a value is a real number, neither infinite nor beyond what a float holds."""
    try:
        return is_number(value) and isfinite(value)
    except OverflowError:
        return False


def shortened(value: Any, most: int = 40) -> str:
    """Return a value as an error message shows it: texts in quotes, nothing too long."""
    try:
        shown = f"'{value}'" if isinstance(value, str) else str(value)
    except ValueError:  # Python writes no whole number of thousands of digits
        shown = "a number of too many digits"
    return shown if len(shown) <= most else f"{shown[:most]}..."


def check_whole(name: str, value: Any, least: int) -> int:
    """Return a whole number from ``least`` on. Raises `ParameterError` for anything else."""
    if not (isinstance(value, Integral) and not isinstance(value, bool) and int(value) >= least):
        raise ParameterError(
            f"{name} = {shortened(value)} is not usable", f"give a whole number from {least} on"
        )
    return int(value)


def check_seed(seed: Any) -> int:
    """Return a seed as a whole number. Raises `ParameterError` for anything but one from 0 on."""
    return check_whole("seed", seed, 0)


def _quantity(name: str, field: FieldInfo) -> Quantity:
    bounds: dict[str, Any] = {}
    for rule in field.metadata:
        for key in ("gt", "ge", "le"):
            if hasattr(rule, key):
                bounds[key] = getattr(rule, key)
    extra = field.json_schema_extra
    return Quantity(
        name=name,
        unit=str(extra["unit"]) if isinstance(extra, dict) else "",
        meaning=field.description or "",
        lower=float(bounds.get("gt", bounds.get("ge", float("-inf")))),
        upper=float(bounds["le"]),
        lower_is_open="gt" in bounds,
        default=None if field.is_required() else float(field.default),
    )


def _dotted(fault: Mapping[str, Any]) -> str:
    """The dotted name of what pydantic finds fault with."""
    return ".".join(str(part) for part in fault["loc"])


def _explained(failure: ValidationError, declared: Mapping[str, Quantity]) -> ParameterError:
    """Say in one line what pydantic says in several; the first fault is the one told."""
    fault = failure.errors()[0]
    name = _dotted(fault)
    if fault["type"] == "missing":
        groups = [_dotted(each) for each in failure.errors() if each["type"] == "missing"]
        absent = [
            known
            for known, about in declared.items()
            if about.default is None and any(f"{known}.".startswith(f"{g}.") for g in groups)
        ]
        if len(absent) > 1:
            return ParameterError(f"parameters {', '.join(absent)} have no value", "give them")
        return ParameterError(
            f"parameter '{absent[0]}' has no value", f"give it, e.g. {absent[0]}=..."
        )
    about = declared[name]
    return ParameterError(
        f"parameter '{name}' = {shortened(fault['input'])} is not usable",
        f"give a number in {about.told} ({about.meaning})",
    )
