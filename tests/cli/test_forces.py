"""``flexspine forces`` from outside."""

from __future__ import annotations

import json

import pytest

from tests.cli.conftest import Cli

WEIGHT = 18.6501 * 9.81


def test_one_hind_and_one_fore_foot_carry_the_weight_in_one_way(cli: Cli) -> None:
    done = cli("forces", "--foot", "toe_1", "--foot", "toe_4", "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["verdict"] == "unique"
    assert record["dimension"] == 0
    forces = record["forces"].values()
    assert sum(force["y"] for force in forces) == pytest.approx(WEIGHT, rel=1e-4)
    assert sum(force["x"] for force in forces) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(("feet", "lock", "dimension"), [(3, [], 2), (4, [], 4), (4, ["spine"], 5)])
def test_more_feet_leave_a_family(cli: Cli, feet: int, lock: list[str], dimension: int) -> None:
    given = [part for i in range(1, feet + 1) for part in ("--foot", f"toe_{i}")]
    given += [part for joint in lock for part in ("--lock", joint)]
    record = json.loads(cli("forces", *given, "--json").stdout)
    assert (record["verdict"], record["dimension"]) == ("family", dimension)
    for low, high in record["normal_ranges"].values():
        assert 0 <= low <= high <= WEIGHT


def test_two_feet_of_one_hip_cannot_stand(cli: Cli) -> None:
    done = cli("forces", "--foot", "toe_1", "--foot", "toe_2")
    assert done.returncode == 1
    assert "no solution" in done.stdout


def test_shares_are_kept_to_where_they_can_be(cli: Cli) -> None:
    """Within a hip the load is split as asked for; between hips statics decides."""
    shares = [part for toe, share in (("toe_1", 3), ("toe_2", 1), ("toe_3", 2), ("toe_4", 2))
              for part in ("--share", f"{toe}={share}")]  # fmt: skip
    record = json.loads(cli("forces", *shares, "--json").stdout)
    normal = {toe: force["y"] for toe, force in record["forces"].items()}
    assert normal["toe_1"] - normal["toe_2"] == pytest.approx(WEIGHT / 4, rel=0.02)
    assert normal["toe_3"] == pytest.approx(normal["toe_4"], rel=1e-6)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--foot", "toe_9"], "unknown foot 'toe_9'"),
        (["--lock", "spin"], "did you mean 'spine'"),
        (["--aim", "beauty"], "unknown aim"),
        (["--ahead", "leg=0.1"], "unknown leg"),
        (["--height", "0.5"], "0.5 m below its hip"),
        (["--ahead", "fore_1=0.3"], "0.3 m ahead"),
        (["--foot", "toe_1", "--foot", "toe_1"], "twice"),
        (["--share", "toe_1=1"], "share of every foot"),
        (["--share", "toe_1=1", "--aim", "torque"], "--aim split"),
        (["--robot", "nobody"], "unknown robot"),
    ],
)
def test_bad_input_is_told_in_one_line(cli: Cli, options: list[str], said: str) -> None:
    done = cli("forces", *options)
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1
