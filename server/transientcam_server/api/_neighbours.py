"""The cameras that announce themselves on the local network, searched for when a client asks."""

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

from transientcam import discovery
from transientcam.discovery import MAX_CAMERAS, FoundCamera, Search
from transientcam.errors import ServerUnreachable
from transientcam_server.settings import Settings

SEARCH_S: Final = 1.5
"""mDNS answers within 0.12 s (RFC 6762, 6); a question that was lost is asked again after 1 s."""
FRESH_S: Final = 5.0
"""A result is given to all who ask within this time: requests cause no more searches than this."""
KEPT_S: Final = 30.0
"""A camera is listed so long after its last answer, because mDNS may lose a packet."""
OFF: Final = "The setting `announce` is `off`, so that this service sends and reads no mDNS."


@dataclass(frozen=True, slots=True)
class Neighbours:
    """What is known of the network."""

    cameras: tuple[tuple[FoundCamera, float], ...] = ()
    """Each with the time since it answered, in s; by name."""
    left_out: int = 0
    """How many more were announced, which are not listed."""
    reason: str | None = None
    """Why the network was not searched; None where it was."""


class NeighbourSearch:
    """Searches the network where the last result is too old, once for all who wait for it.

    No request is sent to what is found: any host on the network can announce any address.

    ``search``: takes a while, and runs on another thread; None where the settings allow none.
    ``clock``: in s, monotonic.
    """

    def __init__(
        self, search: Callable[[], Search] | None, *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._search = search
        self._clock = clock
        self._seen_s: dict[FoundCamera, float] = {}
        self._searched_s: float | None = None
        self._left_out = 0
        self._reason: str | None = None
        self._searching: asyncio.Task[None] | None = None

    @classmethod
    def of(cls, settings: Settings) -> "NeighbourSearch":
        """Return the search that settings allow."""
        search = partial(discovery.search, timeout_s=SEARCH_S)
        return cls(None if settings.announce == "off" else search)

    async def neighbours(self) -> Neighbours:
        """Return what the last search found, after a new one where that is too old."""
        if self._search is None:
            return Neighbours(reason=OFF)
        if self._searched_s is None or self._clock() - self._searched_s >= FRESH_S:
            if self._searching is None:
                self._searching = asyncio.create_task(self._refresh(self._search))
                self._searching.add_done_callback(self._ended)
            await asyncio.shield(self._searching)  # others wait for it, too
        now_s = self._clock()
        cameras = sorted(self._seen_s, key=lambda camera: (camera.name, camera.url))
        ages = tuple((camera, now_s - self._seen_s[camera]) for camera in cameras)
        return Neighbours(ages, self._left_out, self._reason)

    async def _refresh(self, search: Callable[[], Search]) -> None:
        found, self._reason = Search((), 0), None
        try:
            found = await asyncio.to_thread(search)
        except ModuleNotFoundError as error:
            self._reason = (
                f"The Python package {error.name} is not installed: "
                "pip install 'transientcam[discovery]'."
            )
        except ServerUnreachable as error:
            self._reason = f"The network cannot be searched: {error.reason}."
        self._searched_s = now_s = self._clock()
        # those of this search first, as what it says of them is newer
        known = dict.fromkeys(found.cameras, now_s)
        for camera, seen_s in self._seen_s.items():
            if now_s - seen_s <= KEPT_S:
                known.setdefault(camera, seen_s)
        self._seen_s = dict(list(known.items())[:MAX_CAMERAS])
        self._left_out = found.left_out + len(known) - len(self._seen_s)

    def _ended(self, _: asyncio.Task[None]) -> None:
        self._searching = None
