"""Ctrl-C in a terminal while `paper` and `tradeoff` compute with `--workers N`."""

from pathlib import Path

import pytest

from tests.interrupting import Hold, interrupt
from transientcam.cli import run
from transientcam_experiments import tradeoff


def test_ctrl_c_ends_the_workers_of_the_paper_and_keeps_the_figures_that_are_made(
    tmp_path: Path,
) -> None:
    page = tmp_path / "paper.md"

    def there() -> bool:
        return page.exists() and "figure-07.png" in page.read_text(encoding="utf-8")

    interrupt(
        tmp_path,
        *("paper", "7", "5", "--quick", "-o", str(tmp_path)),
        hold=Hold(
            "transientcam_experiments.paper.making",
            "made_by_worker",
            "lambda number, *others: number != 7",
        ),
        once=there,
    )
    pictures = (tmp_path / "figures" / "paper").glob("*.png")
    assert [each.name for each in pictures] == ["figure-07.png"]


def test_ctrl_c_ends_the_workers_of_a_tradeoff_which_goes_on_where_it_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    grid, output = tmp_path / "grid.toml", tmp_path / "found"
    table = '[[sequence]]\nharmonics = {}\nzeroth = "estimated"\nexposure_s = 5e-4\n'
    grid.write_text("harmonics = []\n" + "".join(map(table.format, (1, 2, 3))))
    command = ["tradeoff", "--sequence-grid", str(grid), "--repetitions", "1", "-o", str(output)]
    points = output / "points.jsonl"
    interrupt(
        tmp_path,
        *command,
        hold=Hold(
            "transientcam_experiments.tradeoff.clustered",
            "measured",
            "lambda grid, scene, repetitions, seed, number, versions: number > 0",
        ),
        once=lambda: points.exists() and points.read_bytes().count(b"\n") == 1,
    )
    kept = points.read_bytes()
    assert (output / "index.html").exists()  # of what was measured so far

    monkeypatch.setattr(tradeoff, "report", lambda *_: [])  # draws for seconds
    assert run(command) == 0

    assert points.read_bytes().startswith(kept)
    assert len(tradeoff.Records(output)) == 3
