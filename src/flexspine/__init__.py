"""flexspine: bounding quadrupeds with a rigid or a flexible spine.

What is named in ``__all__`` is the public API; it is loaded when first used, so that importing
flexspine costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from flexspine._version import __version__

if TYPE_CHECKING:
    from flexspine.errors import FlexspineError, InputError, MachineError
    from flexspine.gaits.continuation import Branch, trace_branch
    from flexspine.gaits.files import load_gait, save_gait
    from flexspine.gaits.gait import Gait, examine
    from flexspine.gaits.landmarks import Landmark
    from flexspine.gaits.measures import summarize
    from flexspine.gaits.return_map import ReturnMap, stride_map
    from flexspine.gaits.search import Search, find_gaits
    from flexspine.gaits.stability import Stability, floquet_multipliers
    from flexspine.gaits.switching import switch_branch
    from flexspine.models.dataset import to_dataset
    from flexspine.models.many import Ensemble, simulate_many, stream_many
    from flexspine.models.model import Model
    from flexspine.models.presets import load_model, preset_names
    from flexspine.models.robot import Robot
    from flexspine.models.robot_file import load_robot, robot_names
    from flexspine.models.simulation import Run, simulate
    from flexspine.report.animation import animate, strip
    from flexspine.report.basin_figure import plot_basin
    from flexspine.report.figure import plot_run
    from flexspine.report.map_figure import plot_map
    from flexspine.report.pinned_figure import plot_pinned
    from flexspine.studies.basin import Basin, basin_plan, read_basins
    from flexspine.studies.gait_map import GaitMap, map_plan, read_map
    from flexspine.studies.pinned_check import PinnedCheck, check_pinned
    from flexspine.studies.plan import Plan
    from flexspine.studies.plan_file import read_plan
    from flexspine.studies.sweep import Rerun, Sweep, rerun, sweep

_HOMES = {
    "Basin": "studies.basin",
    "Branch": "gaits.continuation",
    "Ensemble": "models.many",
    "FlexspineError": "errors",
    "Gait": "gaits.gait",
    "GaitMap": "studies.gait_map",
    "InputError": "errors",
    "Landmark": "gaits.landmarks",
    "MachineError": "errors",
    "Model": "models.model",
    "PinnedCheck": "studies.pinned_check",
    "Plan": "studies.plan",
    "Rerun": "studies.sweep",
    "ReturnMap": "gaits.return_map",
    "Robot": "models.robot",
    "Run": "models.simulation",
    "Search": "gaits.search",
    "Stability": "gaits.stability",
    "Sweep": "studies.sweep",
    "animate": "report.animation",
    "basin_plan": "studies.basin",
    "check_pinned": "studies.pinned_check",
    "examine": "gaits.gait",
    "find_gaits": "gaits.search",
    "floquet_multipliers": "gaits.stability",
    "load_gait": "gaits.files",
    "load_model": "models.presets",
    "load_robot": "models.robot_file",
    "map_plan": "studies.gait_map",
    "plot_basin": "report.basin_figure",
    "plot_map": "report.map_figure",
    "plot_pinned": "report.pinned_figure",
    "plot_run": "report.figure",
    "preset_names": "models.presets",
    "read_basins": "studies.basin",
    "read_map": "studies.gait_map",
    "read_plan": "studies.plan_file",
    "rerun": "studies.sweep",
    "robot_names": "models.robot_file",
    "save_gait": "gaits.files",
    "simulate": "models.simulation",
    "simulate_many": "models.many",
    "stream_many": "models.many",
    "stride_map": "gaits.return_map",
    "strip": "report.animation",
    "summarize": "gaits.measures",
    "sweep": "studies.sweep",
    "switch_branch": "gaits.switching",
    "to_dataset": "models.dataset",
    "trace_branch": "gaits.continuation",
}

__all__ = [
    "Basin",
    "Branch",
    "Ensemble",
    "FlexspineError",
    "Gait",
    "GaitMap",
    "InputError",
    "Landmark",
    "MachineError",
    "Model",
    "PinnedCheck",
    "Plan",
    "Rerun",
    "ReturnMap",
    "Robot",
    "Run",
    "Search",
    "Stability",
    "Sweep",
    "__version__",
    "animate",
    "basin_plan",
    "check_pinned",
    "examine",
    "find_gaits",
    "floquet_multipliers",
    "load_gait",
    "load_model",
    "load_robot",
    "map_plan",
    "plot_basin",
    "plot_map",
    "plot_pinned",
    "plot_run",
    "preset_names",
    "read_basins",
    "read_map",
    "read_plan",
    "rerun",
    "robot_names",
    "save_gait",
    "simulate",
    "simulate_many",
    "stream_many",
    "stride_map",
    "strip",
    "summarize",
    "sweep",
    "switch_branch",
    "to_dataset",
    "trace_branch",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'flexspine' has no attribute '{name}'")
    return getattr(import_module(f"flexspine.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
