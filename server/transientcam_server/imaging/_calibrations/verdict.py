"""The verdict on a calibration measurement: whether it was measured on a diffuser."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, Self, get_args

Word = Literal["diffusor", "in-doubt", "scene"]
SCENE_SHARE: Final = 0.2
"""From this share of unlike pixels on it is a scene, whatever else was found."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One test."""

    test: str
    """Its name, a key of `REASONS`."""
    value: float
    limit: float
    """``value``, ``limit``: what was found (NaN: nothing could be), and the most that a diffuser
    may have."""
    unit: str
    """``m``, ``rad`` or ``share``."""

    @property
    def kept(self) -> bool:
        """Whether the limit is kept."""
        return abs(self.value) <= self.limit  # not by NaN

    def to_document(self) -> dict[str, Any]:
        """Return it as JSON."""
        value = self.value if math.isfinite(self.value) else None
        return {
            "test": self.test,
            "value": value,
            "limit": self.limit,
            "unit": self.unit,
            "kept": self.kept,
        }


_FILE: Final = Path(__file__).with_name("reasons.toml")
REASONS: Final[Mapping[str, str]] = tomllib.loads(_FILE.read_text("utf-8"))
"""Of a test that failed, in words."""
_FAR: Final = frozenset({"offset_m", "low_frequency_m"})
_FLAT_WALL: Final = (
    " A flat wall there cannot be told from a diffuser with a delay of the electronics."
)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a calibration was measured on a diffuser, and what that rests on."""

    word: Word
    """``diffusor``; ``scene``; or ``in-doubt``, where it may be either."""
    findings: tuple[Finding, ...]
    """The tests."""
    block_px: int
    """Side in pixels of the blocks that were judged."""
    blocks: tuple[str, ...]
    """A text for each row of blocks with a character a block: ``.`` like a diffuser, ``#`` unlike
    one, ``?`` not judged."""
    reference: str
    """What the measurement was compared with: the id of a calibration, or ``nominal``."""

    @property
    def trusted(self) -> bool:
        """Whether the calibration may be used without being forced."""
        return self.word == "diffusor"

    @property
    def reason(self) -> str | None:
        """Return what speaks against a diffuser; None where nothing does."""
        failed = [each for each in self.findings if not each.kept]
        if not failed:
            return None
        said = [
            REASONS[each.test].format(value=each.value, limit=each.limit)
            for each in failed
            if math.isfinite(each.value)
        ]
        text = "; ".join(said) or "no pixel has light that can be judged"
        text = text[0].upper() + text[1:] + "."
        only_far = all(each.test in _FAR for each in failed)
        return text + _FLAT_WALL if self.word == "in-doubt" and only_far else text

    def to_document(self) -> dict[str, Any]:
        """Return the verdict as JSON."""
        return {
            "verdict": self.word,
            "reason": self.reason,
            "tests": [each.to_document() for each in self.findings],
            "block_px": self.block_px,
            "blocks": list(self.blocks),
            "reference": self.reference,
        }

    @classmethod
    def from_document(cls, document: object) -> Self | None:
        """Read what `to_document` returned; None for anything else."""
        try:
            assert isinstance(document, Mapping)  # noqa: S101 - caught below
            word = document["verdict"]
            if word not in get_args(Word):
                return None
            findings = tuple(
                Finding(
                    str(each["test"]),
                    math.nan if each["value"] is None else float(each["value"]),
                    float(each["limit"]),
                    str(each["unit"]),
                )
                for each in document["tests"]
                if each["test"] in REASONS
            )
            blocks = tuple(str(row) for row in document["blocks"])
            return cls(
                word, findings, int(document["block_px"]), blocks, str(document["reference"])
            )
        except (AssertionError, KeyError, TypeError, ValueError):
            return None


def word_of(findings: tuple[Finding, ...]) -> Word:
    """Return what the tests amount to.

    Pixels that differ make a scene where they are many, or where the light comes from afar, too.
    """
    values = {each.test: each for each in findings}
    if all(each.kept for each in findings):
        return "diffusor"
    unlike, offset = values["unlike_share"], values["offset_m"]
    if unlike.value > SCENE_SHARE or (unlike.value > unlike.limit and not offset.kept):
        return "scene"
    return "in-doubt"
