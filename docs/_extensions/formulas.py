"""Formulas as MathML, which browsers draw themselves: no script, no font, no network.

docutils has the converter from LaTeX; Sphinx only needs to be told of it.
"""

import html

from docutils import nodes
from docutils.utils.math import MathError, latex2mathml
from sphinx.util import logging

LOGGER = logging.getLogger(__name__)


def mathml(node: nodes.Node, block: bool) -> str:
    """A formula as a <math> element; as it stands, with a warning, where it is wrong."""
    text = node.astext().strip() if block else " ".join(node.astext().split())
    try:
        return latex2mathml.tex2mathml(text, as_block=block)
    except MathError as reason:
        LOGGER.warning("formula %r: %s", text, reason, location=node)
        return f"<code>{html.escape(text)}</code>"


def inline(writer, node):
    """A formula within a line."""
    writer.body.append(mathml(node, False))
    raise nodes.SkipNode


def display(writer, node):
    """A formula on lines of its own, numbered where the page asks for it."""
    writer.body.append('<div class="formula">' + mathml(node, True))
    if node["number"]:
        writer.body.append(f'<span class="eqno">({node["number"]})</span>')
    writer.body.append("</div>")
    raise nodes.SkipNode


def setup(app):
    """Register the renderer `mathml`."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
