"""``flexspine verify engines``: where we and MuJoCo agree, where not, and why."""

from __future__ import annotations

from contextlib import ExitStack
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    DEFAULT_PRESET,
    DEFAULT_ROBOT,
    Json,
    Preset,
    RobotName,
    output_directory,
)
from flexspine.cli.output import print_json, steps

if TYPE_CHECKING:
    from flexspine.studies.pinned_check import PinnedCheck
    from flexspine.studies.replay_check import ReplayCheck
    from flexspine.studies.template_check import TemplateCheck

WHY_REPLAY = (
    "feet that are spheres roll while they stand, which points do not; ground that gives lets them "
    "sink; with small feet on stiff ground what is left are the instants of landing and time steps"
)
WHY_TEMPLATE = (
    "toes have a mass there, which lands and is thrown forward, and the pin that holds them gives; "
    "both shrink with the toe and the step"
)


def engines(
    robot: RobotName = DEFAULT_ROBOT,
    preset: Preset = None,
    seconds: Annotated[float, typer.Option(help="How long the trot is replayed, in s.")] = 2.0,
    out: Annotated[Path | None, output_directory("a figure and a summary")] = None,
    json: Json = False,
) -> int:
    """Set three motions beside MuJoCo's; tell why they differ.

    The robot pinned by a foot and let go; its planar trot replayed by the robot in space that is
    kept to the plane, on ground ever closer to rigid; and one stride of a flexible bounder, whose
    massless legs are ever lighter ones in MuJoCo. Units are SI and radians.

    Exit code 0: all agree as far as they can; 1: they do not; 2: bad input; 3: MuJoCo is missing,
    has a version that will not do, or the machine failed; 130: interrupted.

    Examples:
        flexspine verify engines --out results/engines
    """
    from flexspine.cli.results import ResultDirectory, write_json
    from flexspine.models.model import check_between
    from flexspine.models.presets import load_model
    from flexspine.models.robot_file import load_robot
    from flexspine.report.engines_figure import plot_engines
    from flexspine.studies.pinned_check import check_pinned
    from flexspine.studies.replay_check import check_replay
    from flexspine.studies.template_check import check_template

    interruptible()
    check_between("--seconds", seconds, 0, inf)
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        body, animal = load_robot(robot), load_model(DEFAULT_PRESET if preset is None else preset)
        directory = ResultDirectory.within(stack, out)
        template = check_template(animal, progress=lambda w: progress.begin(f"bounder: {w}"))
        replay = check_replay(
            body, seconds=seconds, progress=lambda w: progress.begin(f"trot: {w}")
        )
        pinned = check_pinned(body, progress=lambda w: progress.begin(f"pinned: {w}"))
        record = _record(pinned, replay, template)
        if directory is not None:
            progress.begin("drawing")
            with directory.stage() as stage:
                plot_engines(pinned, replay, template).savefig(stage / "engines.png")
                write_json(record, stage / "engines.json")
    if json:
        print_json(record)
    else:
        print(_report(record))
        if out is not None:
            print(f"results in {out}")
    return 0 if record["agrees"] else 1


def _record(pinned: PinnedCheck, replay: ReplayCheck, template: TemplateCheck) -> dict[str, Any]:
    from flexspine.engines.installed import mujoco_version
    from flexspine.studies.pinned_check import ALLOWED as ALLOWED_PINNED
    from flexspine.studies.pinned_check import COMPARED
    from flexspine.studies.template_check import ALLOWED as ALLOWED_TEMPLATE

    return {
        **STAMP,
        "mujoco": mujoco_version(),
        "agrees": pinned.agrees and replay.agrees and template.agrees,
        "pinned": {
            "robot": pinned.robot.name,
            "agrees": pinned.agrees,
            "compared_up_to": COMPARED,
            "allowed": ALLOWED_PINNED,
            "cases": [
                {
                    "name": case.name,
                    "steps": list(case.steps),
                    "differences": list(map(_known, case.compared.tolist())),
                    "order": case.order,
                }
                for case in pinned.cases
            ],
        },
        "trot": {
            "robot": replay.run.robot.name,
            "agrees": replay.agrees,
            "seconds": float(replay.motion.times[-1]),
            "why": WHY_REPLAY,
            "grounds": [
                {
                    **vars(case.ground),
                    "outcome": case.replay.outcome.name,
                    **{
                        name: getattr(case, name)
                        for name in (
                            "angle", "spine", "height", "gained", "normal", "mean_normal",
                            "correction",
                        )
                    },
                }
                for case in replay.cases
            ],
        },
        "bounder": {
            "preset": template.model.name,
            "agrees": template.agrees,
            "why": WHY_TEMPLATE,
            "allowed": ALLOWED_TEMPLATE._asdict(),
            "orders": None if template.orders is None else template.orders._asdict(),
            "peaks": template.peaks.tolist(),
            "levels": [
                {
                    **each.level._asdict(),
                    **{name: _known(value) for name, value in each.apart._asdict().items()},
                }
                for each in template.strides
            ],
        },
    }  # fmt: skip


def _known(value: float) -> float | None:
    return value if isfinite(value) else None


def _report(record: dict[str, Any]) -> str:
    """For a person."""
    pinned, trot, bounder = record["pinned"], record["trot"], record["bounder"]
    lines = [
        f"MuJoCo {record['mujoco']}",
        "",
        f"pinned by a foot and let go ({pinned['robot']}): {_verdict(pinned)}",
    ]
    for case in pinned["cases"]:
        order = "order unknown" if case["order"] is None else f"order {case['order']:.2f}"
        lines.append(
            f"  {case['name']}: {_shown(case['differences'][-1])} rad after "
            f"{pinned['compared_up_to']:g} s at steps of {case['steps'][-1]:.2g} s, {order}"
        )
    lines += [
        "",
        f"trot in the plane, replayed for {trot['seconds']:g} s: {_verdict(trot)}",
        "  feet (mm)  ground (N/m)  joints (rad)  CoM height (mm)  ahead (mm)  normal (N)"
        "  mean (%)",
    ]
    lines += [
        f"{1e3 * each['radius']:11.3g}{each['stiffness']:14.3g}{each['angle']:14.2e}"
        f"{1e3 * each['height']:17.3f}{1e3 * each['gained']:12.2f}{each['normal']:12.2f}"
        f"{100 * each['mean_normal']:10.2f}"
        for each in trot["grounds"]
    ]
    lines += [
        f"  {trot['why']}",
        "",
        f"one stride of the bounder ({bounder['preset']}): {_verdict(bounder)}",
        "  step (ms)  toe (share)  CoM (m)  segments (rad)  contacts (s)  peak force (relative)",
    ]
    lines += [
        f"{1e3 * each['step']:11.4g}{each['share']:13.3g}  {_shown(each['place'])}"
        f"{_shown(each['angle']):>16}{_shown(each['contact']):>14}{_shown(each['peak']):>14}"
        for each in bounder["levels"]
    ]
    if bounder["orders"] is not None:
        told = ", ".join(f"{name} {order:.2f}" for name, order in bounder["orders"].items())
        lines.append(f"  orders: {told}")
    lines.append(f"  {bounder['why']}")
    return "\n".join(lines)


def _verdict(part: dict[str, Any]) -> str:
    return "AGREES" if part["agrees"] else "DOES NOT AGREE"


def _shown(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"
