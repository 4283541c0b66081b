"""Sphinx: read by make.py from the folder in which the pages have been put together."""

import re
import textwrap

import flexframe

project = "Flexframe"
copyright = "The Flexframe authors"
release = version = flexframe.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
# Debian's MathJax 2, copied beside the pages by make.py: they need no network.
mathjax_path = "mathjax/MathJax.js?config=TeX-AMS_SVG"
mathjax2_config = {"tex2jax": {"ignoreClass": "tex2jax_ignore", "processClass": "math"}}
myst_update_mathjax = False
html_static_path = ["static"]
html_css_files = ["pages.css"]
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
html_theme = "furo"
html_title = "Flexframe " + version
html_show_sphinx = False
highlight_language = "none"
autodoc_member_order = "bysource"
autodoc_typehints = "none"


def folded(line, width=104):
    """Lines of at most this width; what is left stands below the text of its column."""
    if len(line) <= width:
        return [line]
    column = re.match(r"\s*(?:\S+(?: \S+)*\s{2,}|\{?\"\w+\": )?", line).end()
    return textwrap.wrap(line, width, subsequent_indent=" " * (column if column < width // 2 else 4), break_on_hyphens=False)


def plain(app, what, name, thing, options, lines):
    """Docstrings are plain text with aligned columns: the first line as prose, the rest as it stands."""
    head, rest = lines[:1], lines[1:]
    lines[:] = [line.replace("|", "\\|").replace("*", "\\*") for line in head]
    if any(line.strip() for line in rest):
        lines += ["", "::", "", *("   " + part for line in rest for part in folded(line)), ""]


def setup(app):
    app.connect("autodoc-process-docstring", plain)
