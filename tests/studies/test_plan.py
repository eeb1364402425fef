"""What a plan may say, what is refused, and that a record of it makes the same plan again."""

from __future__ import annotations

import json
import math
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, event, given, settings
from hypothesis import strategies as st

from flexspine import InputError, Plan, examine, load_model, read_plan, save_gait
from flexspine.parameters import values
from flexspine.studies.axes import Axis

FLEXIBLE, SCOUT = "kamimura2015-flexible", "scout2"

HEAD = f'model = "{FLEXIBLE}"\n'
SPEEDS = "[axes]\nspeed = [4.4, 4.5]\n"


@pytest.fixture
def written(tmp_path: Path) -> Any:
    """Read a plan from a text, as a file in an empty directory."""

    def read(text: str, encoding: str = "utf-8") -> Plan:
        file = tmp_path / "plan.toml"
        file.write_text(text, encoding=encoding)
        return read_plan(file)

    return read


def test_what_is_left_out_is_one_run_at_every_point_of_a_grid(written: Any) -> None:
    plan = written(HEAD + SPEEDS)
    assert (plan.task, plan.method, plan.samples, plan.seed) == ("runs", "grid", None, 0)
    assert [model.name for model in plan.models] == [FLEXIBLE]
    assert plan.points == 2
    assert plan.chunks == 1
    assert plan.tolerance == 1e-12


def test_every_entry_arrives(written: Any) -> None:
    plan = written(
        f"""
        model = ["{FLEXIBLE}", "{SCOUT}"]
        task = "runs"
        method = "sobol"
        samples = 10
        seed = 7
        chunk = 4
        [options]
        strides = 3
        tolerance = 1e-10
        [axes]
        height = {{ around = 0.02 }}
        speed = {{ within = 0.5 }}
        gravity = {{ low = 9.7, high = 9.9 }}
        "touchdown.fore" = [0.45, 0.46]
        """
    )
    assert [model.name for model in plan.models] == [FLEXIBLE, SCOUT]
    assert (plan.method, plan.samples, plan.seed, plan.tolerance) == ("sobol", 10, 7, 1e-10)
    assert plan.options["strides"] == 3
    assert [axis.name for axis in plan.axes] == ["height", "speed", "gravity", "touchdown.fore"]
    chunks = [plan.of_chunk(number) for number in range(plan.chunks)]
    assert [(model.name, first, count) for model, first, count in chunks] == [
        *((FLEXIBLE, first, count) for first, count in [(0, 4), (4, 4), (8, 2)]),
        *((SCOUT, first, count) for first, count in [(0, 4), (4, 4), (8, 2)]),
    ]


def test_dotted_names_may_be_quoted_or_written_as_tables(written: Any) -> None:
    quoted = written(
        HEAD
        + '[set]\n"fore.leg.stiffness" = 6300\n"touchdown.hind" = 0.56\n'
        + '[axes]\n"spine.stiffness" = {low = 200, high = 260, steps = 3}\n'
        + '"fore.leg.damping" = [0.0, 1.0]\n"touchdown.fore" = [0.46]\n'
    )
    nested = written(
        HEAD
        + "[set.fore.leg]\nstiffness = 6300\n[set.touchdown]\nhind = 0.56\n"
        + "[axes.spine.stiffness]\nlow = 200\nhigh = 260\nsteps = 3\n"
        + "[axes.fore.leg]\ndamping = [0, 1]\n[axes]\ntouchdown.fore = [0.46]\n"
    )
    assert {axis.name for axis in quoted.axes} == {
        "spine.stiffness",
        "fore.leg.damping",
        "touchdown.fore",
    }
    assert nested.record() == quoted.record()
    assert nested.points == 6


def test_set_changes_parameters_the_apex_and_touchdown_angles_of_all_models(written: Any) -> None:
    plan = written(
        f'model = ["{FLEXIBLE}", "{SCOUT}"]\n[set]\ngravity = 9\nheight = 0.33\n'
        f"fore.leg.stiffness = 7000.0\ntouchdown.fore = 0.5\n{SPEEDS}"
    )
    for model in plan.models:
        before, after = load_model(model.name).numbers, model.numbers
        changed = {name: after[name] for name in after if after[name] != before[name]}
        assert changed == {
            "gravity": 9,
            "height": 0.33,
            "fore.leg.stiffness": 7000,
            "touchdown.fore": 0.5,
        }


def test_models_are_files_next_to_the_plan(
    written: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever it is read from; TOML files, and gaits that were saved."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    (tmp_path / "soft.toml").write_text(
        f'base = "{FLEXIBLE}"\n[parameters.spine]\nstiffness = 180.0\n'
    )
    gait = examine(load_model(FLEXIBLE))
    save_gait(gait, tmp_path / "fast.json")
    plan = written('model = ["soft.toml", "fast.json"]\n' + SPEEDS)
    soft, fast = plan.models
    assert (soft.name, fast.name) == ("soft", "fast")
    assert values(soft.parameters)["spine.stiffness"] == 180
    assert fast.numbers == gait.model.numbers


def test_a_byte_order_mark_does_not_matter(written: Any) -> None:
    assert written(HEAD + SPEEDS, "utf-8-sig").key == written(HEAD + SPEEDS).key


PLANS = {
    "grid": HEAD + SPEEDS,
    "steps": HEAD + "[axes]\nspeed = {around = 0.1, steps = 3}\n[options]\nstrides = 2",
    "random": HEAD + 'method = "random"\nsamples = 5\nseed = 9\n[axes]\nheight = {within = 0.01}',
    "sobol": f'model = ["{SCOUT}", "{FLEXIBLE}"]\nmethod = "sobol"\nsamples = 5\nchunk = 2\n'
    "[axes]\nfore_pitch = {within = 0.01}\nspine.stiffness = [200, 260]",
    "keeps": HEAD + "[axes]\nspeed = {keeps = 'energy'}\nheight = {within = 0.1, steps = 3}",
    "set": HEAD + "[set]\nspine.damping = 1\ntouchdown.fore = 0.4\nheight = 0.33\n" + SPEEDS,
    "searches": HEAD + 'task = "searches"\n[options]\nstarts = 5\nsymmetric = true\n'
    "fixed = {energy = 290, height = 0.32}\n[axes]\nmean_speed = [4.4]",
    "gaits": HEAD + 'task = "gaits"\n[options]\nover = "mean_speed"\n'
    "[axes]\nspine.stiffness = [200, 260]\nmean_speed = {around = 0.01, steps = 3}",
    "large seed": HEAD + f"seed = {2**63 - 1}\n" + SPEEDS,
}


@pytest.mark.parametrize("text", PLANS.values(), ids=PLANS.keys())
def test_a_record_makes_the_same_plan_again(written: Any, text: str) -> None:
    plan = written(text)
    kept = json.loads(json.dumps(plan.record(), allow_nan=False))
    again = Plan.revive(kept)
    assert again.key == plan.key
    assert again.record() == plan.record()
    assert (again.chunks, again.points) == (plan.chunks, plan.points)
    for number in range(plan.chunks):
        one, other = plan.at(number), again.at(number)
        assert list(one) == list(other)
        # An axis about a value that a model lacks has no values.
        assert all(np.array_equal(one[n], other[n], equal_nan=True) for n in one)


def test_all_that_decides_the_rows_decides_the_key(written: Any) -> None:
    body = 'method = "random"\nsamples = 5\n[axes]\nspeed = {around = 0.1}\n'
    plans = [
        HEAD + body,
        HEAD + "seed = 1\n" + body,
        HEAD + "chunk = 2\n" + body,
        HEAD + body.replace("5", "6"),
        HEAD + body.replace("random", "sobol"),
        HEAD + body.replace("0.1", "0.2"),
        HEAD + body.replace("around", "within"),
        HEAD + body.replace("speed", "height"),
        HEAD + body + "height = {around = 0.1}\n",
        HEAD + body + "[options]\nstrides = 2\n",
        HEAD + body + "[options]\ntolerance = 1e-11\n",
        HEAD + body + "[set]\nspine.stiffness = 259\n",
        HEAD + body + "[set]\ntouchdown.fore = 0.4\n",
        f'model = "{SCOUT}"\n' + body,
        f'model = ["{FLEXIBLE}", "{SCOUT}"]\n' + body,
        f'model = ["{SCOUT}", "{FLEXIBLE}"]\n' + body,
        HEAD.replace('"\n', '"\ntask = "searches"\n') + body,
    ]
    assert len({written(text).key for text in plans}) == len(plans)


def test_how_a_file_is_written_does_not_decide_the_key(written: Any) -> None:
    one = written(HEAD + "seed = 0\n[axes]\nspeed = [4, 5]\n[set]\ngravity = 9\nheight = 0.3")
    other = written(
        f'method = "grid"\ntask = "runs"\nmodel = ["{FLEXIBLE}"]\n'
        "[set]\nheight = 0.3\ngravity = 9.0\n[axes]\nspeed = [4.0, 5.0]\n"
    )
    assert one.key == other.key


def test_an_axis_that_one_of_several_models_has_is_an_axis(written: Any) -> None:
    plan = written(f'model = ["{SCOUT}", "{FLEXIBLE}"]\n[axes]\nfore_pitch = [0.1, 0.2]\n')
    assert plan.points == 2
    with pytest.raises(InputError, match="fore_pitch"):
        written(f'model = "{SCOUT}"\n[axes]\nfore_pitch = [0.1, 0.2]\n')


@pytest.mark.parametrize("method", ["random", "sobol", "grid"])
def test_chunks_hold_every_point_once(written: Any, method: str) -> None:
    few = "steps = 23" if method == "grid" else ""
    top = "" if method == "grid" else "samples = 23\n"
    axis = f"[axes]\nspeed = {{low = 1, high = 2, {few}}}".replace(", }", "}")
    plan = written(HEAD + f'method = "{method}"\nchunk = 5\n{top}{axis}')
    covered = [
        number
        for chunk in range(plan.chunks)
        for _, first, count in [plan.of_chunk(chunk)]
        for number in range(first, first + count)
    ]
    assert covered == list(range(23))
    assert all(len(plan.at(n)["speed"]) == plan.of_chunk(n)[2] for n in range(plan.chunks))


def test_without_a_chunk_a_file_holds_a_piece_of_work_of_any_length(written: Any) -> None:
    """Not one file for a long grid, and not more points than there are."""
    wide = written(HEAD + "[axes]\nspeed = {low = 4, high = 5, steps = 100000}")
    assert 1 < wide.chunks < 1000
    slow = written(HEAD + "[options]\nstrides = 1000000\n[axes]\nspeed = {low=4,high=5,steps=1000}")
    assert slow.chunks > 1
    line = written(HEAD + 'task = "gaits"\n[axes]\ngravity=[9,10]\nmean_speed=[4.4,4.45,4.5]')
    assert (line.chunks, line.chunk_points) == (2, 3)


NUMBER = 10**400
SEARCH, GAITS = HEAD + 'task = "searches"\n', HEAD + 'task = "gaits"\n'
RANDOM = HEAD + 'method = "random"\n'

# A file's text, and what the message has to name.
BAD: dict[str, tuple[str | bytes, str]] = {
    "empty": ("", "model"),
    "no model": (SPEEDS, "model"),
    "no axes": (HEAD, "axes"),
    "empty axes": (HEAD + "[axes]\n", "axis"),
    "no TOML": (HEAD + "speed = = 3", "not valid TOML"),
    "binary": (b"\xff\xfe\x00\x80\x00", "not valid TOML"),
    "a control character": ('model = "\x01"', "not valid TOML"),
    "a number of 5000 digits": (HEAD + f"seed = {'1' * 5000}\n" + SPEEDS, "not valid TOML"),
    "too deep": ("a = " + "[" * 5000, "not valid TOML"),
    "unknown entry": (HEAD + "sed = 3\n" + SPEEDS, "did you mean 'seed'?"),
    "unknown model": ('model = "scot2"\n' + SPEEDS, "did you mean 'scout2'?"),
    "a seed of too many digits": (HEAD + f"seed = 0x{'1' * 5000}\n" + SPEEDS, "seed"),
    "no such file": ('model = "mine.toml"\n' + SPEEDS, "mine.toml"),
    "no such gait": ('model = "mine.json"\n' + SPEEDS, "mine.json"),
    "a name that is too long": (f'model = "{"m" * 300}"\n' + SPEEDS, "mmm"),
    "a file name with a zero": ('model = "mi\\u0000ne.toml"\n' + SPEEDS, "ne.toml"),
    "itself": ('model = "plan.toml"\n' + SPEEDS, "plan.toml"),
    "no models": ("model = []\n" + SPEEDS, "model"),
    "an empty name": ('model = ""\n' + SPEEDS, "''"),
    "a number as model": ("model = 3\n" + SPEEDS, "model"),
    "one model twice": (f'model = ["{SCOUT}", "{SCOUT}"]\n' + SPEEDS, SCOUT),
    "unknown task": (HEAD + 'task = "run"\n' + SPEEDS, "did you mean 'runs'?"),
    "a list as task": (HEAD + "task = []\n" + SPEEDS, "task"),
    "unknown method": (HEAD + 'method = "soboll"\n' + SPEEDS, "did you mean 'sobol'?"),
    "a date as method": (HEAD + "method = 2020-01-01\n" + SPEEDS, "method"),
    "negative seed": (HEAD + "seed = -1\n" + SPEEDS, "seed = -1"),
    "broken seed": (HEAD + "seed = 1.5\n" + SPEEDS, "seed = 1.5"),
    "true as seed": (HEAD + "seed = true\n" + SPEEDS, "seed = True"),
    "chunk 0": (HEAD + "chunk = 0\n" + SPEEDS, "chunk = 0"),
    "chunk as text": (HEAD + 'chunk = "5"\n' + SPEEDS, "chunk = '5'"),
    "samples missing": (RANDOM + "[axes]\nspeed = {around = 0.1}", "samples"),
    "samples 0": (RANDOM + "samples = 0\n[axes]\nspeed = {around = 0.1}", "samples = 0"),
    "broken samples": (RANDOM + "samples = 5.0\n[axes]\nspeed = {around = 0.1}", "samples = 5.0"),
    "samples without end": (RANDOM + f"samples = {NUMBER}\n[axes]\nspeed = {{around = 0.1}}",
                            "give no more than"),
    "more samples than Sobol has": (HEAD + f'method = "sobol"\nsamples = {2**33}\n'
                                    "[axes]\nspeed = {around = 0.1}", "too many"),
    "samples of a grid": (HEAD + "samples = 5\n" + SPEEDS, "samples"),
    "options as list": (HEAD + "options = []\n" + SPEEDS, "options"),
    "set as number": (HEAD + "set = 3\n" + SPEEDS, "set"),
    "axes as list": (HEAD + "[[axes]]\nspeed = [4.4]\n", "axes"),
    "unknown option": (HEAD + SPEEDS + "[options]\nstride = 3", "did you mean 'strides'?"),
    "option of another task": (HEAD + SPEEDS + "[options]\nstarts = 3", "starts"),
    "strides 0": (HEAD + SPEEDS + "[options]\nstrides = 0", "strides = 0"),
    "broken strides": (HEAD + SPEEDS + "[options]\nstrides = 1.5", "strides = 1.5"),
    "true as strides": (HEAD + SPEEDS + "[options]\nstrides = true", "strides = True"),
    "starts 0": (SEARCH + SPEEDS + "[options]\nstarts = 0", "starts = 0"),
    "symmetric as number": (SEARCH + SPEEDS + "[options]\nsymmetric = 1", "symmetric = 1"),
    "fixed as number": (SEARCH + SPEEDS + "[options]\nfixed = 1", "fixed = 1"),
    "fixed as text": (SEARCH + SPEEDS + '[options]\nfixed = {energy = "290"}', "energy"),
    "fixed is no number": (SEARCH + SPEEDS + "[options]\nfixed = {energy = nan}", "energy"),
    "fixed is a date": (SEARCH + SPEEDS + "[options]\nfixed = {energy = 2020-01-01}", "energy"),
    "unknown quantity fixed": (SEARCH + SPEEDS + "[options]\nfixed = {enrgy = 290}", "enrgy"),
    "tolerance as text": (HEAD + SPEEDS + '[options]\ntolerance = "1e-10"', "tolerance = '1e-10'"),
    "tolerance as list": (HEAD + SPEEDS + "[options]\ntolerance = [1e-10]", "tolerance"),
    "tolerance as date": (HEAD + SPEEDS + "[options]\ntolerance = 2020-01-01", "tolerance"),
    "tolerance is no number": (HEAD + SPEEDS + "[options]\ntolerance = nan", "tolerance = nan"),
    "tolerance 0": (HEAD + SPEEDS + "[options]\ntolerance = 0", "tolerance = 0"),
    "endless tolerance": (HEAD + SPEEDS + f"[options]\ntolerance = {NUMBER}", "tolerance = 1000"),
    "true as tolerance": (HEAD + SPEEDS + "[options]\ntolerance = true", "tolerance = True"),
    "unknown axis": (HEAD + "[axes]\nspine.stifness = [200]", "did you mean 'spine.stiffness'?"),
    "a group as axis": (HEAD + "[axes]\nspine = [200]", "spine"),
    "energy of runs": (HEAD + "[axes]\nenergy = [290]", "energy"),
    "an axis twice": (HEAD + '[axes]\n"spine.stiffness" = [200]\nspine.stiffness = [260]',
                      "spine.stiffness"),
    "no values": (HEAD + "[axes]\nspeed = []", "speed"),
    "a text in a list": (HEAD + '[axes]\nspeed = [4.5, "4.4"]', "speed"),
    "truth in a list": (HEAD + "[axes]\nspeed = [true]", "speed"),
    "no number in a list": (HEAD + "[axes]\nspeed = [nan, 4.5]", "speed"),
    "no number later in a list": (HEAD + "[axes]\nspeed = [4.5, nan]", "speed"),
    "an endless energy": (SEARCH + "[axes]\nenergy = [290.0, inf]", "energy"),
    "no energy": (SEARCH + "[axes]\nenergy = [290.0, nan]", "energy"),
    "beyond all numbers": (HEAD + f"[axes]\nspeed = [{NUMBER}]", "speed"),
    "low beyond all numbers": (HEAD + f"[axes]\nspeed = {{low = -{NUMBER}, high = 1, steps = 2}}",
                               "speed"),
    "a number as axis": (HEAD + "[axes]\nspeed = 4.5", "speed"),
    "an empty axis": (HEAD + "[axes]\nspeed = {}", "speed"),
    "half a range": (HEAD + "[axes]\nspeed = {low = 4, steps = 2}", "speed"),
    "two ranges": (HEAD + "[axes]\nspeed = {around = 0.1, within = 1, steps = 2}", "speed"),
    "a range without steps": (HEAD + "[axes]\nspeed = {low = 4, high = 5}", "steps"),
    "steps 0": (HEAD + "[axes]\nspeed = {low = 4, high = 5, steps = 0}", "steps = 0"),
    "true as steps": (HEAD + "[axes]\nspeed = {low = 4, high = 5, steps = true}", "steps = True"),
    "steps without end": (HEAD + f"[axes]\nspeed = {{low = 4, high = 5, steps = {NUMBER}}}",
                          "give no more than"),
    "more steps than rows can count": (
        HEAD + "[axes]\nspeed = {around = 0.1, steps = 100000}\n"
        "height = {around = 0.1, steps = 100000}",
        "too many"),
    "around nothing": (f'model = "{SCOUT}"\n[axes]\npitch = {{around = 0.1, steps = 3}}', "within"),
    "around less than nothing": (HEAD + "[axes]\nspeed = {around = -0.1, steps = 3}",
                                 "around = -0.1 is negative"),
    "one step": (HEAD + "[axes]\nspeed = {around = 0.1, steps = 1}", "one step"),
    "steps of a sample": (RANDOM + "samples = 3\n[axes]\nspeed = {around = 0.1, steps = 3}",
                          "grid"),
    "fixed and varied": (SEARCH + "[options]\nfixed = {mean_speed = 3}\n[axes]\nmean_speed = [4]",
                         "mean_speed is both"),
    "downwards": (HEAD + "[axes]\nspeed = {low = 5, high = 4, steps = 2}", "swap"),
    "low as text": (HEAD + '[axes]\nspeed = {low = "4", high = 5, steps = 2}', "low = '4'"),
    "around no number": (HEAD + "[axes]\nspeed = {around = nan, steps = 2}", "around = nan"),
    "around everything": (HEAD + "[axes]\nspeed = {around = inf, steps = 2}", "around = inf"),
    "out of bounds": (HEAD + "[axes]\nspine.stiffness = [200, -1]", "spine.stiffness"),
    "range out of bounds": (HEAD + "[axes]\nfore.mass = {low = 0, high = 1, steps = 2}",
                            "fore.mass"),
    "angle out of bounds": (HEAD + "[axes]\ntouchdown.fore = [1.6]", "touchdown.fore"),
    "around out of bounds": (HEAD + "[axes]\ngravity = {around = 1.1, steps = 2}", "gravity"),
    "about the energy of no gait": (SEARCH + "[axes]\nenergy = {around = 0.1, steps = 2}\n"
                                    "[set]\nheight = 0.33", "energy"),
    "gaits at random": (GAITS + 'method = "random"\nsamples = 3\n[axes]\n'
                        "mean_speed = {around = 0.1}", "mean_speed"),
    "over another axis": (GAITS + "[options]\nover = 'energy'\n[axes]\nenergy = [290]\n"
                          "mean_speed = [4.4, 4.5]", "energy"),
    "over nothing": (GAITS + "[options]\nover = 3\n[axes]\nmean_speed = [4.4, 4.5]", "over = 3"),
    "followed over what a model lacks": (
        f'task = "gaits"\nmodel = ["{FLEXIBLE}", "kamimura2015-locked"]\n'
        "[axes]\nspine.stiffness = [200, 260]", "spine.stiffness"),
    "keeping nothing known": (HEAD + "[axes]\nheight = [0.3]\nspeed = {keeps = 'mass'}", "speed"),
    "keeping the energy by the height": (HEAD + "[axes]\nheight = {keeps = 'energy'}", "height"),
    "keeping the energy in steps": (
        HEAD + "[axes]\nheight = [0.3]\nspeed = {keeps = 'energy', steps = 3}", "speed"),
    "keeping the energy alone": (HEAD + "[axes]\nspeed = {keeps = 'energy'}", "axis"),
    "keeping the energy of searches": (
        SEARCH + "[axes]\nheight = [0.3]\nspeed = {keeps = 'energy'}", "energy"),
    "unknown in set": (HEAD + SPEEDS + "[set]\nspine.stifness = 200", "spine.stiffness"),
    "a group in set": (HEAD + SPEEDS + "[set]\nspine = 200", "spine"),
    "a text in set": (HEAD + SPEEDS + '[set]\nheight = "0.3"', "height"),
    "a list in set": (HEAD + SPEEDS + "[set]\nheight = [0.3]", "height"),
    "no number in set": (HEAD + SPEEDS + "[set]\nheight = nan", "height"),
    "no parameter in set": (HEAD + SPEEDS + "[set]\nspine.stiffness = nan", "spine.stiffness"),
    "set out of bounds": (HEAD + SPEEDS + "[set]\nspine.stiffness = -1", "spine.stiffness"),
    "set beyond all numbers": (HEAD + SPEEDS + f"[set]\nheight = {NUMBER}", "height"),
    "set twice": (HEAD + SPEEDS + '[set]\n"spine.stiffness" = 200\nspine.stiffness = 260',
                  "spine.stiffness"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_done_is_refused_by_name(tmp_path: Path, case: str) -> None:
    content, told = BAD[case]
    file = tmp_path / "plan.toml"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as raised:
        read_plan(file)
    assert str(file) in raised.value.message
    assert told in str(raised.value)
    assert raised.value.remedy
    assert len(str(raised.value)) < 1500


def test_what_cannot_be_read_is_refused_by_name(tmp_path: Path) -> None:
    for path in (tmp_path / "absent.toml", tmp_path):
        with pytest.raises(InputError, match=str(path)):
            read_plan(path)


def test_a_plan_made_in_python_is_checked_alike() -> None:
    model = load_model(FLEXIBLE)
    axes = read_axes(speed=[4.4, 4.5])
    assert Plan((model,), axes).points == 2
    for wrong in (
        {"models": ()},
        {"models": (model, model)},
        {"axes": ()},
        {"axes": axes * 2},
        {"task": "run"},
        {"samples": 3},
        {"seed": -1},
        {"options": {"strides": 0}},
    ):
        with pytest.raises(InputError):
            Plan(**{"models": (model,), "axes": axes, **wrong})


def test_whole_numbers_and_numbers_of_numpy_are_numbers() -> None:
    model = load_model(FLEXIBLE)
    plain = Plan((model,), read_axes(speed={"low": 4.0, "high": 5.0, "steps": 2}))
    other = Plan(
        (model,),
        (Axis("speed", low=4, high=np.float64(5), steps=2),),
        options={"strides": np.int64(1)},
    )
    assert Plan.revive(other.record()).key == other.key
    assert other.record()["axes"] == plain.record()["axes"]


def read_axes(**content: Any) -> Any:
    return tuple(Axis.read(name, what) for name, what in content.items())


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"models": 3},
        {"models": [3]},
        {"models": []},
        {"models": [{}]},
        {"axes": []},
        {"axes": {}},
        {"axes": {"speed": {"around": math.nan}}},
        {"samples": "many"},
        {"chunk": 0},
        {"options": []},
        {"options": {"tolerance": "small"}},
        {"task": None},
        {"seed": None},
    ],
    ids=str,
)
def test_a_damaged_record_is_refused(written: Any, wrong: dict[str, Any]) -> None:
    record = {**written(HEAD + SPEEDS).record(), **wrong} if wrong else {}
    with pytest.raises(InputError):
        Plan.revive(record)


@pytest.mark.parametrize(
    ("entry", "value"),
    [
        ("name", 3),
        ("model", "flexible"),
        ("model", []),
        ("parameters", []),
        ("parameters", {"spine.stiffness": 200}),
        ("apex", 3),
        ("apex", {"height": "high"}),
        ("touchdown", {}),
    ],
)
def test_a_damaged_model_in_a_record_is_refused(written: Any, entry: str, value: Any) -> None:
    record = written(HEAD + SPEEDS).record()
    record["models"][0][entry] = value
    with pytest.raises(InputError):
        Plan.revive(record)


def toml(value: Any) -> str:
    """A value as TOML, tables written inline."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return value.isoformat() if isinstance(value, date) else repr(value)


TEXTS = st.text(st.characters(codec="utf-8"), max_size=8)
SCALARS = (
    st.booleans()
    | st.integers(-9, 300)
    | st.sampled_from([2**63, -(2**64), NUMBER])
    | st.floats()
    | st.dates()
    | TEXTS
)
ANYTHING = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=6,
)
NAMES = st.sampled_from(["height", "speed", "spine.stiffness", "pitch", "touchdown.fore", "energy"])
STEPS = {"steps": st.integers(1, 9) | SCALARS}
RANGES = (
    st.fixed_dictionaries({"low": st.floats(0, 0.5), "high": st.floats(0.5, 1)}, optional=STEPS)
    | st.fixed_dictionaries({"around": st.floats(0, 1) | SCALARS}, optional=STEPS)
    | st.fixed_dictionaries({"within": st.floats(0, 1) | SCALARS}, optional=STEPS)
    | st.just({"keeps": "energy"})
    | st.dictionaries(
        st.sampled_from(["keeps", "low", "high", "around", "within", "steps"]), SCALARS
    )
)
LIKELY = {
    "model": st.sampled_from([FLEXIBLE, SCOUT, [FLEXIBLE, SCOUT]]),
    "task": st.sampled_from(["runs", "searches", "gaits"]),
    "method": st.sampled_from(["grid", "random", "sobol"]),
    "samples": st.integers(1, 50),
    "seed": st.integers(0),
    "chunk": st.integers(1, 50),
    "options": st.dictionaries(
        st.sampled_from(["strides", "starts", "symmetric", "fixed", "over", "tolerance"]),
        st.integers(1, 5) | ANYTHING,
        max_size=1,
    ),
    "axes": st.dictionaries(
        NAMES,
        st.lists(st.floats(0.1, 1) | st.integers() | st.floats(), min_size=1, max_size=4)
        | RANGES
        | ANYTHING,
        min_size=1,
        max_size=2,
    ),
    "set": st.dictionaries(NAMES, st.floats(0.1, 1) | SCALARS, max_size=1),
}
FILES = st.builds(
    lambda likely, entry, wrong: {**likely, **({entry: wrong} if entry else {})},
    st.fixed_dictionaries(
        {name: LIKELY[name] for name in ("model", "axes")},
        optional={name: LIKELY[name] for name in ("task", "seed", "chunk", "options", "set")},
    )
    | st.fixed_dictionaries(LIKELY),
    st.sampled_from([None, None, *LIKELY]),
    ANYTHING,
)


@given(content=FILES | st.dictionaries(TEXTS, ANYTHING, max_size=3))
@settings(max_examples=100, suppress_health_check=list(HealthCheck))
def test_any_file_is_a_plan_or_is_refused(
    tmp_path_factory: pytest.TempPathFactory, content: dict[str, Any]
) -> None:
    file = tmp_path_factory.getbasetemp() / "any.toml"
    file.write_text("\n".join(f"{toml(k)} = {toml(v)}" for k, v in content.items()), "utf-8")
    try:
        plan = read_plan(file)
    except InputError as refused:
        event("refused")
        assert refused.message
        assert refused.remedy
        return
    # What is accepted can be written down, made again and begun.
    record = json.loads(json.dumps(plan.record(), allow_nan=False))
    assert Plan.revive(record).key == plan.key
    assume(plan.points < 10**6)
    model, first, count = plan.of_chunk(0)
    assert (model, first) == (plan.models[0], 0)
    assert all(len(column) == count for column in plan.at(0).values())


@given(content=st.binary(max_size=60) | TEXTS.map(str.encode))
@settings(max_examples=100)
def test_any_bytes_are_a_plan_or_are_refused(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    file = tmp_path_factory.getbasetemp() / "bytes.toml"
    file.write_bytes(content)
    with pytest.raises(InputError):
        read_plan(file)
