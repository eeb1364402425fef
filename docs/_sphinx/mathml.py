"""Formulas as MathML, which browsers draw by themselves: the site needs no network for them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from docutils.nodes import Element, SkipNode
from docutils.utils.math.latex2mathml import tex2mathml

if TYPE_CHECKING:
    from sphinx.application import Sphinx


def set_inline(writer: Any, node: Element) -> None:
    """Set a formula within a line."""
    writer.body.append(tex2mathml(node.astext()))
    raise SkipNode


def set_displayed(writer: Any, node: Element) -> None:
    """Set a formula on lines of its own."""
    formula = tex2mathml(node.astext(), as_block=True)
    writer.body.append(f"{writer.starttag(node, 'div', CLASS='formula')}{formula}</div>\n")
    raise SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx of the renderer."""
    app.add_html_math_renderer("mathml", (set_inline, None), (set_displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
