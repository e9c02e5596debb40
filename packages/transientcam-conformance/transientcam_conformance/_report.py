"""The results of checks."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from transientcam_conformance._check import Check
from transientcam_conformance._rate import Rate

Outcome = Literal["passed", "failed", "skipped"]


@dataclass(frozen=True, slots=True)
class Result:
    """The result of one check."""

    check: Check
    outcome: Outcome
    reason: str | None
    """Why it failed or was skipped; None if it passed."""
    duration_s: float

    def to_document(self) -> dict[str, Any]:
        """Return it as a map."""
        return {
            "group": self.check.group,
            "name": self.check.name,
            "promise": self.check.promise,
            "outcome": self.outcome,
            "reason": self.reason,
            "duration_s": round(self.duration_s, 3),
        }


@dataclass(frozen=True, slots=True)
class Report:
    """The results of all checks."""

    url: str
    camera: Mapping[str, Any]
    """Model, serial and firmware of the camera, name and version of its service; empty if they
    could not be read."""
    began_s: float
    """Unix time."""
    duration_s: float
    results: Sequence[Result]
    slow: Rate | None = None
    """The camera's rate where it did not keep it, and checks were skipped for that."""

    @property
    def counts(self) -> dict[str, int]:
        """How many checks had each outcome."""
        counted = Counter(each.outcome for each in self.results)
        return {name: counted[name] for name in ("passed", "failed", "skipped")}

    @property
    def failed(self) -> tuple[Result, ...]:
        """Promises that are not kept."""
        return tuple(each for each in self.results if each.outcome == "failed")

    def to_document(self) -> dict[str, Any]:
        """Return it as a map that JSON can hold."""
        return {
            "url": self.url,
            "camera": dict(self.camera),
            "began_s": self.began_s,
            "duration_s": round(self.duration_s, 3),
            **self.counts,
            "slow": None if self.slow is None else self.slow.to_document(),
            "checks": [each.to_document() for each in self.results],
        }
