"""Table, plots and page of the results."""

import csv
import html
import json
import re
from pathlib import Path

import pytest

from tests.experiments.tradeoff.results import record
from transientcam_driver import Sequence
from transientcam_experiments import tradeoff


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    records = tradeoff.Records(folder)
    for number in (2, 3, 4):
        records.append(record(number))
    tradeoff.report(folder, records)
    return folder


def test_the_table_has_a_row_for_each_point_with_its_spread(reported: Path) -> None:
    with (reported / "capture.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))

    assert [row["harmonics"] for row in rows] == ["2", "3", "4"]
    assert float(rows[1]["range_rmse_m"]) == float(rows[1]["range_rmse_m_spread"]) == 0.5 / 3
    assert rows[0]["sub_phases_scheme"] == "arccos"


def test_plots_are_drawn_as_png_and_svg(reported: Path) -> None:
    assert (reported / "mirrors-range.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in (reported / "mirrors-range.svg").read_bytes()


def test_the_page_needs_no_other_file_and_no_other_host(reported: Path) -> None:
    page = (reported / "index.html").read_text()

    loaded = re.findall(r"""(?:src|href)\s*=\s*["']?([^"'\s>]+)""", page)
    assert all(each.startswith("#") for each in loaded)
    assert "@import" not in page
    assert "url(http" not in page


def test_every_point_of_the_page_can_be_copied_as_a_sequence(reported: Path) -> None:
    page = (reported / "index.html").read_text()

    bodies = re.findall(r'data-sequence="([^"]*)"', page)
    sequences = [Sequence.from_document(json.loads(html.unescape(body))) for body in bodies]

    assert [sequence.harmonics for sequence in sequences] == [2, 3, 4]
    assert page.count("class=copy>") == 3
    drawn = set(re.findall(r'data-point="(\w+)"', page))
    assert drawn == set(re.findall(r'id="row-(\w+)"', page))


def test_ids_in_the_page_are_unique(reported: Path) -> None:
    ids = re.findall(r'\sid="([^"]+)"', (reported / "index.html").read_text())

    assert len(ids) == len(set(ids))
