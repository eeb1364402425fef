"""The commands that the page on troubles gives for an outcome end in it."""

from __future__ import annotations

import json
import re
import shlex

import pytest

from tests.cli.conftest import Cli
from tests.test_troubleshooting import outcome_kinds, section

# Of bounders, which run in no time; a gait file would have to be found first.
SHOWN = [
    (outcome, command)
    for outcome in sorted(outcome_kinds() - {"completed"})
    for command in re.findall(r"`flexspine (bound [^`]+)`", section(outcome))
    if "--gait" not in command
]


def test_there_are_some_for_most_outcomes_of_bounders() -> None:
    shown = {outcome for outcome, _ in SHOWN}
    assert shown == {"fell", "no_apex", "grazed", "chattered", "timed_out"}


@pytest.mark.parametrize(("outcome", "command"), SHOWN)
def test_the_command_ends_so(cli: Cli, outcome: str, command: str) -> None:
    done = cli(*shlex.split(command), "--json")
    assert done.returncode == 1
    assert json.loads(done.stdout)["outcome"] == outcome
