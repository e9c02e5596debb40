"""The lease of the service that is relayed, had as long as a client has this one's."""

import asyncio
from concurrent.futures import Future
from functools import partial
from typing import Final

from transientcam_server.camera._acquisition import Acquisition
from transientcam_server.camera._lease import Lease
from transientcam_server.relay import RelayCamera

RELEASED_S: Final = 5.0
"""Time to wait until the origin has confirmed that it has its lease back."""


class OriginLease:
    """Takes it on the thread of the camera, behind all other changes, and gives it back at once."""

    def __init__(self, relay: RelayCamera, acquisition: Acquisition) -> None:
        self._relay = relay
        self._acquisition = acquisition
        self._released: Future[None] | None = None

    async def take(self, lease: Lease, *, takeover: bool) -> None:
        """Take it on the terms of a lease that was granted here.

        Raises OriginRefused, CameraLost where it cannot be had.
        """
        take = partial(
            self._relay.take_lease,
            lease.holder,
            duration_s=lease.duration_s,
            on_lapse=lease.on_lapse,
            takeover=takeover,
        )
        await asyncio.wrap_future(self._acquisition.submit(take))

    def release(self) -> None:
        """Give it back; the origin is told again and again until it confirms that."""
        self._released = self._relay.release_lease()

    async def released(self) -> None:
        """Wait until it is given back, or for `RELEASED_S`."""
        if self._released is not None:
            confirmed = asyncio.wrap_future(self._released)
            confirmed.add_done_callback(lambda done: done.cancelled() or done.exception())
            await asyncio.wait((confirmed,), timeout=RELEASED_S)
