"""Which of many recordings are asked for: by words, by a tag, in an order, a page at a time."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, Final, Literal

Order = Literal["-started_s", "started_s", "name", "-size_bytes", "-duration_s", "-frames"]
"""By a field of the description; ``-`` puts the newest or largest first."""
_SEARCHED: Final = ("id", "name", "camera", "annotations")
_SUMMED: Final = ("frames", "size_bytes", "duration_s")


@dataclass(frozen=True, slots=True)
class Listing:
    """A page of descriptions, and of all that match: totals, and how many have each tag."""

    recordings: Sequence[dict[str, Any]]
    totals: Mapping[str, float]
    tags: Mapping[str, int]
    next_offset: int | None


def tags_of(annotations: Mapping[str, Any]) -> list[str]:
    """Return the tags in annotations: a list of texts, or a text with commas between them."""
    given = annotations.get("tags")
    listed = given.split(",") if isinstance(given, str) else given
    texts = listed if isinstance(listed, list | tuple) else ()
    return list(dict.fromkeys(t for each in texts if isinstance(each, str) and (t := each.strip())))


def select(
    described: Iterable[dict[str, Any]],
    *,
    search: str = "",
    tag: str | None = None,
    order: Order = "-started_s",
    offset: int = 0,
    limit: int,
) -> Listing:
    """Return the recordings whose text has all words of ``search``, in any case, and the ``tag``.

    The text is what a description has in `_SEARCHED`.
    """
    found = [
        each
        for each in described
        if (tag is None or tag in tags_of(each["annotations"]))
        and all(map(_text(each).__contains__, search.casefold().split()))
    ]
    field, backwards = order.removeprefix("-"), order.startswith("-")
    found.sort(key=lambda each: (_key(each[field]), each["id"]), reverse=backwards)
    end = offset + limit
    totals = {name: sum(each[name] for each in found) for name in _SUMMED}
    return Listing(
        found[offset:end],
        {"recordings": len(found), **totals},
        dict(Counter(tag for each in found for tag in tags_of(each["annotations"])).most_common()),
        end if end < len(found) else None,
    )


def _key(value: Any) -> Any:
    return value.casefold() if isinstance(value, str) else value or 0.0


def _text(described: Mapping[str, Any]) -> str:
    return " ".join(_texts([described[name] for name in _SEARCHED])).casefold()


def _texts(value: Any) -> Iterable[str]:
    if isinstance(value, Mapping):
        value = [*value.keys(), *value.values()]
    return chain(*map(_texts, value)) if isinstance(value, list | tuple) else (f"{value}",)
