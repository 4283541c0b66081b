"""Sphinx: read by make.py from the folder in which the pages have been put together."""

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


def plain(app, what, name, thing, options, lines):
    """Docstrings are plain text with aligned columns: the first line as prose, the rest as it stands."""
    head, rest = lines[:1], lines[1:]
    lines[:] = [line.replace("|", "\\|").replace("*", "\\*") for line in head]
    if any(line.strip() for line in rest):
        lines += ["", "::", "", *("   " + line for line in rest), ""]


def setup(app):
    app.connect("autodoc-process-docstring", plain)
