"""Robots that walk in space, as what a sweep varies: numbers by dotted name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

from flexspine.control.gains import Gains, Walk
from flexspine.control.spine_comparison import spine_of
from flexspine.engines.space_measures import SpaceSummary, summarize_space
from flexspine.engines.space_run import run_in_space
from flexspine.errors import InputError, PresetError
from flexspine.models.locking import locked
from flexspine.models.model import Source
from flexspine.models.robot import LegParts, Robot, checked
from flexspine.models.space import SpaceRobot
from flexspine.parameters import build, values

# What begins the names of a walk's numbers; all others are the robot's.
OF_WALKS = ("gait.", "servo.")

# Of a summary, what is no number by itself.
_PARTS = ("spine",)


@dataclass(frozen=True)
class Walker:
    """A robot and how it walks in space, as what a sweep varies; ``name`` is that of its rows."""

    name: str
    robot: Robot
    walk: Walk

    @cached_property
    def numbers(self) -> dict[str, float]:
        """All numbers of the robot and of its walk, by dotted name, SI."""
        return {**self.robot.numbers, **values(self.walk.gains)}

    def with_values(self, changes: Mapping[str, float]) -> Walker:
        """Return the same with some numbers changed, by dotted name.

        Raises `UnknownNameError` and `ParameterError`.
        """
        own = {name: value for name, value in changes.items() if not name.startswith(OF_WALKS)}
        rest = {name: value for name, value in changes.items() if name not in own}
        robot = self.robot.with_values(own) if own else self.robot
        walk = self.walk.with_values(rest) if rest else self.walk
        return Walker(self.name, robot, walk)

    def with_locked_spine(self) -> Walker:
        """Return the same with its spine locked straight.

        Raises `ParameterError` if it has none.
        """
        robot = locked(self.robot, spine_of(self.robot))
        return Walker(f"{self.name}-locked", robot, self.walk)

    def check(self) -> None:
        """Raise `ParameterError` unless it can walk in space."""
        self.walk.pattern(SpaceRobot(self.robot).legs)

    def row(self, seconds: float, sensing: float, seed: int) -> dict[str, Any]:
        """Let it walk for some seconds, and return what came of it by column.

        ``sensing`` (rad) is how far joints are read off at most, drawn from ``seed``.
        """
        try:
            run = run_in_space(self.robot, self.walk, seconds, sensing=sensing, seed=seed)
        except InputError as failure:
            return {"outcome": "refused", "reason": failure.message}
        summary = summarize_space(run)
        measures = {name: value for name, value in asdict(summary).items() if name not in _PARTS}
        bend = next(iter(summary.spine.values()), None)
        told = {"outcome": run.outcome.name, "reason": run.outcome.message}
        return {**told, "duration": run.duration, **measures, "spine": bend}

    def record(self) -> dict[str, Any]:
        """Return all of it as JSON, from which it can be made again."""
        robot = self.robot
        return {
            "name": self.name,
            "robot": {
                "name": robot.name,
                "parents": dict(robot.parents),
                "joints": {joint: list(wired) for joint, wired in robot.joints.items()},
                "feet": dict(robot.feet),
                "legs": {leg: asdict(parts) for leg, parts in robot.legs.items()},
            },
            "rhythm": self.walk.rhythm,
            "walk": self.walk.name,
            "parameters": self.numbers,
        }

    @classmethod
    def revive(cls, record: Mapping[str, Any]) -> Walker:
        """Make one again. Raises `PresetError` for numbers that are not right."""
        frame, numbers = record["robot"], record["parameters"]
        gains = {name: value for name, value in numbers.items() if name.startswith(OF_WALKS)}
        own = {name: value for name, value in numbers.items() if name not in gains}
        wired = {joint: (link, bool(motor)) for joint, (link, motor) in frame["joints"].items()}
        source = Source(title=str(record["name"]), source="the record of a sweep")
        try:
            robot = Robot(
                name=frame["name"],
                parents=frame["parents"],
                joints=wired,
                feet=frame["feet"],
                numbers=checked(frame["parents"], wired, frame["feet"], own),
                source=source,
                legs={leg: LegParts(**parts) for leg, parts in frame["legs"].items()},
            )
            walk = Walk(record["walk"], record["rhythm"], build(Gains, gains), source)
        except InputError as failure:
            raise PresetError(failure.message, failure.remedy) from None
        return cls(record["name"], robot, walk)


def row_names() -> list[str]:
    """The columns of a row, in order."""
    measures = [name for name in SpaceSummary.__dataclass_fields__ if name not in _PARTS]
    return ["outcome", "reason", "duration", *measures, "spine"]
