"""The verbs `transientcam paper` and `transientcam tradeoff`."""

import json
from pathlib import Path

import numpy as np
import pytest

from transientcam.cli import run
from transientcam_experiments import commands, tradeoff


def test_figures_are_made_checked_and_put_on_a_page(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["paper", "7", "5", "-o", str(tmp_path / "out"), "--quick"]) == 0

    page = (tmp_path / "out" / "paper.md").read_text(encoding="utf-8")
    assert page.index("## Figure 5") < page.index("## Figure 7")
    for name in ("figure-05.png", "figure-07.png"):
        picture = (tmp_path / "out" / "figures" / "paper" / name).read_bytes()
        assert picture.startswith(b"\x89PNG")
    said = capfd.readouterr().err
    assert "Figure 7, Error bounds on smoothed densities:" in said
    assert "statements hold" in said


def test_json_holds_every_number(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["paper", "7", "-o", str(tmp_path), "--quick", "--json", "--seed", "5"]) == 0

    (document,) = json.loads(capfd.readouterr().out)
    assert (document["figure"], document["quick"], document["seed"]) == (7, True, 5)
    assert all({"says", "value", "passes"} <= set(each) for each in document["statements"])
    known = json.loads((tmp_path / "figures" / "paper" / "paper.json").read_text(encoding="utf-8"))
    assert known == [document]


def test_an_unknown_figure_is_refused_before_anything_is_made(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["paper", "7", "4", "-o", str(tmp_path / "out"), "--quick"]) == 2

    said = " ".join(capfd.readouterr().err.split())
    assert "4 is none of 2, 3, 5" in said
    assert not (tmp_path / "out").exists()


def test_a_measured_waveform_joins_figure_3(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    phase = 2 * np.pi * np.arange(500) / 500
    square = np.sign(np.sin(phase)) + 1
    np.save(tmp_path / "square.npy", np.stack([square, 2 - square]))
    options = ["--quick", "--json", "--waveform", str(tmp_path / "square.npy")]

    assert run(["paper", "3", "-o", str(tmp_path / "out"), *options]) == 0

    (document,) = json.loads(capfd.readouterr().out)
    (table,) = (each for each in document["tables"] if each["title"].startswith("square:"))
    (plain,) = (row for row in table["rows"] if row[0] == "as it is")
    third, fifth = (float(plain[k].rstrip("%")) / 100 for k in (2, 3))
    assert (third, fifth) == pytest.approx((1 / 3, 1 / 5), abs=2e-3)  # of a square wave


@pytest.mark.parametrize("content", [b"", b"not numpy", None])
def test_a_file_that_is_no_waveform_is_refused_in_a_sentence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], content: bytes | None
) -> None:
    path = tmp_path / "waveform.npy"
    if content is None:
        np.save(path, np.zeros(7))
    else:
        path.write_bytes(content)

    code = run(["paper", "3", "-o", str(tmp_path), "--quick", "--waveform", str(path)])

    assert code == 1
    assert "waveform.npy" in " ".join(capfd.readouterr().err.split())


def test_the_command_measures_reports_and_says_so_as_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    grid = tmp_path / "grid.toml"
    grid.write_text("harmonics = []\n[[sequence]]\nharmonics = 2\n")
    output = tmp_path / "results"

    commands.tradeoff(output=output, sequence_grid=str(grid), repetitions=2, as_json=True)

    said = json.loads(capsys.readouterr().out)
    assert said["points"] == len(tradeoff.Records(output))
    assert all(Path(name).is_file() for name in said["written"])
    assert str(output / "index.html") in said["written"]
