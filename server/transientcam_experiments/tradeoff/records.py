"""Results on disk: one line each, appended once measured, so that an interruption loses none."""

import csv
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

FILE: Final = "points.jsonl"


@dataclass(frozen=True, slots=True)
class Record:
    """The results at one point."""

    kind: str
    """"capture", "computing", "estimating" or "transport"."""
    scene: str
    """Name of the scene."""
    point: Mapping[str, Any]
    """The settings; scene and conditions complete them."""
    conditions: Mapping[str, Any]
    """Seed, repetitions and the like: what else is needed to repeat it."""
    values: Mapping[str, float | None]
    spread: Mapping[str, float | None]
    """``values``, ``spread``: mean and standard deviation over the repetitions, by quantity; None
    where it has none."""
    took_s: float = field(default=0.0, compare=False)
    """Time that the measurement took."""

    @property
    def key(self) -> str:
        """The same for the same measurement."""
        return key_of(self.kind, self.scene, self.point, self.conditions)


def key_of(kind: str, scene: str, point: Mapping[str, Any], conditions: Mapping[str, Any]) -> str:
    """Return the text that identifies a measurement."""
    return json.dumps([kind, scene, point, conditions], sort_keys=True)


class Records:
    """The results in a folder.

    ``folder``: is made where it is missing. Results already in it stay.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._path = folder / FILE
        self._records: dict[str, Record] = {}
        whole = 0
        if self._path.exists():
            content = self._path.read_bytes()
            whole = content.rfind(b"\n") + 1
            for line in content[:whole].splitlines():
                record = Record(**json.loads(line))
                self._records[record.key] = record
            # a line cut short by a kill is dropped and measured again
            with self._path.open("r+b") as file:
                file.truncate(whole)

    def __iter__(self) -> Iterator[Record]:
        return iter(self._records.values())

    def __len__(self) -> int:
        return len(self._records)

    def __contains__(self, key: object) -> bool:
        return key in self._records

    def append(self, record: Record) -> None:
        """Store a result; when this returns it is on the disk."""
        line = {name: getattr(record, name) for name in Record.__slots__}
        with self._path.open("ab") as file:
            file.write(json.dumps(line, allow_nan=False).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
        self._records[record.key] = record


def write_csv(path: Path, records: Iterable[Record]) -> None:
    """Write results as a table: settings, then each quantity and its spread."""
    rows = [_row(record) for record in records]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)


def _row(record: Record) -> dict[str, Any]:
    row: dict[str, Any] = {"scene": record.scene}
    for name, value in record.point.items():
        if isinstance(value, Mapping):
            row |= {f"{name}_{part}": each for part, each in value.items()}
        else:
            row[name] = value
    for name, mean in record.values.items():
        row |= {name: mean, f"{name}_spread": record.spread[name]}
    return row | dict(record.conditions)
