"""Opening recordings where what reads them is absent, and addresses that are none."""

from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import transientcam
from transientcam import opening
from transientcam.errors import MissingExtra, ParameterError


def offers(monkeypatch: pytest.MonkeyPatch, *points: EntryPoint) -> None:
    monkeypatch.setattr(opening, "entry_points", lambda group: list(points))


@pytest.mark.parametrize("value", ["", "no_such_package.opening:open"])
def test_what_has_to_be_installed_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, value: str
) -> None:
    offers(monkeypatch, *([EntryPoint("hdf5", value, opening.GROUP)] if value else []))

    with pytest.raises(MissingExtra, match=r"pip install 'transientcam\[server\]'"):
        transientcam.open(tmp_path / "a.h5")


@pytest.mark.parametrize(
    "url",
    [
        "http://camera",
        "http://camera/api/v1/recordings/",
        "http://camera/api/v1/recordings/a/frames",
        "http://camera/api/v1/recordings/a?b=1",
        "ftp://camera/api/v1/recordings/a",
    ],
)
def test_an_address_of_no_recording_is_refused(monkeypatch: pytest.MonkeyPatch, url: str) -> None:
    offers(monkeypatch, EntryPoint("hdf5", "io:BytesIO", opening.GROUP))

    with pytest.raises(ParameterError):
        transientcam.open(url)


def test_the_entry_point_of_this_distribution_is_where_its_function_is() -> None:
    point = EntryPoint("hdf5", "transientcam_server.offline._opening:open_recording", opening.GROUP)
    project = Path(__file__).parents[2] / "pyproject.toml"

    assert callable(point.load())
    assert f'{point.name} = "{point.value}"' in project.read_text(encoding="utf-8")
