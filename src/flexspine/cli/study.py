"""``flexspine study``: rigid against flexible spine, the published comparison done again."""

from __future__ import annotations

import re
import shutil
import sys
import textwrap
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import Json, check_number, output_directory, span
from flexspine.cli.output import Steps, print_json, steps
from flexspine.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from flexspine.gaits.continuation import Branch
    from flexspine.studies.damping import DampingStudy
    from flexspine.studies.spines import Setting, SpineStudy
    from flexspine.studies.verdict import Verdict

UNFINISHED = "branches.unfinished"

# What a study of an earlier setting has left.
SAVED = re.compile(r"gait-(published-rigid|locked-spine|flexible)-.*at-.*\.json|.*_over_.*\.png")


def study(
    energy: Annotated[float, typer.Option(help="Total energy of every gait, in J.")] = 290.0,
    height: Annotated[float, typer.Option(help="Apex height of every gait, in m.")] = 0.32,
    stiffness: Annotated[
        list[float] | None,
        typer.Option(
            help="Spine stiffness, in N m/rad; repeat it.", show_default="200, 220, 240, 260"
        ),
    ] = None,
    speeds: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help="Mean speeds, in m/s.")
    ] = "2.4:4.7",
    compare: Annotated[
        list[float] | None,
        typer.Option(
            help="Mean speed, in m/s, of profiles and of sweeps over stiffness; repeat it.",
            show_default="4.0, 4.25, 4.5",
        ),
    ] = None,
    damping: Annotated[
        list[float] | None,
        typer.Option(
            help="Spine damping, in N m s/rad, of sweeps over stiffness that tell what compliance "
            "costs; repeat it.",
            show_default="0.1, 1",
        ),
    ] = None,
    out: Annotated[Path | None, output_directory("tables, figures and verdicts")] = None,
    json: Json = False,
) -> int:
    """Compare rigid, locked and flexible spines: the published study.

    Judges its claims. Follows the gaits of each body over mean speed, and over spine stiffness at
    fixed speeds; damped ones, kept going by an actuator, over damping and over stiffness. With
    --out, a study that was interrupted goes on where it was when the same command is given again.
    Units are SI and radians.

    Exit code 0: done; 2: bad input; 3: the machine failed; 130: interrupted.

    Examples:
        flexspine study --out results

        flexspine study --stiffness 180 --stiffness 300 --speeds 3.8:4.6 --json
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.studies.claims import verdicts
    from flexspine.studies.damping import DampedSetting, study_damping
    from flexspine.studies.damping_claims import damping_verdict
    from flexspine.studies.robot_claims import robot_verdicts
    from flexspine.studies.spines import Setting, study_spines

    interruptible()
    for option, value in (("--energy", energy), ("--height", height)):
        check_number(option, value)
    for option, several in (
        ("--stiffness", stiffness), ("--compare", compare), ("--damping", damping),
    ):  # fmt: skip
        for value in several or ():
            check_number(option, value)
    usual = Setting()
    setting = Setting(
        energy=energy,
        height=height,
        speeds=span("--speeds", speeds),
        stiffnesses=tuple(stiffness or usual.stiffnesses),
        compared=tuple(compare or usual.compared),
    )
    damped = DampedSetting(dampings=tuple(damping or DampedSetting().dampings))
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        directory = ResultDirectory.within(stack, out)
        store = None if out is None else out / UNFINISHED
        begun = store is not None and store.exists()
        if store is not None:
            store.mkdir(exist_ok=True)
            stack.callback(_remove_empty, store)
        try:
            result = study_spines(setting, store, partial(_show, progress))
            damping_result = study_damping(result, damped, store, partial(_show, progress))
            progress.begin("judging the claims")
            judged = [*verdicts(result), damping_verdict(damping_result)]
            progress.begin("judging the claims about the articulated robot")
            judged = sorted([*judged, *robot_verdicts()], key=lambda verdict: verdict.number)
            if directory is not None and store is not None:
                with directory.stage(SAVED) as stage:
                    _write(stage, result, damping_result, judged, progress)
                shutil.rmtree(store)
        except ParameterError:
            if store is not None and not begun:  # what was begun before is none of this study's
                shutil.rmtree(store)
            raise
        except KeyboardInterrupt:
            if store is not None:
                print(
                    f"flexspine: what was found is in '{store}'; the same command goes on from it",
                    file=sys.stderr,
                )
            raise
    if json:
        print_json(_record(result, damping_result, judged))
    else:
        print(_report(judged))
        if out is not None:
            print(f"results in {out}")
    return 0


def _show(progress: Steps, what: str, share: float) -> None:
    progress.begin(what)
    progress.at(share)


def _remove_empty(store: Path) -> None:
    if store.is_dir() and not any(store.iterdir()):
        store.rmdir()


def _write(
    stage: Path,
    result: SpineStudy,
    damping: DampingStudy,
    judged: list[Verdict],
    progress: Steps,
) -> None:
    from flexspine.cli.results import write_json
    from flexspine.gaits.files import save_gait
    from flexspine.models.dataset import to_dataset
    from flexspine.report import study_figures as figures
    from flexspine.report.damping_figure import plot_damping
    from flexspine.studies import tables

    progress.begin("writing tables")
    gaits, stiffness = tables.gaits_table(result), tables.stiffness_table(result)
    damped = tables.damping_table(damping)
    for name, rows in (
        ("gaits", gaits),
        ("stiffness", stiffness),
        ("damping", damped),
        ("landmarks", tables.landmarks_table(result, damping)),
    ):
        for suffix in ("csv", "parquet"):
            tables.write_table(rows, stage / f"{name}.{suffix}")
    write_json(_record(result, damping, judged), stage / "study.json")
    (stage / "verdicts.md").write_text(_markdown(result.setting, judged), encoding="utf-8")
    compared = sorted(set(result.setting.compared))
    quoted = {name: gait for verdict in judged for name, gait in verdict.runs.items()}
    profiles = {}
    for specimen in result.specimens:
        for speed in compared:
            point = specimen.at(speed)
            if point is not None:
                quoted[specimen.name_at(speed)] = point.gait
                profiles[specimen.label, speed] = to_dataset(point.gait.run)
    for name, gait in quoted.items():
        save_gait(gait, stage / _file(name))
    drawings: dict[str, Callable[[], Figure]] = {
        "peak_grf_over_speed": lambda: figures.plot_peak_grf(gaits, tables.published_readings()),
        "stability_over_speed": lambda: figures.plot_stability_speed(gaits),
    }
    if stiffness:
        drawings |= {
            "stability_over_stiffness": lambda: figures.plot_stability_stiffness(stiffness),
            "peak_grf_over_stiffness": lambda: figures.plot_peak_grf_stiffness(stiffness),
        }
    if damped:
        drawings["damping"] = lambda: plot_damping(damped)
    if profiles:
        fastest = max(speed for _, speed in profiles)
        drawings |= {
            "profiles": lambda: figures.plot_profiles(profiles, compared),
            "energy_shares": lambda: figures.plot_energy_shares(profiles, fastest),
        }
    for number, (name, draw) in enumerate(drawings.items()):
        _show(progress, f"drawing {name}", number / len(drawings))
        draw().savefig(stage / f"{name}.png")


def _file(name: str) -> str:
    return f"gait-{name}.json"


def _record(result: SpineStudy, damping: DampingStudy, judged: list[Verdict]) -> dict[str, Any]:
    setting = result.setting
    return {
        **STAMP,
        "setting": {
            "energy": setting.energy,
            "height": setting.height,
            "speeds": list(setting.speeds),
            "stiffnesses": list(setting.stiffnesses),
            "compared": list(setting.compared),
        },
        "verdicts": [
            {
                "claim": verdict.number,
                "statement": verdict.claim,
                "verdict": verdict.verdict,
                "finding": verdict.finding,
                "numbers": dict(verdict.numbers),
                "command": verdict.command or None,
                "runs": [
                    {"mean_speed": gait.mean_speed, "gait": _file(name)}
                    for name, gait in verdict.runs.items()
                ],
            }
            for verdict in judged
        ],
        "branches": [
            {
                "body": specimen.body,
                "spine_stiffness": specimen.stiffness,
                "gaits": len(specimen.branch.points),
                "ends": _ends(specimen.branch),
            }
            for specimen in result.specimens
        ],
        "sweeps": [
            {
                "mean_speed": sweep.speed,
                "gaits": len(sweep.branch.points),
                "ends": _ends(sweep.branch),
                "next_to_locked": len(sweep.stiff),
            }
            for sweep in result.sweeps
        ],
        "damped": [
            {
                "mean_speed": damped.speed,
                "actuator": damped.actuator,
                damped.other: damped.kept,
                "gaits": len(damped.branch.points),
                "ends": _ends(damped.branch),
            }
            for damped in (*damping.over_damping, *damping.over_stiffness)
        ],
    }


def _ends(branch: Branch) -> list[dict[str, Any]]:
    points = branch.points[0], branch.points[-1]
    return [
        {branch.over: point.value, "reason": reason}
        for point, reason in zip(points, branch.ends, strict=True)
    ]


def _markdown(setting: Setting, judged: list[Verdict]) -> str:
    lines = [
        "# Verdicts",
        "",
        f"Energy {setting.energy:g} J, apex height {setting.height:g} m. Gaits that land on the "
        "fore leg first, symmetric but for damped ones. Peak GRF is the largest magnitude of the "
        "leg force, per pair of legs; k_t is on the relative angle. Two baselines: the rigid body "
        "as published, and the flexible body with its spine locked.",
        "",
    ]
    for verdict in judged:
        lines += [f"## {verdict.number}. {verdict.claim[0].upper()}{verdict.claim[1:]}", ""]
        lines += [f"**{verdict.verdict}**: {verdict.finding}.", ""]
        if verdict.command:
            lines += [f"Repeated by `{verdict.command}`.", ""]
            continue
        runs = ", ".join(f"`{_file(name)}`" for name in verdict.runs) or "none"
        lines += [
            f"Gaits quoted: {runs}; all are in `gaits.csv`, `stiffness.csv` and `damping.csv`.",
            "",
        ]
    return "\n".join(lines)


def _report(judged: list[Verdict]) -> str:
    """The verdicts for a person."""
    lines = []
    for verdict in judged:
        lines.append(f"{verdict.number}. {verdict.claim}: {verdict.verdict.upper()}")
        lines += textwrap.wrap(verdict.finding, 96, initial_indent="   ", subsequent_indent="   ")
    return "\n".join(lines)
