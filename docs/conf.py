"""Settings of the documentation site: ``make docs-site`` writes it to build/site.

Nothing on a page is fetched from another host: the theme uses the reader's own fonts, formulas are
MathML, and search runs in the browser over an index that lies beside the pages.
"""

import importlib.metadata
import re
import sys
import tomllib
from pathlib import Path

from docutils import nodes
from docutils.utils.math import latex2mathml
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

sys.path.insert(0, str(Path(__file__).parents[1]))
from benchmarks.common.records import marked

_PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))[
    "project"
]

project = _PROJECT["name"]
release = version = importlib.metadata.version("transientcam")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]

html_theme = "furo"
html_title = f"transientcam {release}"
html_favicon = "../client/dashboard/public/icon.svg"
html_show_copyright = False
html_copy_source = False
html_show_search_summary = False  # it is fetched, which a page that is a file may not
html_search_scorer = str(Path(__file__).with_name("search_scorer.js"))
html_math_renderer = "mathml"

# as GitHub reads the same files: anchors of all headings, and formulas between dollars
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]

# types of parameters are prose with shapes, not names to link
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_param = False
napoleon_use_rtype = False
autodoc_member_order = "groupwise"
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True, "imported-members": True}


def _inline(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(latex2mathml.tex2mathml(node.astext()))
    raise nodes.SkipNode


def _block(self: HTML5Translator, node: nodes.math_block) -> None:
    self.body.append(latex2mathml.tex2mathml(node.astext(), as_block=True))
    raise nodes.SkipNode


def _moduli(_app: Sphinx, _what: str, _name: str, _of: object, _: object, lines: list[str]) -> None:
    """Let |x| in a docstring be a modulus, not a substitution; literals stay as they are."""
    for number, line in enumerate(lines):
        parts = re.split("(``.*?``)", line)
        parts[::2] = [re.sub(r"\|(?=\S)([^|]*)\|", r"\|\1\|", part) for part in parts[::2]]
        lines[number] = "".join(parts)


def _left_out(
    _app: Sphinx, _what: str, _name: str, of: object, _skip: bool, _: object
) -> bool | None:
    """Leave out fields of named tuples that say nothing: their class lists them."""
    said = str(getattr(of, "__doc__", ""))
    return True if said.startswith("Alias for field number") else None


def _measured(_app: Sphinx, _page: str, source: list[str]) -> None:
    """Say what was measured of other code than there is now."""
    source[0] = marked(source[0])


def setup(app: Sphinx) -> None:
    """Register formulas as MathML, which browsers draw without a script, and recorded bytes."""
    app.connect("source-read", _measured)
    app.connect("autodoc-process-docstring", _moduli)
    app.connect("autodoc-skip-member", _left_out)
    app.add_lexer("hex", TextLexer)
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
