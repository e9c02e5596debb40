"""The documentation site: no link leads nowhere, and no page asks another host for anything."""

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.catalogue import MEASUREMENTS
from tests.conftest import ROOT
from transientcam_experiments.paper import FIGURES

_DOCS = ROOT / "docs"
_PAGE = """
# A page

```{toctree}
```

The phase $\\varphi$ and

$$b_j = \\int_0^{2\\pi} g(\\varphi) \\, \\mathrm{d}\\varphi$$

```python
import quokka
```

```{eval-rst}
.. autofunction:: transientcam.density
```
"""


def sphinx(builder: str, source: Path, to: Path) -> "subprocess.CompletedProcess[str]":
    """Build with the site's settings; every warning fails, as in ``make docs-site``."""
    strict = ["--quiet", "--fail-on-warning", "--keep-going", "--conf-dir", str(_DOCS)]
    command = [sys.executable, "-m", "sphinx", *strict, "--builder", builder, str(source), str(to)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A site of one page, with all that pages are made of."""
    source, to = (tmp_path_factory.mktemp(name) for name in ("source", "site"))
    (source / "index.md").write_text(_PAGE, "utf-8")
    built = sphinx("html", source, to)
    assert built.returncode == 0, built.stderr
    return to


def test_every_link_of_the_site_leads_somewhere(tmp_path: Path) -> None:
    """All pages are read and all references resolved; only writing HTML is left out."""
    built = sphinx("dummy", _DOCS, tmp_path)

    assert (built.returncode, built.stderr) == (0, "")


@pytest.mark.parametrize(
    "wrong", ["[a page](nowhere.md)", "[a heading](#nowhere)", "[a file](../nowhere.py)"]
)
def test_a_link_that_leads_nowhere_fails_the_build(tmp_path: Path, wrong: str) -> None:
    source = tmp_path / "source"
    source.mkdir()
    (source / "index.md").write_text(f"# A page\n\n{wrong}\n", "utf-8")

    built = sphinx("dummy", source, tmp_path / "site")

    assert built.returncode != 0
    assert "nowhere" in built.stderr


def test_no_page_asks_another_host_for_anything(small: Path) -> None:
    fetched = re.compile(r"""(?:src=|url\(|@import |<link [^>]*href=)["']?(?:https?:)?//""")
    files = [path for path in small.rglob("*") if path.suffix in (".html", ".css")]

    assert len(files) > 3
    assert [path for path in files if fetched.search(path.read_text("utf-8"))] == []


def test_formulas_are_drawn_without_a_script(small: Path) -> None:
    page = (small / "index.html").read_text("utf-8")

    assert page.count("<math ") == 2
    assert "mathjax" not in "".join(re.findall(r"<script[^>]*>", page)).lower()


def test_a_docstring_is_a_definition_that_can_be_linked_to(small: Path) -> None:
    page = (small / "index.html").read_text("utf-8")

    assert 'id="transientcam.density"' in page
    assert "Parameters" in page
    assert ":module:" not in page


@pytest.mark.parametrize("package", ["transientcam", "transientcam_driver", "transientcam_moments"])
def test_the_reference_has_a_page_for_each_package(package: str) -> None:
    page = (_DOCS / "api" / f"{package}.md").read_text("utf-8")

    assert f"```{{eval-rst}}\n.. automodule:: {package}\n" in page
    assert f"\napi/{package}\n" in (_DOCS / "index.md").read_text("utf-8")


def test_search_looks_in_a_script_beside_the_pages(small: Path) -> None:
    """A script can be loaded from a file; what is fetched needs a server."""
    assert 'src="searchindex.js"' in (small / "search.html").read_text("utf-8")
    assert '"quokka"' in (small / "searchindex.js").read_text("utf-8")


@pytest.mark.skipif(shutil.which("node") is None, reason="Node.js is not installed")
def test_a_search_finds_decisions_after_everything_else(small: Path) -> None:
    """The weights are those of the site's own script, as the browser loads it."""
    script = (small / "_static" / "language_data.js").read_text("utf-8")
    program = f"""globalThis.window = globalThis; {script}
        const best = 30;
        const found = ["decisions/17-kinect", "measured/notes/kinect", "cameras", "kinect2"]
            .map((page, at) => [Scorer.score([page, "Kinect", "", null, best - at, ""]), page]);
        console.log(found.sort(([a], [b]) => b - a).map(([, page]) => page).join());
    """
    done = subprocess.run(["node", "-e", program], capture_output=True, text=True, check=True)

    assert done.stdout == "cameras,kinect2,decisions/17-kinect,measured/notes/kinect\n"


def test_the_reference_of_the_client_begins_with_its_camera() -> None:
    page = (_DOCS / "api" / "transientcam.md").read_text("utf-8")

    assert page.index("```python") < page.index("autoclass:: transientcam.Camera")
    assert page.index("autoclass:: transientcam.Camera") < page.index("automodule:: transientcam")


def test_the_gallery_has_every_figure_and_a_command_beside_each() -> None:
    page = (_DOCS / "gallery.md").read_text("utf-8")
    shown = set(re.findall(r"\]\((figures/[^)]+)\)", page))
    commands = re.findall(r"```sh\n(.*?)\n```", page)

    pictures = (p for p in (_DOCS / "figures").rglob("*") if p.suffix in (".png", ".gif"))
    assert shown == {path.relative_to(_DOCS).as_posix() for path in pictures}
    assert page.count("\n*") == len(commands)
    for command in commands:
        if measured := re.match(r"python -m benchmarks (\w+) --write", command):
            assert measured.group(1) in MEASUREMENTS, command
        elif drawn := re.fullmatch(r"python -m (tools\.\w+)", command):
            assert importlib.util.find_spec(drawn.group(1)), command
        else:
            number = re.fullmatch(r"transientcam paper (\d+) -o docs", command)
            assert number, command
            assert int(number.group(1)) in FIGURES
