"""Which daemons come and go on the network, for ``transientcam devices --watch``."""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from datetime import datetime
from typing import Final, Literal

from transientcam.cli.terminal import echo
from transientcam.discovery import FoundCamera

Change = Literal["here", "gone"]
MISSED: Final = 3
"""Searches in a row without an answer until a daemon counts as gone: mDNS may lose a packet."""


class Presence:
    """Who was found so far, and who of them is still there."""

    def __init__(self) -> None:
        self._known: dict[FoundCamera, int] = {}

    def update(self, found: Iterable[FoundCamera]) -> Iterator[tuple[Change, FoundCamera]]:
        """Take the result of a search, and return what has changed; a new address is a new one."""
        present = set(found)
        for camera in sorted(present - self._known.keys(), key=lambda each: each.name):
            yield "here", camera
        missing = {camera: missed + 1 for camera, missed in self._known.items()}
        self._known = missing | dict.fromkeys(present, 0)
        for camera in [each for each, missed in self._known.items() if missed == MISSED]:
            del self._known[camera]
            yield "gone", camera


def watch(
    search: Callable[[], Iterable[FoundCamera]], *, now: Callable[[], datetime], as_json: bool
) -> None:
    """Search again and again, and print a line for each change, until it is interrupted."""
    presence = Presence()
    while True:
        for change, camera in presence.update(search()):
            time = now().isoformat(sep=" ", timespec="seconds")
            if as_json:
                echo(json.dumps({"time": time, "change": change, **asdict(camera)}))
            else:
                echo(f"{time}  {change}  {camera.url}  {camera.serial or '?'}  {camera.name}")
