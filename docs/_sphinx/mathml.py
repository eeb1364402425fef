"""Formulas as MathML, which browsers draw by themselves: the site needs no network for them."""

from __future__ import annotations

import re
from html import unescape
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from docutils.nodes import Element, SkipNode
from docutils.utils.math.latex2mathml import tex2mathml

if TYPE_CHECKING:
    from sphinx.application import Sphinx


MATHML = "http://www.w3.org/1998/Math/MathML"
DOTS = "\u02d9\u00a8"  # one, two
ElementTree.register_namespace("", MATHML)

# Characters by names that HTML knows and XML does not.
NAMED = re.compile(r"&(?!(?:amp|lt|gt|quot|apos);)\w+;")


def _character(named: re.Match[str]) -> str:
    return unescape(named[0])


def _mathml(tex: str, **how: bool) -> str:
    """Set a formula; docutils would set indices of letters with dots above and below these."""
    formula = ElementTree.fromstring(NAMED.sub(_character, tex2mathml(tex, **how)))
    for both in list(formula.iter(f"{{{MATHML}}}munderover")):
        letter, index, dots = both
        if dots.text and dots.text in DOTS:
            both.tag = f"{{{MATHML}}}msub"
            dotted = ElementTree.Element(f"{{{MATHML}}}mover", {"accent": "true"})
            dotted.extend([letter, dots])
            both[:] = [dotted, index]
    return ElementTree.tostring(formula, encoding="unicode")


def set_inline(writer: Any, node: Element) -> None:
    """Set a formula within a line."""
    writer.body.append(_mathml(node.astext()))
    raise SkipNode


def set_displayed(writer: Any, node: Element) -> None:
    """Set a formula on lines of its own."""
    formula = _mathml(node.astext(), as_block=True)
    writer.body.append(f"{writer.starttag(node, 'div', CLASS='formula')}{formula}</div>\n")
    raise SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx of the renderer."""
    app.add_html_math_renderer("mathml", (set_inline, None), (set_displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
