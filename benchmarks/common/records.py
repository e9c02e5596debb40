"""Records of measurements: what came of each, at which commit, when, by which command, on what.

A record is docs/measured/records/NAME.json. A page has, between two marks, what its records say:
`rendered` puts it there, so that a page is written anew without measuring.
"""

import json
import re
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.catalogue import MEASUREMENTS, Measurement
from benchmarks.common.tables import Table

ROOT: Final = Path(__file__).parents[2]
DOCS: Final = ROOT / "docs"
FIGURES: Final = DOCS / "figures"


@dataclass(frozen=True, slots=True)
class Record:
    """What a measurement found."""

    name: str
    """Of the measurement."""
    command: str
    """That repeats it."""
    commit: str
    """Short name of the commit that was measured; with " and changes" where files were changed."""
    date: str
    """As in 2026-11-25."""
    machine: str | None
    """None where the figures do not depend on it."""
    tables: Sequence[Table]
    """What was found."""
    of_page: bool = False
    """Whether commit and date are those of the page's last change instead: it was measured before
    there were records."""

    def written(self, docs: Path = DOCS) -> Path:
        """Write it, and return the file."""
        document = {name: getattr(self, name) for name in self.__slots__ if name != "tables"} | {
            "tables": [table.to_document() for table in self.tables]
        }
        path = _file_of(self.name, docs)
        text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
        # a row of a table is a line
        text = re.sub(r"\[\n {5,}([^\[\]]*?)\n {4,}\]", _on_one_line, text)
        path.write_text(text + "\n", encoding="utf-8")
        return path

    @classmethod
    def read(cls, name: str, docs: Path = DOCS) -> "Record | None":
        """Return the record of a measurement, if there is one."""
        path = _file_of(name, docs)
        if not path.exists():
            return None
        document = json.loads(path.read_text(encoding="utf-8"))
        tables = [Table.from_document(each) for each in document.pop("tables")]
        return cls(**document, tables=tables)

    def markdown(self, level: int) -> str:
        """Return it for a page."""
        when = "committed as" if self.of_page else "at commit"
        source = f"Measured by `{self.command}`, {when} {self.commit}, {self.date}"
        on = "; no machine has a part in it" if self.machine is None else f", on: {self.machine}"
        return "\n\n".join([*(table.markdown(level) for table in self.tables), f"{source}{on}."])


def _on_one_line(found: re.Match[str]) -> str:
    return "[" + re.sub(r"\n +", " ", found.group(1)) + "]"


def _file_of(name: str, docs: Path) -> Path:
    return docs / "measured" / "records" / f"{name}.json"


def page_of(measurement: Measurement, docs: Path = DOCS) -> Path:
    """Return the file of a measurement's page."""
    return docs / f"{measurement.page}.md"


def rendered(text: str, docs: Path = DOCS) -> str:
    """Return a page with what the records say now between its marks."""

    def region(found: re.Match[str]) -> str:
        record = Record.read(found.group(1), docs)
        if record is None:
            return found.group()
        body = record.markdown(MEASUREMENTS[record.name].level)
        return f"<!-- measured: {record.name} -->\n{body}\n<!-- end: {record.name} -->"

    return re.sub(r"<!-- measured: (\w+) -->\n.*?<!-- end: \1 -->", region, text, flags=re.DOTALL)


def render(pages: Sequence[Path], docs: Path = DOCS) -> None:
    """Write what the records say into pages."""
    for page in pages:
        text = page.read_text(encoding="utf-8")
        page.write_text(rendered(text, docs), encoding="utf-8")


def changes_since(record: Record, repository: Path = ROOT) -> int | None:
    """Count the commits that changed what a record measures; None where git does not know."""
    commit, *_ = record.commit.split()
    words = ["rev-list", "--count", f"{commit}..HEAD", "--", *MEASUREMENTS[record.name].of]
    command = ["git", "-C", str(repository), *words]
    try:
        counted = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return int(counted.stdout)


def marked(
    text: str, changes: Callable[[Record], int | None] = changes_since, docs: Path = DOCS
) -> str:
    """Return a page that says of each record where its code has changed since."""

    def mark(found: re.Match[str]) -> str:
        record = Record.read(found.group(1), docs)
        count = changes(record) if record is not None else None
        if not count:
            return found.group()
        commits = "one commit has" if count == 1 else f"{count} commits have"
        said = f"Since then {commits} changed the code that is measured here."
        return f"\n```{{note}}\n{said}\n```\n{found.group()}"

    return re.sub(r"<!-- end: (\w+) -->", mark, text)
