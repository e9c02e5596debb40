"""What recordings and their files are called."""

import re
import unicodedata
from datetime import datetime
from typing import Final

from transientcam_server.recording._layout import SUFFIX

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
