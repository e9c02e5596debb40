"""The measurement of what accuracy costs: its grid, its results, its pages, and its resumption."""

import csv
import html
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Camera, Sequence, SequenceError, Truth, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_driver.simulation.responses import SparseResponses
from transientcam_experiments import commands, tradeoff
from transientcam_experiments.tradeoff import capture, computing, estimating, transport
from transientcam_experiments.tradeoff.records import key_of
from transientcam_experiments.tradeoff.truth import count_returns, cumulative, sample_pixels
from transientcam_server.errors.exceptions import InputError
from transientcam_server.settings import ReconstructionSettings

Array = NDArray[Any]
SMALL = tradeoff.Grid(tuple(Sequence(harmonics=m) for m in (1, 2, 3, 4)), (2,), (16,))


# -- the grid -----------------------------------------------------------------------------------


def test_named_grids_hold_the_papers_settings() -> None:
    paper = tradeoff.load_grid("paper").sequences

    assert Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005) in paper  # Sec. 6.3
    assert Sequence(harmonics=4, takes=20) in paper  # Fig. 8b
    assert Sequence(harmonics=4, takes=40) in paper  # Fig. 10
    assert len(set(paper)) == len(paper)


def test_a_file_lists_sequences_and_lists_in_it_stand_for_each_of_their_values(
    tmp_path: Path,
) -> None:
    file = tmp_path / "grid.toml"
    file.write_text(
        "bins = [32]\n[[sequence]]\nharmonics = [3, 4]\ntakes = [1, 5]\n"
        "[[sequence]]\nharmonics = 8\n"
        'base_frequency_hz = 11.5e6\nsub_phases = {scheme = "none", n = 1}\n'
    )

    grid = tradeoff.load_grid(str(file))

    assert grid.bins == (32,)
    assert [(each.harmonics, each.takes) for each in grid.sequences] == [
        (3, 1),
        (3, 5),
        (4, 1),
        (4, 5),
        (8, 1),
    ]
    assert grid.sequences[-1].sub_phases.scheme == "none"


@pytest.mark.parametrize(
    ("content", "error", "named"),
    [
        (None, InputError, "grid"),
        ("[[sequence", InputError, "TOML"),
        ("bins = [3]", InputError, "sequence"),
        ("bins = [0]\n[[sequence]]\nharmonics = 3", InputError, "bins"),
        ("[[sequence]]\nharmonics = [3, 99]", SequenceError, "harmonics"),
        ("[[sequence]]\nharmoniks = 3", SequenceError, "harmoniks"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_by_name(
    tmp_path: Path, content: str | None, error: type[Exception], named: str
) -> None:
    file = tmp_path / "grid.toml"
    if content is not None:
        file.write_text(content)

    with pytest.raises(error, match=named):
        tradeoff.load_grid(str(file))


# -- the front ----------------------------------------------------------------------------------


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), max_size=30))
def test_the_front_is_what_no_other_point_beats(points: list[tuple[int, int]]) -> None:
    found = tradeoff.front(points, cost=lambda p: p[0], error=lambda p: p[1])

    unbeaten = {
        point
        for point in points
        if not any(
            other[0] <= point[0] and other[1] <= point[1] and other != point for other in points
        )
    }
    assert set(found) == unbeaten
    assert found == sorted(unbeaten)


def test_points_that_were_not_measured_are_on_no_front() -> None:
    points = [(1.0, float("nan")), (2.0, 1.0), (float("inf"), 0.0)]

    assert tradeoff.front(points, cost=lambda p: p[0], error=lambda p: p[1]) == [(2.0, 1.0)]


# -- accuracy against the truth -------------------------------------------------------------------


def truth_of(delay_s: Array, weight: Array) -> Truth:
    shape = (len(delay_s), 1, 1)
    responses = SparseResponses(delay_s.reshape(shape), weight.reshape(shape))
    delays, weights = responses.returns()
    return Truth(delays, weights, "sparse", responses.of_pixel, 1.0)


def test_true_cumulative_light_steps_up_at_each_return() -> None:
    truth = truth_of(np.array([10e-9, 25e-9]), np.array([3.0, 1.0]))
    sample = sample_pixels(truth, pixels=5, seed=0)
    phase = 2 * np.pi * 20e6 * np.array([0.0, 9.9e-9, 10.1e-9, 24.9e-9, 25.1e-9, 49e-9])

    share = cumulative(sample, phase, base_frequency_hz=20e6)

    np.testing.assert_allclose(share[:, 0], [0, 0, 0.75, 0.75, 1, 1])


def test_returns_are_counted_from_a_share_of_the_strongest() -> None:
    weight = np.array([[1.0, 0.0, 0.05], [0.2, 0.0, 1.0], [0.05, 0.0, 0.2]])

    np.testing.assert_array_equal(count_returns(weight, threshold=0.1), [2, 0, 2])


def test_repeatability_of_normal_ranges_is_their_deviation() -> None:
    ranges = np.random.default_rng(0).normal(2.0, 0.03, (4, 20_000))
    ranges[0, :50] += 5.0  # a few strays tell nothing of a typical pixel
    ranges[:, -7] = np.nan

    assert capture.repeatability(ranges) == pytest.approx(0.03, rel=0.02)
    assert capture.repeatability(ranges[:1]) is None


@pytest.fixture(scope="module")
def camera() -> Iterator[Camera]:
    with open_camera("sim:mirrors?noise=off", clock=VirtualClock()) as opened:
        yield opened


def measured(camera: Camera, sequence: Sequence) -> dict[str, float | None]:
    applied = camera.configure(sequence)
    values, _ = capture.accuracy(
        capture.capture(camera, 2),
        lambda truth: sample_pixels(truth, pixels=100, seed=1),
        applied,
        settings=ReconstructionSettings(smoothing_px=0.0),
        bits=camera.capabilities.bits,
    )
    assert set(values) == set(capture.QUANTITIES)
    return values


def test_a_scene_that_moves_is_held_against_the_truth_of_each_frame(tmp_path: Path) -> None:
    grid = tradeoff.Grid((Sequence(harmonics=2, zeroth="estimated", exposure_s=0.0005),), ())
    points = tradeoff.points_of(grid, scene="visitor", repetitions=3, seed=1)
    records = tradeoff.Records(tmp_path)

    tradeoff.measure(points, records, scene="visitor", seed=1, progress=lambda kind: None)

    (found,) = records
    assert 0 < (found.values["range_median_m"] or 0) < 0.02


def test_without_noise_three_returns_are_measured_as_they_are(camera: Camera) -> None:
    values = measured(camera, Sequence(harmonics=3))

    assert (values["range_median_m"] or 0) < 1e-3
    assert (values["returns_right"] or 0) > 0.9
    assert (values["cumulative_mean"] or 0) < 0.03
    assert values["range_missing"] == 0
    assert (values["single_frequency_rmse_m"] or 0) > 0.3  # a mean of three returns


def test_the_cumulative_density_is_better_with_more_harmonics(camera: Camera) -> None:
    few, many = (measured(camera, Sequence(harmonics=m)) for m in (2, 4))

    for name in ("cumulative_mean", "bound_width"):
        assert (many[name] or 0) < (few[name] or 0)


# -- computing and transport ----------------------------------------------------------------------


def moments(m: int, pixels: int = 12) -> Array:
    random = np.random.default_rng(m)
    phase = random.uniform(0.3, 6.0, (3, pixels))
    weight = random.uniform(100, 500, (3, pixels))
    b = (weight * np.exp(1j * np.arange(m + 1)[:, None, None] * phase)).sum(axis=1)
    b[0] += 20.0
    return np.asarray(b)


@pytest.mark.parametrize("m", [2, 4])
def test_every_computing_task_is_near_its_reference_and_timed_by_the_clock(m: int) -> None:
    grid = replace(SMALL, harmonics=(m,))
    for task in computing.tasks(m, grid):
        ticks = map(float, range(100))
        values, spread = computing.measure(task, moments(m), repetitions=3, clock=ticks.__next__)

        assert values["seconds"] == 1.0
        assert spread["seconds"] == 0.0
        exact = task.point["dtype"] == "float64"
        loose = "quadrature" in task.point["method"]
        limit = 0.6 if loose else 1e-10 if exact else 1e-3
        assert 0 <= (values["error_worst"] or 0) < limit, dict(task.point)


def test_fifty_digits_and_double_precision_say_the_same_of_light() -> None:
    (task,) = [
        each
        for each in computing.tasks(3, SMALL)
        if each.point["task"] == "cumulative" and each.point["dtype"] == "float64"
    ]
    b = moments(3)

    exact = task.exact(b)

    # until a full turn all of it has come back
    assert exact.shape == (16, computing.EXACT_PIXELS)
    assert (np.diff(exact, axis=0) >= 0).all()
    assert (exact[-1] < b[0].real[: computing.EXACT_PIXELS]).all()


def test_every_technique_that_has_enough_harmonics_is_timed_and_held_against_the_truth() -> None:
    names = {m: [each.name for each, _ in estimating.points(m)] for m in (1, 3, 8)}
    assert {"pisarenko", "single-frequency", "sra"} <= set(names[1])
    assert "godbaz" not in names[3]
    assert {"godbaz", "spumic", "dorrington", "regularised"} <= set(names[8])
    assert "coded" not in names[8]

    # two returns 1 rad apart, of which the first is the wall
    phase = np.linspace(1.0, 2.0, 300).reshape((1, 15, 20))
    phase = np.concatenate([phase, phase + 1.0])
    b = (np.exp(1j * np.arange(9)[:, None, None, None] * phase) * [[[1.0]], [[0.6]]]).sum(axis=1)
    truth_m = np.where(phase[0] < 1.9, tm.range_m(phase[0], 23e6), np.nan)
    scene = estimating.Scene(b, 23e6, truth_m)
    errors = {}
    for technique, point in estimating.points(8):
        if technique.name not in ("pisarenko", "single-frequency", "sra"):
            continue
        ticks = (0.1 * each for each in range(100))
        values, spread = estimating.measure(
            technique, scene, repetitions=3, seed=1, clock=ticks.__next__
        )
        errors[technique.name] = values["range_median_m"] or 0.0
        assert point["estimator"] == technique.name
        assert values["range_missing"] == 0.0
        # a tick for the frame, or for a sample of it
        share = 0.1 if technique.planar else 0.1 * 300 / estimating.SAMPLE_PIXELS
        assert values["seconds"] == pytest.approx(share)
        assert (spread["seconds"] is None) is not technique.planar
    assert errors["pisarenko"] < 1e-9
    assert 1e-6 < errors["sra"] < 0.05
    assert errors["single-frequency"] > 0.2


@pytest.mark.parametrize("coding", list(transport.codings(3)), ids=lambda each: str(each.point))
def test_every_coding_comes_back_within_its_error(coding: transport.Coding) -> None:
    b = moments(3, pixels=40).reshape((4, 5, 8))
    range_m = np.random.default_rng(0).uniform(0.5, 6.0, (5, 8)).astype(np.float32)
    range_m[0, 0] = np.nan
    limits = {
        "f32": 0.0,
        "f32, deflated": 0.0,
        "f16": 0.05 if coding.point["product"] == "coefficients" else 2e-3,
        "png, 16 bits of 1 mm": 5.01e-4,
        "reflections, 16 bits": 1e-3,
        "reflections, 8 bits": 0.1,
    }

    values, _ = transport.measure(coding, b, range_m, repetitions=2)

    assert (values["error_median"] or 0) <= limits[str(coding.point["coding"])]
    assert (values["bytes"] or 0) > 0


def test_reflections_sent_are_those_of_the_recursion() -> None:
    coefficients = tm.levinson(moments(4))
    sent = transport._planes(coefficients)

    np.testing.assert_allclose(transport._reflections(sent), coefficients.reflection, atol=1e-9)


# -- results that stay ----------------------------------------------------------------------------


def record(number: int) -> tradeoff.Record:
    point = Sequence(harmonics=number).to_document()
    values = dict.fromkeys(capture.QUANTITIES, 0.5 / number)
    values["capture_s"] = 0.1 * number
    return tradeoff.Record("capture", "mirrors", point, {"seed": 1}, dict(values), dict(values))


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


class StoppedError(Exception):
    pass


def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path: Path) -> None:
    captures = replace(SMALL, harmonics=())  # what is timed takes its time
    points = tradeoff.points_of(captures, scene="mirrors", repetitions=2, seed=3)
    done: list[str] = []

    def stop_after_two(kind: str) -> None:
        done.append(kind)
        if len(done) == 2:
            raise StoppedError

    with pytest.raises(StoppedError):
        tradeoff.measure(
            points, tradeoff.Records(tmp_path), scene="mirrors", seed=3, progress=stop_after_two
        )
    kept = (tmp_path / "points.jsonl").read_bytes()
    resumed = tradeoff.Records(tmp_path)
    assert len(resumed) == 2

    again: list[str] = []
    tradeoff.measure(points, resumed, scene="mirrors", seed=3, progress=again.append)

    assert (tmp_path / "points.jsonl").read_bytes().startswith(kept)
    assert len(again) == len(points) == len(resumed)
    whole = tradeoff.Records(tmp_path / "in one go")
    tradeoff.measure(points, whole, scene="mirrors", seed=3, progress=again.append)
    assert list(tradeoff.Records(tmp_path)) == list(whole)


# -- what is made of them -------------------------------------------------------------------------


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
