"""flexspine: bounding quadrupeds with a rigid or a flexible spine.

What is named in ``__all__`` is the public API; it is loaded when first used, so that importing
flexspine costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from flexspine._version import __version__

if TYPE_CHECKING:
    from flexspine.control.cpg import Cpg, Rhythm, rhythm
    from flexspine.control.distribution import Aim, Distribution, ForceFamily, force_family
    from flexspine.control.gains import Walk, load_walk, walk_names
    from flexspine.control.leg_function import standing
    from flexspine.control.spine_comparison import SpineComparison, compare_spines
    from flexspine.control.stabilize import Stabilizer, stabilize
    from flexspine.control.steering import Noise, SteeredRun, Steering, steer
    from flexspine.control.trot import Trot, trot
    from flexspine.control.walk_measures import WalkSummary, summarize_walk
    from flexspine.control.walk_plan import Pace
    from flexspine.engines.space_dataset import space_dataset
    from flexspine.engines.space_measures import SpaceSummary, summarize_space
    from flexspine.engines.space_run import SpaceRun, run_in_space
    from flexspine.errors import (
        FlexspineError,
        InputError,
        MachineError,
        OutputError,
        ParameterError,
        PresetError,
        StateError,
        UnknownNameError,
    )
    from flexspine.gaits.continuation import Branch, trace_branch
    from flexspine.gaits.family import BranchPoint
    from flexspine.gaits.files import load_gait, save_gait
    from flexspine.gaits.gait import Gait, examine
    from flexspine.gaits.landmarks import Landmark
    from flexspine.gaits.measures import Summary, summarize
    from flexspine.gaits.return_map import ReturnMap, stride_map
    from flexspine.gaits.search import Search, find_gaits
    from flexspine.gaits.stability import Stability, floquet_multipliers
    from flexspine.gaits.switching import switch_branch
    from flexspine.hybrid.outcome import Outcome
    from flexspine.models.dataset import to_dataset
    from flexspine.models.ground import Ground
    from flexspine.models.many import Ensemble, simulate_many, stream_many
    from flexspine.models.model import Model, Source
    from flexspine.models.presets import load_model, preset_names
    from flexspine.models.robot import Robot
    from flexspine.models.robot_file import load_robot, robot_names
    from flexspine.models.robot_run import RobotRun, robot_dataset
    from flexspine.models.simulation import Run, simulate
    from flexspine.report.animation import animate, strip
    from flexspine.report.basin_figure import plot_basin
    from flexspine.report.coordinates_figure import plot_coordinates
    from flexspine.report.document import write_report
    from flexspine.report.engines_figure import plot_engines
    from flexspine.report.figure import plot_run
    from flexspine.report.map_figure import plot_map
    from flexspine.report.pareto_figure import plot_fronts
    from flexspine.report.pinned_figure import plot_pinned
    from flexspine.report.robot_figure import plot_robot
    from flexspine.report.robustness_figure import plot_robustness
    from flexspine.report.walks_figure import plot_walks
    from flexspine.studies.axes import Axis
    from flexspine.studies.basin import Basin, basin_plan, read_basins
    from flexspine.studies.front_record import front_record
    from flexspine.studies.gait_map import GaitMap, map_plan, read_map
    from flexspine.studies.limits import find_limits
    from flexspine.studies.optimise import NoGaitError, Optimisation, optimise
    from flexspine.studies.pinned_check import PinnedCheck, check_pinned
    from flexspine.studies.plan import Plan
    from flexspine.studies.plan_file import read_plan
    from flexspine.studies.replay_check import ReplayCheck, check_replay
    from flexspine.studies.robustness import Robustness, survive
    from flexspine.studies.sweep import Rerun, Sweep, rerun, sweep
    from flexspine.studies.template_check import TemplateCheck, check_template
    from flexspine.studies.tuning import NoWalkError, Tuning, tune
    from flexspine.studies.walk_map import WalkMap, read_walks, walk_plan
    from flexspine.studies.walkers import Walker
    from flexspine.studies.wayfaring import Terrain, Wayfaring, distance_to_fall

_HOMES = {
    "Aim": "control.distribution",
    "Axis": "studies.axes",
    "Basin": "studies.basin",
    "Branch": "gaits.continuation",
    "BranchPoint": "gaits.family",
    "Cpg": "control.cpg",
    "Distribution": "control.distribution",
    "Ensemble": "models.many",
    "FlexspineError": "errors",
    "ForceFamily": "control.distribution",
    "Gait": "gaits.gait",
    "GaitMap": "studies.gait_map",
    "Ground": "models.ground",
    "InputError": "errors",
    "Landmark": "gaits.landmarks",
    "MachineError": "errors",
    "Model": "models.model",
    "NoGaitError": "studies.optimise",
    "NoWalkError": "studies.tuning",
    "Noise": "control.steering",
    "Optimisation": "studies.optimise",
    "Outcome": "hybrid.outcome",
    "OutputError": "errors",
    "Pace": "control.walk_plan",
    "ParameterError": "errors",
    "PinnedCheck": "studies.pinned_check",
    "Plan": "studies.plan",
    "PresetError": "errors",
    "ReplayCheck": "studies.replay_check",
    "Rerun": "studies.sweep",
    "ReturnMap": "gaits.return_map",
    "Rhythm": "control.cpg",
    "Robot": "models.robot",
    "RobotRun": "models.robot_run",
    "Robustness": "studies.robustness",
    "Run": "models.simulation",
    "Search": "gaits.search",
    "Source": "models.model",
    "SpaceRun": "engines.space_run",
    "SpaceSummary": "engines.space_measures",
    "SpineComparison": "control.spine_comparison",
    "Stability": "gaits.stability",
    "Stabilizer": "control.stabilize",
    "StateError": "errors",
    "SteeredRun": "control.steering",
    "Steering": "control.steering",
    "Summary": "gaits.measures",
    "Sweep": "studies.sweep",
    "TemplateCheck": "studies.template_check",
    "Terrain": "studies.wayfaring",
    "Trot": "control.trot",
    "Tuning": "studies.tuning",
    "UnknownNameError": "errors",
    "Walk": "control.gains",
    "WalkMap": "studies.walk_map",
    "WalkSummary": "control.walk_measures",
    "Walker": "studies.walkers",
    "Wayfaring": "studies.wayfaring",
    "animate": "report.animation",
    "basin_plan": "studies.basin",
    "check_pinned": "studies.pinned_check",
    "check_replay": "studies.replay_check",
    "check_template": "studies.template_check",
    "compare_spines": "control.spine_comparison",
    "distance_to_fall": "studies.wayfaring",
    "examine": "gaits.gait",
    "find_gaits": "gaits.search",
    "find_limits": "studies.limits",
    "floquet_multipliers": "gaits.stability",
    "force_family": "control.distribution",
    "front_record": "studies.front_record",
    "load_gait": "gaits.files",
    "load_model": "models.presets",
    "load_robot": "models.robot_file",
    "load_walk": "control.gains",
    "map_plan": "studies.gait_map",
    "optimise": "studies.optimise",
    "plot_basin": "report.basin_figure",
    "plot_coordinates": "report.coordinates_figure",
    "plot_engines": "report.engines_figure",
    "plot_fronts": "report.pareto_figure",
    "plot_map": "report.map_figure",
    "plot_pinned": "report.pinned_figure",
    "plot_robot": "report.robot_figure",
    "plot_robustness": "report.robustness_figure",
    "plot_run": "report.figure",
    "plot_walks": "report.walks_figure",
    "preset_names": "models.presets",
    "read_basins": "studies.basin",
    "read_map": "studies.gait_map",
    "read_plan": "studies.plan_file",
    "read_walks": "studies.walk_map",
    "rerun": "studies.sweep",
    "rhythm": "control.cpg",
    "robot_dataset": "models.robot_run",
    "robot_names": "models.robot_file",
    "run_in_space": "engines.space_run",
    "save_gait": "gaits.files",
    "simulate": "models.simulation",
    "simulate_many": "models.many",
    "space_dataset": "engines.space_dataset",
    "stabilize": "control.stabilize",
    "standing": "control.leg_function",
    "steer": "control.steering",
    "stream_many": "models.many",
    "stride_map": "gaits.return_map",
    "strip": "report.animation",
    "summarize": "gaits.measures",
    "summarize_space": "engines.space_measures",
    "summarize_walk": "control.walk_measures",
    "survive": "studies.robustness",
    "sweep": "studies.sweep",
    "switch_branch": "gaits.switching",
    "to_dataset": "models.dataset",
    "trace_branch": "gaits.continuation",
    "trot": "control.trot",
    "tune": "studies.tuning",
    "walk_names": "control.gains",
    "walk_plan": "studies.walk_map",
    "write_report": "report.document",
}

__all__ = [
    "Aim",
    "Axis",
    "Basin",
    "Branch",
    "BranchPoint",
    "Cpg",
    "Distribution",
    "Ensemble",
    "FlexspineError",
    "ForceFamily",
    "Gait",
    "GaitMap",
    "Ground",
    "InputError",
    "Landmark",
    "MachineError",
    "Model",
    "NoGaitError",
    "NoWalkError",
    "Noise",
    "Optimisation",
    "Outcome",
    "OutputError",
    "Pace",
    "ParameterError",
    "PinnedCheck",
    "Plan",
    "PresetError",
    "ReplayCheck",
    "Rerun",
    "ReturnMap",
    "Rhythm",
    "Robot",
    "RobotRun",
    "Robustness",
    "Run",
    "Search",
    "Source",
    "SpaceRun",
    "SpaceSummary",
    "SpineComparison",
    "Stability",
    "Stabilizer",
    "StateError",
    "SteeredRun",
    "Steering",
    "Summary",
    "Sweep",
    "TemplateCheck",
    "Terrain",
    "Trot",
    "Tuning",
    "UnknownNameError",
    "Walk",
    "WalkMap",
    "WalkSummary",
    "Walker",
    "Wayfaring",
    "__version__",
    "animate",
    "basin_plan",
    "check_pinned",
    "check_replay",
    "check_template",
    "compare_spines",
    "distance_to_fall",
    "examine",
    "find_gaits",
    "find_limits",
    "floquet_multipliers",
    "force_family",
    "front_record",
    "load_gait",
    "load_model",
    "load_robot",
    "load_walk",
    "map_plan",
    "optimise",
    "plot_basin",
    "plot_coordinates",
    "plot_engines",
    "plot_fronts",
    "plot_map",
    "plot_pinned",
    "plot_robot",
    "plot_robustness",
    "plot_run",
    "plot_walks",
    "preset_names",
    "read_basins",
    "read_map",
    "read_plan",
    "read_walks",
    "rerun",
    "rhythm",
    "robot_dataset",
    "robot_names",
    "run_in_space",
    "save_gait",
    "simulate",
    "simulate_many",
    "space_dataset",
    "stabilize",
    "standing",
    "steer",
    "stream_many",
    "stride_map",
    "strip",
    "summarize",
    "summarize_space",
    "summarize_walk",
    "survive",
    "sweep",
    "switch_branch",
    "to_dataset",
    "trace_branch",
    "trot",
    "tune",
    "walk_names",
    "walk_plan",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'flexspine' has no attribute '{name}'")
    return getattr(import_module(f"flexspine.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
