"""Whether flexspine works here: versions, extras, and a stride of which the numbers are known."""

from __future__ import annotations

import platform
import re
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from math import inf

from flexspine._version import __version__
from flexspine.errors import FlexspineError
from flexspine.workers.crew import cores

# What the published gait is, by two implementations that are not ours (s, N per leg pair).
PRESET, PERIOD, PEAK = "kamimura2015-flexible", 0.252732108498, 530.460494

# Relative; those numbers have twelve and nine digits.
PERIOD_OFF, PEAK_OFF, ENERGY_OFF = 1e-10, 2e-9, 1e-12

EXTRA = re.compile(r"extra == ['\"](\w+)['\"]")
NAME = re.compile(r"[\w.-]+")

# What users may install; tests and benchmarks are for developers.
EXTRAS = {"engine": "the robot in space, verify", "cluster": "sweeps over several machines"}


@dataclass(frozen=True)
class Check:
    """One thing that was looked at: ``passed`` is None of what may be missing and is."""

    name: str
    passed: bool | None
    told: str


def self_check() -> Iterator[Check]:
    """Look at everything, one after the other; takes some seconds."""
    yield Check(
        "flexspine", True,
        f"{__version__}, Python {platform.python_version()}, {platform.system()} "
        f"{platform.machine()}, {cores()} cores",
    )  # fmt: skip
    yield from _packages()
    for name, look in (
        ("compiled code", _cache),
        ("published gait", _gait),
        ("video", _video),
        ("pictures by MuJoCo", _opengl),
    ):
        yield _tried(name, look)


def _packages() -> Iterator[Check]:
    """What has to be installed, and the extras."""
    wanted: dict[str, list[str]] = {"": [], **{extra: [] for extra in EXTRAS}}
    for line in requires("flexspine") or []:
        found, name = EXTRA.search(line), NAME.match(line)
        extra = found.group(1) if found else ""
        if name and extra in wanted:
            wanted[extra].append(name.group())
    for extra, names in wanted.items():
        found_all, told = True, []
        for package in names:
            try:
                told.append(f"{package} {version(package)}")
            except PackageNotFoundError:
                found_all = False
                told.append(f"{package} is missing")
        if extra and not found_all:
            remedy = f"pip install 'flexspine[{extra}]' for {EXTRAS[extra]}"
            yield Check(f"extra {extra}", None, remedy)
        else:
            yield Check(f"extra {extra}" if extra else "packages", found_all, ", ".join(told))


def _tried(name: str, look: Callable[[], tuple[bool | None, str]]) -> Check:
    try:
        return Check(name, *look())
    except FlexspineError as failure:
        return Check(name, False, str(failure))


def _cache() -> tuple[bool | None, str]:
    from flexspine.hybrid.cache import DIRECTORY_VARIABLE, cache_directory

    directory = cache_directory()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=directory):
            pass
    except OSError as failure:
        why = failure.strerror or failure
        return None, f"{directory} ({why}): every start compiles; set {DIRECTORY_VARIABLE}"
    size = sum(file.stat().st_size for file in directory.glob("*") if file.is_file())
    return True, f"{directory}, {size / 1e6:.1f} MB"


def _gait() -> tuple[bool | None, str]:
    from flexspine.gaits.measures import summarize
    from flexspine.models.presets import load_model
    from flexspine.models.simulation import simulate

    run = simulate(load_model(PRESET))
    summary = summarize(run)
    period, peak = summary.period or inf, max(summary.peak_grf.values())
    drift = summary.energy["relative_drift"]
    fine = (
        abs(period / PERIOD - 1) < PERIOD_OFF
        and abs(peak / PEAK - 1) < PEAK_OFF
        and drift is not None
        and drift < ENERGY_OFF
    )
    wanted = "" if fine else f"; {PERIOD} s and {PEAK} N are right"
    return fine, f"period {period:.12f} s, peak {peak:.6f} N, energy to {drift:.0e}{wanted}"


def _video() -> tuple[bool | None, str]:
    from flexspine.errors import MachineError
    from flexspine.report.film import video_encoder

    try:
        return True, video_encoder()
    except MachineError as failure:
        return None, f"{failure}; {failure.remedy}"


def _opengl() -> tuple[bool | None, str]:
    from flexspine.engines.installed import mujoco_module
    from flexspine.engines.render import opengl
    from flexspine.errors import MachineError

    try:
        mujoco_module()
    except MachineError as failure:
        return None, str(failure)
    found = opengl()
    if found is None:
        return None, "neither EGL nor OSMesa: no films; install libegl1 or libosmesa6"
    return True, f"OpenGL by {found}"
