"""Results on disk: each kept when it is written."""

from pathlib import Path

from tests.experiments.tradeoff.results import record
from transientcam_experiments import tradeoff
from transientcam_experiments.tradeoff.records import key_of


def test_results_are_on_disk_when_they_are_kept(tmp_path: Path) -> None:
    tradeoff.Records(tmp_path).append(record(3))

    (again,) = tradeoff.Records(tmp_path)

    assert again == record(3)
    assert record(3).key in tradeoff.Records(tmp_path)


def test_a_line_that_a_kill_cut_short_is_measured_again(tmp_path: Path) -> None:
    records = tradeoff.Records(tmp_path)
    records.append(record(3))
    file = tmp_path / "points.jsonl"
    whole = file.read_bytes()
    file.write_bytes(whole + b'{"kind": "capt')

    resumed = tradeoff.Records(tmp_path)
    resumed.append(record(4))

    assert [each.point["harmonics"] for each in tradeoff.Records(tmp_path)] == [3, 4]
    assert file.read_bytes().startswith(whole)


def test_another_seed_is_another_measurement() -> None:
    keys = {key_of("capture", "mirrors", {"a": 1}, {"seed": seed}) for seed in (1, 2)}

    assert len(keys) == 2
