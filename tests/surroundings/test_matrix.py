"""Every verb of the command line in every surrounding, and with every odd text in every place.

A new verb is in it by itself; `USUAL` is for one that would work for long otherwise.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.surroundings.matrix import cells
from tests.surroundings.verbs import SECRET, Verb, standing_in, verbs

VERBS = verbs()


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
