"""A directory of results, each file written whole or not at all."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from flexspine.cli.output import WORDS, Steps
from flexspine.errors import OUT_OF_SPACE, OutputError

if TYPE_CHECKING:
    import xarray as xr

    from flexspine.models.simulation import Run

ANIMATIONS = ("animation.mp4", "animation.gif")
PICTURES = re.compile("|".join(map(re.escape, ("figure.png", "strip.png", *ANIMATIONS))))


class ResultDirectory:
    """A place for results; made and tried out at once, so that no run is done in vain.

    A context: what was made for nothing is taken away at its end. Files come with the command that
    made them unless it ``tells`` nothing. Raises `OutputError` if it cannot be written to, and
    `MachineError` if ``films`` are wanted and there is nothing to make them with.
    """

    def __init__(self, path: Path, *, tells: bool = True, films: bool = False) -> None:
        if films:
            from flexspine.report.film import video_encoder

            video_encoder()
        self.path, self._tells = path, tells
        self._new = [p for p in (path, *path.parents) if not p.exists()]
        try:
            path.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=path):
                pass
        except OSError as failure:
            self._remove_new()
            if failure.errno in OUT_OF_SPACE:
                raise
            raise OutputError(
                f"cannot write to '{path}' ({failure.strerror})", "give --out another directory"
            ) from None

    @classmethod
    def within(
        cls, stack: ExitStack, path: Path | None, *, films: bool = False
    ) -> ResultDirectory | None:
        """Enter one until the stack is left, if a place is given."""
        return None if path is None else stack.enter_context(cls(path, films=films))

    @contextmanager
    def stage(self, replaced: re.Pattern[str] | None = None) -> Iterator[Path]:
        """Give a place for files, which come here together at the end of the block, if it succeeds.

        Files whose names match ``replaced`` are of an earlier run unless they come anew, and would
        pass for some of this one: they go.
        """
        stage = Path(tempfile.mkdtemp(prefix=".partial-", dir=self.path))
        try:
            yield stage
            if self._tells and WORDS.get():
                _write_command(stage)
            made = sorted(stage.iterdir())
            for file in made:
                self._refuse_directory(file.name)
            for file in made:
                file.replace(self.path / file.name)
            older = [] if replaced is None else sorted(self.path.iterdir())
            for name in {file.name for file in older} - {file.name for file in made}:
                if replaced is not None and replaced.fullmatch(name):
                    (self.path / name).unlink(missing_ok=True)
        finally:
            shutil.rmtree(stage, ignore_errors=True)

    def _refuse_directory(self, name: str) -> None:
        if (self.path / name).is_dir():
            raise OutputError(
                f"'{self.path / name}' is a directory where a file is to be written",
                "move it elsewhere, or give --out another directory",
            )

    def write(
        self, run: Run, record: dict[str, Any], interval: float, animation: bool, progress: Steps
    ) -> None:
        """Write everything there is about a run."""
        with self.stage(PICTURES) as stage:
            _write_all(stage, run, record, interval, animation, progress)

    @contextmanager
    def stage_run(
        self, run: Run, record: dict[str, Any], animation: bool, progress: Steps
    ) -> Iterator[Path]:
        """Write everything there is about a run, together with what the block adds."""
        from flexspine.models.dataset import DEFAULT_INTERVAL

        with self.stage(PICTURES) as stage:
            _write_all(stage, run, record, DEFAULT_INTERVAL, animation, progress)
            yield stage

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self._remove_new()

    def _remove_new(self) -> None:
        """Take away the new directories that are still empty."""
        for path in self._new:
            try:
                path.rmdir()
            except OSError:
                return


def write_json(record: dict[str, Any], path: Path) -> None:
    """Write a record for people and programs to read."""
    path.write_text(json.dumps(record, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _write_command(stage: Path) -> None:
    """Write what has to be typed to have these results again."""
    from flexspine.report.page.reading import COMMAND

    command = shlex.join(["flexspine", *WORDS.get()])
    (stage / COMMAND).write_text(f"{command}\n", encoding="utf-8")


def _write_all(
    stage: Path,
    run: Run,
    record: dict[str, Any],
    interval: float,
    animation: bool,
    progress: Steps,
) -> None:
    from flexspine.models.dataset import to_dataset
    from flexspine.models.files import write_csv, write_events_csv, write_netcdf

    progress.begin("writing data")
    dataset = to_dataset(run, interval=interval)
    write_netcdf(dataset, stage / "trajectory.nc")
    write_csv(dataset, stage / "trajectory.csv")
    write_events_csv(dataset, stage / "events.csv")
    write_json(record, stage / "summary.json")
    if dataset.sizes["time"] < 2:
        return  # nothing to draw
    from flexspine.report.animation import strip
    from flexspine.report.figure import plot_run

    progress.begin("drawing")
    plot_run(dataset).savefig(stage / "figure.png")
    strip(dataset).savefig(stage / "strip.png")
    if animation:
        _write_animations(stage, dataset, progress)


def write_robot_run(
    stage: Path, dataset: xr.Dataset, record: dict[str, Any], animation: bool, progress: Steps
) -> None:
    """Write everything there is about a run of a robot, in the plane or in space."""
    from flexspine.models.files import write_netcdf

    progress.begin("writing data")
    write_netcdf(dataset, stage / "trajectory.nc")
    write_json(record, stage / "summary.json")
    if dataset.sizes["time"] < 2:
        return  # nothing to draw
    from flexspine.report.robot_figure import plot_robot

    progress.begin("drawing")
    plot_robot(dataset).savefig(stage / "figure.png")
    if animation:
        _write_animations(stage, dataset, progress)


def _write_animations(stage: Path, dataset: xr.Dataset, progress: Steps) -> None:
    from flexspine.report.animation import animate

    progress.begin("animating")
    animate(dataset, *(stage / name for name in ANIMATIONS), progress=progress.at)
