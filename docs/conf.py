"""The book: MyST pages, built by scripts/docs.sh. Equations become MathML, so that no page needs a network."""

from docutils import nodes
from latex2mathml.converter import convert
from pygments.lexers import TextLexer

project = "bondline"
author = "The bondline authors"
extensions = ["myst_parser"]
myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
exclude_patterns = ["generate"]
nitpicky = True
html_theme = "furo"
html_title = "bondline"
html_show_sphinx = False
html_show_copyright = False
html_show_sourcelink = False
html_static_path = ["static"]
html_css_files = ["book.css"]
pygments_style = "friendly"


def inline(translator, node):
    translator.body.append(convert(node.astext()))
    raise nodes.SkipNode


def display(translator, node):
    translator.body.append(f'<div class="equation">{convert(node.astext(), display="block")}</div>')
    raise nodes.SkipNode


def setup(app):
    app.add_node(nodes.math, override=True, html=(inline, None))
    app.add_lexer("csv", TextLexer)
    app.add_node(nodes.math_block, override=True, html=(display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
