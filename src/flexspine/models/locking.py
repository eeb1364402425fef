"""The same robot with a joint locked straight: what a spring of a spine is compared with."""

from __future__ import annotations

from dataclasses import replace

from flexspine.errors import UnknownNameError
from flexspine.models.robot import LinkNumbers, Robot, checked


def locked(robot: Robot, joint: str) -> Robot:
    """Join two links into one, in line. Raises `UnknownNameError` for an unknown joint."""
    if joint not in robot.joints:
        raise UnknownNameError("joint", joint, robot.joints)
    child = robot.joints[joint][0]
    parent = robot.parents[child]
    assert parent is not None
    numbers = dict(robot.numbers)
    one, other = (
        {each: numbers[f"{link}.{each}"] for each in LinkNumbers.model_fields}
        for link in (parent, child)
    )
    beyond = other["at"]
    mass = one["mass"] + other["mass"]
    com = (one["mass"] * one["com"] + other["mass"] * (beyond + other["com"])) / mass
    inertia = sum(
        part["inertia"] + part["mass"] * (start + part["com"] - com) ** 2
        for part, start in ((one, 0.0), (other, beyond))
    )
    whole = {"length": beyond + other["length"], "mass": mass, "com": com, "inertia": inertia}
    gone = (f"{child}.", f"{joint}.")
    numbers = {name: value for name, value in numbers.items() if not name.startswith(gone)}
    numbers |= {f"{parent}.{name}": value for name, value in whole.items()}
    parents = {
        link: parent if above == child else above
        for link, above in robot.parents.items()
        if link != child
    }
    for link, above in robot.parents.items():
        if above == child:
            numbers[f"{link}.at"] += beyond
    feet = {foot: parent if link == child else link for foot, link in robot.feet.items()}
    for foot, link in robot.feet.items():
        if link == child:
            numbers[f"{foot}.at"] += beyond
    joints = {name: wired for name, wired in robot.joints.items() if name != joint}
    legs = {
        name: replace(leg, trunk=parent if leg.trunk == child else leg.trunk)
        for name, leg in robot.legs.items()
    }
    title = f"{robot.source.title}, {joint} locked"
    return Robot(
        name=f"{robot.name} with its {joint} locked",
        parents=parents,
        joints=joints,
        feet=feet,
        numbers=checked(parents, joints, feet, numbers),
        source=replace(robot.source, title=title),
        legs=legs,
    )
