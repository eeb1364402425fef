"""The same tree of links walked from another point, such as a foot that is pinned."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from flexspine.errors import UnknownNameError
from flexspine.mechanics.linkage import Link, Linkage


def rerooted(linkage: Linkage, foot: str) -> Linkage:
    """The same mechanism with its base at a foot.

    Links keep their directions, and so their absolute angles: one that is now walked against its
    direction starts at its far joint and has its parts at negative distances. Joints that are
    walked the other way bend the other way. Raises `UnknownNameError` for an unknown foot.
    """
    links = {link.name: link for link in linkage.links}
    feet = {each.name: each for each in linkage.feet}
    if foot not in feet:
        raise UnknownNameError("foot", foot, feet)
    standing = feet[foot]
    way = [standing.link]
    while (above := links[way[-1]].parent) is not None:
        way.append(above)
    turned = dict(pairwise(way))
    # How far the start of a link moves along it: to the foot, or to the joint that it now hangs on.
    moved = dict.fromkeys(links, 0.0) | {standing.link: standing.at}
    moved |= {above: links[below].at for below, above in turned.items()}
    hangs = {link.name: (link.parent, link.at) for link in linkage.links}
    hangs |= {above: (below, 0.0) for below, above in turned.items()} | {standing.link: (None, 0.0)}

    def walked(link: Link) -> Link:
        (parent, at), by = hangs[link.name], moved[link.name]
        at = 0.0 if parent is None else at - moved[parent]
        return replace(link, length=link.length - by, com=link.com - by, parent=parent, at=at)

    rest = [name for name in links if name not in way]
    return Linkage(
        tuple(walked(links[name]) for name in (*way, *rest)),
        tuple(
            replace(joint, link=turned[joint.link], rest=-joint.rest)
            if joint.link in turned
            else joint
            for joint in linkage.joints
        ),
        tuple(replace(each, at=each.at - moved[each.link]) for each in feet.values()),
        linkage.gravity,
    )
