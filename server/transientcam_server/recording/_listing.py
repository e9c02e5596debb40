"""Which of many recordings are asked for: by words, by a tag, in an order, a page at a time."""

import json
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import Any, Final, Literal

from transientcam_server.recording._layout import SUFFIX

Order = Literal["-started_s", "started_s", "name", "-size_bytes", "-duration_s", "-frames"]
"""By a field of the description; ``-`` puts the newest or largest first."""
_SEARCHED: Final = ("id", "name", "camera", "annotations")
_SUMMED: Final = ("frames", "size_bytes", "duration_s")


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
) -> dict[str, Any]:
    """Return a page of those whose `_SEARCHED` fields have all words of ``search``, and the tag.

    ``totals`` and ``tags``, how many have each, are of all that match; ``next_offset`` is None on
    the last page.
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
    counted = Counter(tag for each in found for tag in tags_of(each["annotations"]))
    return {
        "recordings": found[offset:end],
        "totals": {"recordings": len(found), **totals},
        "tags": dict(counted.most_common()),
        "next_offset": end if end < len(found) else None,
    }


def _key(value: Any) -> Any:
    return value.casefold() if isinstance(value, str) else value or 0.0


def _text(described: Mapping[str, Any]) -> str:
    fields = [described[name] for name in _SEARCHED]
    return json.dumps(fields, ensure_ascii=False, separators=(" ", " ")).casefold()


_UNNAMED: Final = "Recording of"
_LONGEST: Final = 80


def default_name(moment: datetime) -> str:
    """Return the name of a recording that was given none, by the moment it began (UTC)."""
    return f"{_UNNAMED} {moment:%Y-%m-%d %H:%M:%S} UTC"


def download_name(name: str, recording_id: str) -> str:
    """Return the name of a downloaded file: what the recording is called, and its id.

    Letters, digits, dots and underscores of ASCII are kept, of a name's first 80; an id says
    already when a recording began, so a name that says no more is left out.
    """
    called = "recording" if name.startswith(_UNNAMED) else name
    plain = unicodedata.normalize("NFKD", called).encode("ascii", "ignore").decode()
    words = re.sub(r"[^A-Za-z0-9._]+", "-", plain)[:_LONGEST].strip("-.")
    return "-".join(filter(None, (words, recording_id))) + SUFFIX
