"""`paper` and `tradeoff` on a cluster, held against the runs of one process."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import dask
import distributed
import pytest

from transientcam.cli import run
from transientcam_experiments import tradeoff
from transientcam_experiments.tradeoff.clustered import measure_on


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Of a cluster of one thread, which starts in no time and is reached by its address."""
    with (
        dask.config.set({"distributed.worker.profile.enabled": False}),
        distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            processes=False,
            protocol="tcp",
            dashboard_address="127.0.0.1:0",
        ) as local,
        distributed.Client(local) as client,
    ):
        client.submit(int, pure=False).result()  # starts the worker's thread
        yield str(local.scheduler_address)


def test_captures_of_a_cluster_are_those_of_one_process(
    tmp_path: Path, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tradeoff, "report", lambda *_: [])  # draws for seconds
    grid = tmp_path / "grid.toml"
    table = '[[sequence]]\nharmonics = {}\nzeroth = "estimated"\nexposure_s = 5e-4\n'
    grid.write_text("harmonics = []\n" + "".join(map(table.format, (1, 2, 3))))
    command = ["tradeoff", "--sequence-grid", str(grid), "--repetitions", "2"]

    assert run([*command, "-o", str(tmp_path / "serial")]) == 0
    assert run([*command, "-o", str(tmp_path / "cluster"), "--dask", address]) == 0

    serial, cluster = (list(tradeoff.Records(tmp_path / name)) for name in ("serial", "cluster"))
    assert cluster == serial
    assert len(serial) == 3
    kept = (tmp_path / "cluster" / "points.jsonl").read_bytes()
    assert run([*command, "-o", str(tmp_path / "cluster"), "--dask", address]) == 0
    assert (tmp_path / "cluster" / "points.jsonl").read_bytes() == kept


def test_what_is_timed_is_not_given_to_a_cluster(tmp_path: Path, address: str) -> None:
    grid = tradeoff.Grid((), (2,), (16,))
    records = tradeoff.Records(tmp_path)
    of: Any = {"scene": "mirrors", "repetitions": 1, "seed": 1}
    with distributed.Client(address) as client:
        measure_on(client, grid, records, **of, progress=lambda kind: None)

    assert tradeoff.points_of(grid, **of)
    assert not len(records)


def test_figures_of_a_cluster_are_those_of_one_process(
    tmp_path: Path, address: str, capfd: pytest.CaptureFixture[str]
) -> None:
    command = ["paper", "7", "5", "--quick", "--json"]
    found: list[list[dict[str, Any]]] = []
    for name, options in (("serial", []), ("cluster", ["--dask", address])):
        assert run([*command, "-o", str(tmp_path / name), *options]) == 0
        found.append([each | {"seconds": 0} for each in json.loads(capfd.readouterr().out)])

    assert found[0] == found[1]
    assert [each["figure"] for each in found[1]] == [7, 5]
    for picture in ("figure-05.png", "figure-07.png"):
        serial, cluster = (
            (tmp_path / name / "figures" / "paper" / picture).read_bytes()
            for name in ("serial", "cluster")
        )
        assert serial == cluster


def test_a_scheduler_that_is_not_there_is_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    command = ["paper", "7", "-o", str(tmp_path), "--dask", "nonsense://head:8786"]

    assert run(command) == 1

    assert "nonsense://head:8786" in " ".join(capfd.readouterr().err.split())
