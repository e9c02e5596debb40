"""Records of measurements and the pages that they are rendered to."""

import re
import subprocess
from pathlib import Path

import pytest

from benchmarks.catalogue import MEASUREMENTS
from benchmarks.common.records import DOCS, ROOT, Record, changes_since, marked, page_of, rendered
from benchmarks.common.tables import Column, Table

_MARK = re.compile(r"<!-- measured: (\w+) -->")
PAGES = sorted({page_of(each) for each in MEASUREMENTS.values() if each.page is not None})


def a_record(**changes: object) -> Record:
    rows = [["wall", 1.5, None], ["corner", float("nan"), "12 of 20"]]
    heads = ["scene", Column("mm", ".2f"), "found"]
    tables = [Table("Errors", heads, rows, ["Bar: 2 mm."], ["Of"]), Table("", text=["No table."])]
    known = {"command": "python -m benchmarks x", "commit": "abc", "date": "2026-01-02"}
    made = {"name": "density", "machine": None, "tables": tables, **known, **changes}
    return Record(**made)  # type: ignore[arg-type]


def docs(folder: Path) -> Path:
    (folder / "measured" / "records").mkdir(parents=True)
    return folder


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_committed_page_is_what_its_records_render_to(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert rendered(text) == text, "run: python -m benchmarks render"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_has_a_place_for_each_of_its_measurements_and_no_other(page: Path) -> None:
    own = {each.name for each in MEASUREMENTS.values() if each.page and page_of(each) == page}
    assert sorted(_MARK.findall(page.read_text(encoding="utf-8"))) == sorted(own)


def test_every_record_is_of_a_measurement_with_a_page() -> None:
    named = {name for name, each in MEASUREMENTS.items() if each.page is not None}
    assert {path.stem for path in (DOCS / "measured" / "records").glob("*.json")} <= named


def test_no_other_page_has_a_place_for_a_measurement() -> None:
    others = set(DOCS.rglob("*.md")) - set(PAGES)
    assert not [page for page in others if _MARK.search(page.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("name", MEASUREMENTS)
def test_what_is_measured_is_there(name: str) -> None:
    measurement = MEASUREMENTS[name]
    source = ROOT / "benchmarks" / f"{measurement.module.replace('.', '/')}.py"
    assert f"\ndef {measurement.function}(" in source.read_text(encoding="utf-8")
    assert all((ROOT / path).exists() for path in measurement.of)
    assert measurement.page is None or measurement.of


def test_a_record_is_read_as_it_was_written_but_for_what_is_no_number(tmp_path: Path) -> None:
    record = a_record()
    record.written(docs(tmp_path))
    read = Record.read("density", tmp_path)
    assert read is not None
    assert read.markdown(2) == record.markdown(2)
    assert read.tables[0].rows == [["wall", 1.5, None], ["corner", None, "12 of 20"]]


def test_a_record_is_rendered_between_the_marks_of_its_name_alone(tmp_path: Path) -> None:
    a_record().written(docs(tmp_path))
    before = "# Page\n\n<!-- measured: density -->\nold\n<!-- end: density -->\nafter\n"
    text = rendered(before, tmp_path)
    assert text == (
        "# Page\n\n<!-- measured: density -->\n## Errors\n\nOf\n\n"
        "| scene | mm | found |\n|---|---:|---:|\n"
        "| wall | 1.50 | – |\n| corner | – | 12 of 20 |\n\nBar: 2 mm.\n\nNo table.\n\n"
        "Measured by `python -m benchmarks x`, at commit abc, 2026-01-02; no machine has a part in "
        "it.\n<!-- end: density -->\nafter\n"
    )
    other = "<!-- measured: stages -->\nold\n<!-- end: stages -->\n"
    assert rendered(other, tmp_path) == other


def test_a_record_of_a_page_says_that_its_commit_is_the_pages() -> None:
    text = a_record(of_page=True, machine="a machine").markdown(3)
    assert text.startswith("### Errors")
    assert text.endswith("committed as abc, 2026-01-02, on: a machine.")


def test_columns_of_words_line_up_on_the_left_and_items_of_a_list_stay_together() -> None:
    table = Table("", ["what", "bars"], [["1", "missed: 3"]], ["- one", "- two", "end"])
    assert (
        table.markdown() == "| what | bars |\n|---|---|\n| 1 | missed: 3 |\n\n- one\n- two\n\nend"
    )


def test_a_page_says_where_the_code_has_changed_since(tmp_path: Path) -> None:
    a_record().written(docs(tmp_path))
    text = "<!-- measured: density -->\n<!-- end: density -->\n<!-- end: stages -->\n"

    assert marked(text, lambda _: 3, tmp_path) == (
        "<!-- measured: density -->\n\n```{note}\nSince then 3 commits have changed the code that "
        "is measured here.\n```\n<!-- end: density -->\n<!-- end: stages -->\n"
    )
    assert "one commit has" in marked(text, lambda _: 1, tmp_path)
    assert marked(text, lambda _: 0, tmp_path) == text
    assert marked(text, lambda _: None, tmp_path) == text


def test_commits_count_that_changed_what_is_measured(tmp_path: Path) -> None:
    def git(*words: str) -> str:
        author = ("-c", "user.name=a", "-c", "user.email=a@b")
        command = ["git", "-C", str(tmp_path), *author, *words]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    def commit(path: str, text: str) -> str:
        file = tmp_path / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        git("add", "-A")
        git("commit", "-qm", text)
        return git("rev-parse", "HEAD")

    (measured,) = MEASUREMENTS["density"].of
    git("init", "-q")
    first = commit(f"{measured}/a.py", "1")
    commit("elsewhere.py", "2")
    last = commit(f"{measured}/a.py", "3")

    assert changes_since(a_record(commit=first), tmp_path) == 1
    assert changes_since(a_record(commit=f"{last} and changes"), tmp_path) == 0
    assert changes_since(a_record(commit="0" * 40), tmp_path) is None
    assert changes_since(a_record(commit=first), tmp_path / "nowhere") is None
