"""``flexspine verify``: what we compute against engines that others wrote."""

from __future__ import annotations

from contextlib import ExitStack
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    DEFAULT_ROBOT,
    Assignments,
    Json,
    RobotName,
    numbers,
    output_directory,
)
from flexspine.cli.output import Steps, print_json, steps
from flexspine.cli.verify_engines import engines

if TYPE_CHECKING:
    from flexspine.studies.pinned_check import PinnedCase, PinnedCheck

app = typer.Typer(help="Compare our motions with MuJoCo's (extra engine).", no_args_is_help=True)


@app.callback()
def _group() -> None:
    pass


app.command("engines")(engines)


@app.command("pinned")
def pinned(
    robot: RobotName = DEFAULT_ROBOT,
    foot: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="The foot that is pinned.",
            show_default="the robot's first",
            autocompletion=completion.feet,
        ),
    ] = None,
    set_: Assignments = None,
    seconds: Annotated[
        float | None,
        typer.Option(help="How long it swings, in s, from 0.5 on.", show_default="1"),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(
            help="MuJoCo's largest step, in s; of four more each is half the last.",
            show_default="5e-4",
        ),
    ] = None,
    out: Annotated[Path | None, output_directory("a figure, a table and a summary")] = None,
    json: Json = False,
) -> int:
    """Pin a robot by one foot, let it go, and compare with MuJoCo.

    Motors are limp, there is no ground, and springs act, first without dampers and then with those
    that the robot has. It starts at rest in a crouch: a level trunk and bent knees. The angles of
    all links have to agree to 1e-6 rad up to 0.5 s at MuJoCo's smallest step, and the difference
    has to shrink with the fourth power of the step. Units are SI and radians.

    Exit code 0: they agree; 1: they do not, or the order cannot be told; 2: bad input; 3: MuJoCo is
    missing, has a version that will not do, or the machine failed; 130: interrupted.

    Examples:
        flexspine verify pinned --out results/pinned

        flexspine verify pinned --foot toe_3 --set spine.stiffness=300 --json
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.models.robot_file import load_robot
    from flexspine.studies.pinned_check import SECONDS, STEP, check_pinned

    interruptible()
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        directory = ResultDirectory.within(stack, out)
        check = check_pinned(
            load_robot(robot, numbers("--set", set_)),
            foot,
            seconds=SECONDS if seconds is None else seconds,
            step=STEP if step is None else step,
            progress=progress.begin,
        )
        if directory is not None:
            with directory.stage() as stage:
                _write(stage, check, progress)
    if json:
        print_json(_record(check))
    else:
        print(_report(check))
        if out is not None:
            print(f"results in {out}")
    return 0 if check.agrees else 1


def _write(stage: Path, check: PinnedCheck, progress: Steps) -> None:
    from flexspine.cli.results import write_json
    from flexspine.report.pinned_figure import plot_pinned
    from flexspine.studies.tables import write_table

    progress.begin("drawing")
    plot_pinned(check).savefig(stage / "pinned.png")
    write_table([row for case in check.cases for row in _rows(case)], stage / "pinned.csv")
    write_json(_record(check), stage / "summary.json")


def _rows(case: PinnedCase) -> list[dict[str, Any]]:
    """A row a time: our energies in J, and the differences in rad by step."""
    energies = case.energies
    names = [f"difference_at_step_{step:.9g}" for step in case.steps]
    return [
        {
            "case": case.name,
            "time": float(time),
            **{name: float(values[i]) for name, values in energies._asdict().items()},
            **dict(zip(names, case.differences[:, i].tolist(), strict=True)),
        }
        for i, time in enumerate(case.times)
    ]


def _record(check: PinnedCheck) -> dict[str, Any]:
    from flexspine.engines.installed import mujoco_version
    from flexspine.studies.pinned_check import ALLOWED, COMPARED, ORDERS

    return {
        **STAMP,
        "mujoco": mujoco_version(),
        "robot": check.robot.name,
        "foot": check.foot,
        "parameters": dict(check.robot.numbers),
        "seconds": float(check.cases[0].times[-1]),
        "compared_up_to": COMPARED,
        "allowed_difference": ALLOWED,
        "allowed_orders": list(ORDERS),
        "agrees": check.agrees,
        "cases": [
            {
                "name": case.name,
                "agrees": case.agrees,
                "order": case.order,
                "differences": [
                    {"step": step, "difference": found if isfinite(found) else None}
                    for step, found in zip(case.steps, case.compared.tolist(), strict=True)
                ],
                "energy": [
                    {"time": time, **found, "imbalance": off} for time, found, off in _balance(case)
                ],
                "largest_kinetic_energy": float(case.energies.kinetic.max()),
                "largest_imbalance": float(abs(case.imbalance).max()),
            }
            for case in check.cases
        ],
    }


def _balance(case: PinnedCase) -> list[tuple[float, dict[str, float], float]]:
    """Our energies at the start, in the middle and at the end: time, each by name, imbalance."""
    return [
        (
            float(case.times[i]),
            {name: float(values[i]) for name, values in case.energies._asdict().items()},
            float(case.imbalance[i]),
        )
        for i in (0, len(case.times) // 2, len(case.times) - 1)
    ]


def _report(check: PinnedCheck) -> str:
    """For a person."""
    from flexspine.engines.installed import mujoco_version

    lines = [
        f"{check.robot.name} pinned by {check.foot} and let go from a crouch, motors limp; "
        f"MuJoCo {mujoco_version()}, RK4"
    ]
    for case in check.cases:
        lines += ["", case.name, *_agreement(case)]
        lines.append("  time (s)   kinetic (J)   potential   dissipated   imbalance")
        lines += [
            f"{time:10.3g}{found['kinetic']:14.6f}{found['potential']:12.6f}"
            f"{found['dissipated']:13.6f}{off:12.1e}"
            for time, found, off in _balance(case)
        ]
    return "\n".join(lines)


def _agreement(case: PinnedCase) -> list[str]:
    """Differences by step, and what follows from them."""
    from flexspine.studies.pinned_check import ALLOWED, COMPARED, ORDERS

    low, high = ORDERS
    verdict = "AGREES" if case.agrees else "DOES NOT AGREE"
    order = f"order {case.order:.2f}" if case.order is not None else "order cannot be told"
    if case.order is None and case.close:
        verdict = "NOT DECIDED, try a larger --step"
    return [
        f"  MuJoCo's step (s)   largest difference up to {COMPARED:g} s (rad)",
        *(f"{s:19.4g}{found:22.2e}" for s, found in zip(case.steps, case.compared, strict=True)),
        f"  {order} ({low:g} to {high:g} wanted), {case.compared[-1]:.1e} rad at the smallest step "
        f"(at most {ALLOWED:g} wanted): {verdict}",
    ]
