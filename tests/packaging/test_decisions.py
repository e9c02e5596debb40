"""Records in docs/decisions: what each has to say, and that references to them lead somewhere."""

import re
from pathlib import Path

import pytest

from tests.conftest import ROOT

_FOLDER = ROOT / "docs" / "decisions"
_RECORDS = sorted(_FOLDER.glob("[0-9]*.md"))
_STATUS = re.compile(r"(proposed|accepted|superseded by \d+)(?=$|;)")
_REFERENCE = re.compile(r"\b[Dd]ecisions?[ \n]+(\d+)(?: and (\d+))?")
_ROW = re.compile(
    r"^\| (?P<area>[^|]+) \| \[(?P<number>\d+)\]\((?P<file>[^)]+)\) \| (?P<title>[^|]+) "
    r"\| (?P<status>[^|]+) \| (?P<replaces>[^|]+) \|$",
    re.MULTILINE,
)
_SOURCES = ("server", "driver", "client", "benchmarks", "tests", "docs", "examples", "notebooks")


def _field(text: str, name: str) -> str:
    found = re.search(rf"^\*\*{name}:\*\* (.+?) *$", text, re.MULTILINE)
    assert found, f"no {name}"
    return found.group(1)


def _texts() -> list[Path]:
    """What people write by hand, and may refer to a decision."""
    kinds = (".py", ".md", ".ts", ".tsx")
    below = (path for folder in _SOURCES for path in (ROOT / folder).rglob("*"))
    return [
        *ROOT.glob("*.md"),
        *(p for p in below if p.suffix in kinds and "node_modules" not in p.parts),
    ]


@pytest.mark.parametrize("path", _RECORDS, ids=lambda path: path.stem)
def test_a_record_has_a_number_a_status_and_its_headings(path: Path) -> None:
    text = path.read_text("utf-8")

    assert text.startswith(f"# {int(path.name.split('-')[0])}. ")
    assert _STATUS.match(_field(text, "Status"))
    for heading in ("Context", "Decision", "Consequences"):
        assert f"\n## {heading}\n" in text, heading


def test_the_index_lists_every_record_as_the_record_says() -> None:
    rows = {row["file"]: row for row in _ROW.finditer((_FOLDER / "index.md").read_text("utf-8"))}

    assert list(rows) == [path.name for path in _RECORDS]
    for path in _RECORDS:
        text, row = path.read_text("utf-8"), rows[path.name]
        assert f"# {row['number']}. {row['title']}\n" in text
        assert row["status"] == _field(text, "Status").split(";")[0]
        assert row["area"] == _field(text, "Area")
        if row["replaces"].strip() != "–":
            assert row["replaces"] == _field(text, "Replaces")


def test_each_earlier_number_is_in_one_record() -> None:
    numbers = re.findall(
        r"\b\d{4}\b",
        " ".join(
            row["replaces"] for row in _ROW.finditer((_FOLDER / "index.md").read_text("utf-8"))
        ),
    )

    assert numbers
    assert len(numbers) == len(set(numbers))


def test_every_decision_that_is_referred_to_exists() -> None:
    known = {int(path.name.split("-")[0]) for path in _RECORDS}

    referred = [
        (path.relative_to(ROOT).as_posix(), int(number))
        for path in _texts()
        for numbers in _REFERENCE.findall(path.read_text("utf-8"))
        for number in filter(None, numbers)
    ]

    assert referred
    assert [each for each in referred if each[1] not in known] == []
