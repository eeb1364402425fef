"""Walks in sweeps and in a search: through the machinery that bounders go through."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexspine import load_robot, rerun, sweep
from flexspine.control.gains import load_walk
from flexspine.engines.space_measures import SpaceSummary, summarize_space
from flexspine.engines.space_run import run_in_space
from flexspine.errors import InputError, OutputError, UnknownNameError
from flexspine.studies.plan import Plan
from flexspine.studies.plan_file import read_plan
from flexspine.studies.store import read_plan_of
from flexspine.studies.tuning import NoWalkError, Tuning, cost, tune, walk_file
from flexspine.studies.walkers import Walker

PLAN = """
robot = "sc618"
task = "walks"
gait = "trot"
spine = ["flexible", "locked"]
seed = 4

[options]
seconds = 0.9
sensing = 0.004

[axes]
"gait.speed" = [0.3, 0.45]
"spine.stiffness" = [60, 480]
"""


def plan(folder: Path, text: str = PLAN) -> Plan:
    (folder / "plan.toml").write_text(text)
    return read_plan(folder / "plan.toml")


def test_every_point_is_a_walk_with_its_numbers(tmp_path: Path) -> None:
    done = sweep(plan(tmp_path), tmp_path / "rows-of-it")
    assert (done.rows, dict(done.outcomes)) == (8, {"completed": 8})
    table = pd.read_parquet(tmp_path / "rows-of-it" / "rows")
    flexible = table[table["model"] == "sc618-trot"].sort_values("point")
    assert flexible["at_spine_stiffness"].tolist() == [60, 480] * 2
    assert flexible["at_gait_speed"].tolist() == [0.3] * 2 + [0.45] * 2
    # A locked spine has no stiffness to vary.
    stiff = table[table["model"] == "sc618-trot-locked"]
    assert stiff["at_spine_stiffness"].isna().all()
    assert stiff["spine"].isna().all()
    # The same walk by itself: the seed is that of the point.
    seed = int(np.random.SeedSequence((4, 3)).generate_state(1)[0])
    run = run_in_space(
        load_robot("sc618", {"spine.stiffness": 480.0}),
        load_walk("trot", "sc618").with_values({"gait.speed": 0.45}),
        0.9, sensing=0.004, seed=seed,
    )  # fmt: skip
    summary, row = summarize_space(run), flexible.iloc[3]
    for name in ("speed", "peak_normal", "cost_of_transport", "deepest"):
        assert row[name] == getattr(summary, name), name


def test_a_plan_of_walks_comes_back_from_its_manifest_and_is_repeated(tmp_path: Path) -> None:
    ours = plan(tmp_path)
    assert Plan.revive(ours.record()).key == ours.key
    few = PLAN.replace("[60, 480]", "[60]").replace("[0.3, 0.45]", "[0.3]")
    sweep(plan(tmp_path, few), tmp_path / "there")
    assert rerun(tmp_path / "there").same
    theirs = read_plan_of(tmp_path / "there")
    assert (
        theirs.walkers[0].numbers["servo.stiffness"] == ours.walkers[0].numbers["servo.stiffness"]
    )
    assert theirs.walkers[1].robot.linkage.size == 11
    with pytest.raises(InputError, match="another configuration"):
        sweep(ours, tmp_path / "there")


BAD = {
    "no robot": (PLAN.replace('robot = "sc618"\n', ""), "there is no 'robot'"),
    "a model": ('model = "scout2"\n' + PLAN, "'model' is not for this task"),
    "a robot that bounds": (PLAN.replace('task = "walks"\n', ""), "there is no 'model'"),
    "an unknown gait": (PLAN.replace('"trot"', '"amble"'), "amble"),
    "an unknown spine": (PLAN.replace('"locked"', '"soft"'), "soft"),
    "an unknown axis": (PLAN.replace("gait.speed", "gait.sped"), "did you mean 'gait.speed'"),
    "an axis beyond bounds": (PLAN.replace("[0.3, 0.45]", "[0.3, 45]"), "speed"),
    "an unknown option": (PLAN.replace("seconds", "strides"), "strides"),
    "no time": (PLAN.replace("seconds = 0.9", "seconds = 0"), "seconds = 0"),
    "much noise": (PLAN.replace("sensing = 0.004", "sensing = 4"), "sensing = 4"),
    "a tolerance": (PLAN.replace("sensing = 0.004", "tolerance = 1e-9"), "tolerance"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_plan_that_cannot_be_done_is_refused(tmp_path: Path, case: str) -> None:
    text, told = BAD[case]
    with pytest.raises(InputError) as raised:
        plan(tmp_path, text)
    assert told in str(raised.value)


def test_walkers_change_by_dotted_name() -> None:
    walker = Walker("one", load_robot("sc618"), load_walk("trot", "sc618"))
    changed = walker.with_values({"spine.stiffness": 10.0, "gait.duty": 0.6})
    assert (changed.numbers["spine.stiffness"], changed.numbers["gait.duty"]) == (10.0, 0.6)
    assert walker.numbers["spine.stiffness"] == 240.0
    assert walker.with_locked_spine().name == "one-locked"
    beyond = walker.with_values({"gait.height": 0.45}).row(0.5, 0.0, 0)
    assert beyond["outcome"] == "refused"
    assert "out of reach" in beyond["reason"]


def search(store: Path | None = None, seed: int = 1) -> Tuning:
    return tune(
        load_robot("sc618"), "trot", 0.4, seconds=1.0, draws=3, rounds=2, children=1, seed=seed,
        store=store,
    )  # fmt: skip


def test_a_search_repeats_goes_on_and_gets_no_worse(tmp_path: Path) -> None:
    store = tmp_path / "kept.jsonl"
    whole = search(store)
    assert whole.tried == 3 + 2 * 1
    assert list(whole.history) == sorted(whole.history, reverse=True)
    assert whole.cost == whole.history[-1]
    # What is kept of a search that was interrupted is not tried again, and changes nothing.
    lines = store.read_text().splitlines(keepends=True)
    store.write_text("".join(lines[:4]))
    again = search(store)
    assert again.walk.gains == whole.walk.gains
    assert store.read_text().splitlines(keepends=True)[:4] == lines[:4]
    with pytest.raises(OutputError, match="other settings"):
        search(store, seed=2)
    (tmp_path / "walk.toml").write_text(walk_file(whole))
    assert load_walk(tmp_path / "walk.toml", "any").gains == whole.walk.gains


def test_falls_cost_more_than_any_walk_that_lasts() -> None:
    nothing = dict.fromkeys(SpaceSummary.__dataclass_fields__)
    known = {
        "speed": 0.4, "cost_of_transport": 0.5, "peak_normal": 400.0, "impact": 200.0,
        "roll": 0.02, "turning": -0.01, "error": 0.03,
    }  # fmt: skip
    fell, walked = SpaceSummary(**nothing), SpaceSummary(**{**nothing, **known})  # type: ignore
    # 10 (0 + 0.02 + 0.01 + 0.03) + 0.5 + 600 / 200
    assert cost(walked, 1.0, 0.4, 200.0) == pytest.approx(0.6 + 0.5 + 3.0)
    # Half the wanted speed: ten times a half more.
    assert cost(walked, 1.0, 0.8, 200.0) == pytest.approx(0.6 + 0.5 + 3.0 + 5.0)
    assert cost(fell, 0.9, 0.4, 200.0) > cost(walked, 1.0, 90.0, 200.0)
    assert cost(fell, 0.2, 0.4, 200.0) > cost(fell, 0.9, 0.4, 200.0)


def test_a_search_for_what_cannot_be_is_refused() -> None:
    robot = load_robot("sc618")
    with pytest.raises(UnknownNameError, match="canter"):
        tune(robot, "canter")
    with pytest.raises(InputError, match="draws"):
        tune(robot, "trot", draws=0)
    heavy = load_robot("sc618", {"gravity": 200.0})
    with pytest.raises(NoWalkError, match="none of 3 walks lasted"):
        tune(heavy, "trot", seconds=0.6, draws=2, rounds=1, children=1)
