"""flexspine: bounding quadrupeds with a rigid or a flexible spine.

What is named in ``__all__`` is the public API; it is loaded when first used, so that importing
flexspine costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from flexspine._version import __version__

if TYPE_CHECKING:
    from flexspine.errors import FlexspineError, InputError, MachineError
    from flexspine.gaits.measures import summarize
    from flexspine.models.dataset import to_dataset
    from flexspine.models.model import Model
    from flexspine.models.presets import load_model, preset_names
    from flexspine.models.simulation import Run, simulate
    from flexspine.report.animation import animate, strip
    from flexspine.report.figure import plot_run

_HOMES = {
    "MachineError": "errors",
    "FlexspineError": "errors",
    "InputError": "errors",
    "Model": "models.model",
    "Run": "models.simulation",
    "animate": "report.animation",
    "load_model": "models.presets",
    "plot_run": "report.figure",
    "preset_names": "models.presets",
    "simulate": "models.simulation",
    "strip": "report.animation",
    "summarize": "gaits.measures",
    "to_dataset": "models.dataset",
}

__all__ = [
    "FlexspineError",
    "InputError",
    "MachineError",
    "Model",
    "Run",
    "__version__",
    "animate",
    "load_model",
    "plot_run",
    "preset_names",
    "simulate",
    "strip",
    "summarize",
    "to_dataset",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'flexspine' has no attribute '{name}'")
    return getattr(import_module(f"flexspine.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
