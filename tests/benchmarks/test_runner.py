"""The one runner of measurements."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks import __main__ as runner
from benchmarks.catalogue import MEASUREMENTS
from benchmarks.common.records import Record
from benchmarks.common.tables import Table

Asked = dict[str, object]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Asked:
    """Put one measurement in the place of `density`; what it is called with."""
    found: Asked = {}

    def tables(
        *,
        minutes: float = 1.5,
        scenes: tuple[str, ...] = ("a",),
        quick: bool = False,
        checkout: Path | None = None,
        figures: Path = Path(),
        write: bool = False,
    ) -> Iterator[Table]:
        """Measure nothing."""
        found.update(minutes=minutes, scenes=scenes, quick=quick, checkout=checkout)
        found.update(figures=figures.is_dir(), write=write)
        yield Table("What", ("is",), [("there",)])

    monkeypatch.setattr(runner, "function_of", lambda _: tables)
    return found


def test_options_are_the_arguments_of_the_function(asked: Asked) -> None:
    runner.main(["density", "--minutes", "2", "--scenes", "b", "c", "--quick", "--checkout", "x"])
    assert asked["minutes"] == 2.0
    assert asked["scenes"] == ["b", "c"]
    assert asked["quick"] is True
    assert asked["checkout"] == Path("x")


def test_what_is_not_asked_for_is_the_functions_own(asked: Asked) -> None:
    runner.main(["density"])
    assert asked == {
        "minutes": 1.5, "scenes": ("a",), "quick": False, "checkout": None,
        "figures": True, "write": False,
    }  # fmt: skip


def test_a_record_and_its_page_are_written_where_they_are_to_be_kept(
    asked: Asked, tmp_path: Path
) -> None:
    (tmp_path / "measured" / "records").mkdir(parents=True)
    (tmp_path / "figures").mkdir()
    page = tmp_path / "measured" / "benchmarks.md"
    page.write_text("<!-- measured: density -->\n<!-- end: density -->\n", encoding="utf-8")
    density = MEASUREMENTS["density"]
    options = {"minutes": 2.0, "scenes": ["b", "c"], "quick": True, "checkout": Path("/a/b")}
    runner.run(density, runner.function_of(density), options, write=True, docs=tmp_path)
    record = Record.read("density", tmp_path)
    assert record is not None
    assert record.command == (
        "python -m benchmarks density --minutes 2.0 --scenes b c --quick "
        "--checkout CHECKOUT --write"
    )
    assert not record.of_page
    assert "| there |" in page.read_text(encoding="utf-8")
    assert asked["write"] is True


def test_a_page_stands_for_its_measurements_and_all_for_what_needs_nothing() -> None:
    names = [each.name for each in runner.chosen(["benchmarks"])]
    assert names == [n for n, each in MEASUREMENTS.items() if each.page == "measured/benchmarks"]
    assert {each.name for each in runner.chosen(["all"])} == {
        name for name, each in MEASUREMENTS.items() if not each.by_hand
    }


def test_hyphens_name_a_measurement_too() -> None:
    assert [each.name for each in runner.chosen(["first-program"])] == ["first_program"]


def test_an_unknown_name_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        runner.main(["nothing"])
    assert "no measurement and no page is called nothing" in capsys.readouterr().err


def test_a_name_means_a_measurement_or_a_page_and_not_both() -> None:
    for name in MEASUREMENTS:
        assert name in [each.name for each in runner.chosen([name])]
