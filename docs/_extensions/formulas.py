"""Formulas as MathML, which browsers draw themselves: no script, no font, no network.

docutils has the converter from LaTeX; Sphinx only needs to be told of it.
"""

from docutils import nodes
from docutils.utils.math import latex2mathml


def mathml(text: str, block: bool) -> str:
    """A formula in LaTeX as a <math> element."""
    text = text.strip() if block else " ".join(text.split())
    return latex2mathml.tex2mathml(text, as_block=block)


def inline(writer, node):
    """A formula within a line."""
    writer.body.append(mathml(node.astext(), False))
    raise nodes.SkipNode


def display(writer, node):
    """A formula on lines of its own, numbered where the page asks for it."""
    writer.body.append('<div class="formula">' + mathml(node.astext(), True))
    if node["number"]:
        writer.body.append(f'<span class="eqno">({node["number"]})</span>')
    writer.body.append("</div>")
    raise nodes.SkipNode


def setup(app):
    """Register the renderer `mathml`."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
