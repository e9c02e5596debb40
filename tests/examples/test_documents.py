"""The Python of the pages Start and How to runs as it stands, before one daemon."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam import Camera

_BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
_ADDRESS = "http://127.0.0.1:8000"
_FIRST = "import numpy as np\nimport transientcam\nimport transientcam_moments as tm\n"
_PAGES = (
    "docs/add-an-estimator.md",
    "docs/notebooks.md",
    "docs/record.md",
    "docs/service.md",
    "docs/start.md",
    "docs/calibration.md",  # which puts a diffuser before the lens: the last one
)
_ELSEWHERE = {
    "README.md": "test_readme.py pastes it whole",
    "docs/add-a-camera.md": "tests/server/camera/plug_in.py runs its plug-in",
    "docs/gpu.md": "needs a GPU; tests/moments/gpu call the same with software ones",
    "docs/operations.md": "looks for cameras in the whole network",
    "docs/plan-a-sequence.md": "tests/notebooks plans, with fewer sequences to choose from",
    "docs/robots.md": "needs a film that mitransient rendered",
}
_QUICKER = {"frames=40": "frames=8", '"examples/': f'"{ROOT}/examples/'}
_TREE = re.compile(r"^:caption: (?:Start|How to)\n:hidden:\n\n(.*?)^```", re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with serving("sim:wall?noise=off") as daemon, Camera(daemon.url, timeout_s=60.0) as camera:
        daemon.start_all_workers()  # later they would look like threads that a test left behind
        camera.sequence = {"harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}
        with camera.stream("range") as stream:
            stream.receive()
        yield daemon


@pytest.fixture(scope="module")
def recording(served: Served, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The ``light.h5`` that pages speak of."""
    path = tmp_path_factory.mktemp("recording") / "light.h5"
    with Camera(served.url, timeout_s=60.0) as camera:
        started = camera.record(frames=2)
        wait_until(lambda: camera.recording(started["id"])["state"] == "complete")
        camera.download_recording(started["id"], path)
    return path


def test_every_page_with_python_is_run_here_or_named() -> None:
    index = (ROOT / "docs" / "index.md").read_text("utf-8")
    names = " ".join(_TREE.findall(index)).split()
    pages = ["README.md", *(f"docs/{name}.md" for name in names)]
    found = {page for page in pages if _BLOCK.search((ROOT / page).read_text("utf-8"))}

    assert found == {*_PAGES, *_ELSEWHERE}


@pytest.mark.parametrize("page", _PAGES)
def test_python_of_a_page_runs(
    served: Served, recording: Path, monkeypatch: pytest.MonkeyPatch, page: str
) -> None:
    monkeypatch.chdir(recording.parent)
    if page == "docs/calibration.md":
        with Camera(served.url, timeout_s=60.0) as before:
            before.simulate(diffuser=True)
    names: dict[str, Any] = {}
    exec(_FIRST, names)
    blocks = _BLOCK.findall((ROOT / page).read_text("utf-8"))

    for block in blocks:
        program = block.replace(_ADDRESS, served.url)
        for slow, quick in _QUICKER.items():
            program = program.replace(slow, quick)
        exec(compile(program, page, "exec"), names)

    if isinstance(names.get("camera"), Camera):
        names["camera"].close()
    assert blocks
