"""``flexspine doctor``: whether it works here, and what is missing."""

from __future__ import annotations

from flexspine._version import STAMP
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import Json
from flexspine.cli.output import print_json, steps

WORDS = {True: "ok", False: "WRONG", None: "-"}


def doctor(json: Json = False) -> int:
    """Check that flexspine works here, and tell what is missing.

    Looks at versions, extras and the machine, and runs a stride of which the numbers are known.
    Takes some seconds, the first time some more, as it compiles. A dash marks what is missing and
    not needed.

    Exit code 0: it works; 3: something is wrong; 130: interrupted.

    Examples:
        flexspine doctor

        flexspine doctor --json
    """
    from flexspine.cli.self_check import self_check

    interruptible()
    found = []
    with steps() as progress:
        progress.begin("looking")
        for check in self_check():
            found.append(check)
            if not json:
                print(f"{WORDS[check.passed]:<6}{check.name:<20}{check.told}", flush=True)
    works = all(check.passed is not False for check in found)
    if json:
        print_json(
            {
                **STAMP,
                "works": works,
                "checks": [vars(check) for check in found],
            }
        )
    return 0 if works else 3
