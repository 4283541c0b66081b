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


def hanging(line):
    """The column in which what is left of a line goes on: that of its text behind a word and a gap, else its own."""
    return re.match(r"\s*(?:\S+(?: \S+)*\s{2,}|\{?\"\w+\": )?", line).end()


def folded(lines, width=104):
    """Lines of at most this width; what is left stands below the text of its column. Lines that were broken by hand are joined first."""
    joined, last = [], ""
    for line in lines:
        indent = len(line) - len(line.lstrip())
        before = joined[-1] if joined else ""
        goes_on = indent in (hanging(before), len(before) - len(before.lstrip())) and hanging(line) == indent
        if len(last) > width - 10 and line.strip() and goes_on:
            joined[-1] += " " + line.strip()
        else:
            joined.append(line)
        last = line
    out = []
    for line in joined:
        column = hanging(line)
        indent = " " * (column if column < width // 2 else 4)
        out += textwrap.wrap(line, width, subsequent_indent=indent, break_on_hyphens=False) if len(line) > width else [line]
    return out


def plain(app, what, name, thing, options, lines):
    """Docstrings are plain text with aligned columns: the first line as prose, the rest as it stands."""
    head, rest = lines[:1], lines[1:]
    lines[:] = [line.replace("|", "\\|").replace("*", "\\*") for line in head]
    if any(line.strip() for line in rest):
        lines += ["", "::", "", *("   " + line for line in folded(rest)), ""]


def setup(app):
    app.connect("autodoc-process-docstring", plain)
