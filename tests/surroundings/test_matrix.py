"""Every verb of the command line in every surrounding, and with every odd text in every place.

A new verb is in it by itself; `USUAL` is for one that would work for long otherwise.
"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.surroundings.__main__ import BEGIN, END, PAGE
from tests.surroundings.matrix import cells
from tests.surroundings.surroundings import ALL
from tests.surroundings.verbs import SECRET, Verb, standing_in, verbs

VERBS = verbs()
NAMES = {each.name for each in ALL}


@pytest.fixture(autouse=True)
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A folder of the test's own is the working directory, the home, and where all is kept."""
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "STATE_DIRECTORY"):
        monkeypatch.setenv(name, str(tmp_path))
    monkeypatch.setenv("TRANSIENTCAM_TOKEN", SECRET)
    monkeypatch.setenv("COLUMNS", "2000")  # what is framed would be broken
    with standing_in(tmp_path):
        yield


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.name)
def test_nothing_around_it_breaks_a_verb(verb: Verb) -> None:
    wrong = {(name, place): problem for name, place, _, problem in cells(verb) if problem}

    assert wrong == {}


_OTHER = ["setpriv", "--reuid", "23456", "--regid", "23456", "--clear-groups"]
_WITHOUT_POWERS = ["setpriv", "--bounding-set=-all", "--inh-caps=-all"]  # else root may write it


@pytest.mark.skipif(shutil.which("setpriv") is None, reason="setpriv is not installed")
@pytest.mark.parametrize("user", [_OTHER, _WITHOUT_POWERS], ids=["unknown", "read-only home"])
def test_another_user_or_a_home_that_may_not_be_written_breaks_no_verb(
    user: list[str], tmp_path: Path
) -> None:
    home = tmp_path / "home"
    home.mkdir(mode=0o555)
    around = {"PYTHONPATH": str(ROOT), "PATH": os.environ["PATH"], "TRANSIENTCAM_TOKEN": SECRET}
    around["TRANSIENTCAM_KERNELS"] = "manual"
    around |= {"HOME": str(home)} if user == _WITHOUT_POWERS else {}
    python = [*user, sys.executable]

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*python, *words], env=around, cwd="/", capture_output=True, text=True, check=False
        )

    if run("-c", "import transientcam.cli, encodings.utf_8_sig").returncode:
        pytest.skip("that user may not run this interpreter")
    done = run("-m", "tests.surroundings", "--as-usual")

    assert json.loads(done.stdout) == {}, done.stderr
    assert not list(home.iterdir())


def test_the_table_in_the_documentation_has_every_surrounding_and_no_fault() -> None:
    text = PAGE.read_text(encoding="utf-8").partition(BEGIN)[2].partition(END)[0]
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]

    shown = {name: (int(runs), int(faults)) for name, runs, *_, faults in rows[1:]}
    assert shown.keys() >= NAMES
    assert all(runs >= len(VERBS) for name, (runs, _) in shown.items() if name in NAMES)
    assert all(faults == 0 for _, faults in shown.values())
