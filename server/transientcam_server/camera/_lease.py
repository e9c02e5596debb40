"""The lease: which client may change the camera, and until when; all others only watch.

Everything here runs on the event loop. The clock and its timers are arguments.
"""

import logging
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, Literal, Protocol

from transientcam_server.errors import Problem, kinds

_log = logging.getLogger("transientcam_server.camera.lease")
DEFAULT_DURATION_S: Final = 30.0
MIN_DURATION_S: Final = 1.0
MAX_DURATION_S: Final = 3600.0

OnLapse = Literal["stop", "keep"]
Change = Literal["granted", "released", "lapsed", "taken-over"]


@dataclass(frozen=True, slots=True)
class Lease:
    """Permission to change the camera, for the client that presents its ``id``."""

    id: str = field(repr=False)
    """The secret that its holder sends with every change."""
    holder: str
    """Name that the holder gave itself."""
    by: str
    """Authenticated identity of the holder."""
    rank: int
    """Rank of the holder; a client of a lower rank cannot take it over."""
    duration_s: float
    on_lapse: OnLapse
    """Whether the capture, and with it the light, stops when it is not renewed in time."""
    expires_s: float
    """By the manager's clock."""


class Timer(Protocol):
    """A call that is scheduled, as an `asyncio.TimerHandle`."""

    def cancel(self) -> None:
        """Drop the scheduled call."""


Report = Callable[[Change, Lease, Lease | None], None]
"""Called with each change: its kind, the lease, and the lease that this one replaced."""


class LeaseManager:
    """Grants, renews and ends the lease; at most one exists at a time.

    ``report``: called with every change; a renewal is not one.
    ``call_later``: schedules a call after a delay in seconds.
    ``due``: called with the lease that is valid from now on, None for none: what acts on its end
    although nothing is scheduled any more.
    """

    def __init__(
        self,
        *,
        report: Report,
        call_later: Callable[[float, Callable[[], None]], Timer],
        due: Callable[[Lease | None], None] = lambda lease: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._reported = report
        self._call_later = call_later
        self._due = due
        self._clock = clock
        self._lease: Lease | None = None
        self._timer: Timer | None = None

    @property
    def current(self) -> Lease | None:
        """The lease that is valid now."""
        self._expire()
        return self._lease

    def remaining_s(self, lease: Lease) -> float:
        """Return how long a lease lasts unless it is renewed."""
        return max(0.0, lease.expires_s - self._clock())

    def grant(
        self,
        *,
        holder: str,
        by: str,
        rank: int,
        duration_s: float,
        on_lapse: OnLapse,
        takeover: bool,
    ) -> Lease:
        """Grant the lease to a client.

        Raises Problem ``lease-held`` if another client has it, and ``takeover`` is false or the
        rank too low.
        """
        former = self.current
        if former is not None and not (takeover and rank >= former.rank):
            raise self._held_problem(former)
        lease = Lease(secrets.token_urlsafe(16), holder, by, rank, duration_s, on_lapse, 0.0)
        lease = self._keep(lease)
        self._report("granted" if former is None else "taken-over", lease, former)
        return lease

    def renew(
        self, lease_id: str | None, *, duration_s: float | None, on_lapse: OnLapse | None
    ) -> Lease:
        """Restart the lease's duration, on its former terms where none are given.

        Raises Problem ``lease-lost`` if it is not the current one.
        """
        lease = self._require_current(lease_id)
        return self._keep(
            replace(
                lease,
                duration_s=lease.duration_s if duration_s is None else duration_s,
                on_lapse=lease.on_lapse if on_lapse is None else on_lapse,
            )
        )

    def release(self, lease_id: str | None) -> None:
        """End the lease; the camera goes on as its holder left it.

        Raises Problem ``lease-lost`` if it is not the current one.
        """
        lease = self._require_current(lease_id)
        self._forget()
        self._report("released", lease, None)

    def check(self, lease_id: str | None) -> None:
        """Allow a change under this lease, or under none while no client holds one.

        Raises Problem ``lease-held`` if another client has the lease, ``lease-lost`` if it has
        ended.
        """
        lease = self.current
        if lease_id is not None:
            # a client that relies on its lease must be notified that it has ended
            self._require_current(lease_id)
        elif lease is not None:
            raise self._held_problem(lease)

    def close(self) -> None:
        """Drop the lease and its timer without a report."""
        self._forget()

    def _require_current(self, lease_id: str | None) -> Lease:
        lease, given = self.current, (lease_id or "").encode("utf-8", "surrogateescape")
        if lease is not None and secrets.compare_digest(lease.id.encode(), given):
            return lease
        if lease is not None:
            raise Problem(
                kinds.LEASE_LOST,
                f"This lease has ended; {lease.holder} holds the current one.",
                **self._extensions(lease),
            )
        raise Problem(kinds.LEASE_LOST, "This lease has ended; no client holds one.", holder=None)

    def _held_problem(self, lease: Lease) -> Problem:
        return Problem(
            kinds.LEASE_HELD,
            f"{lease.holder} controls the camera, for {self.remaining_s(lease):.1f} s unless it "
            "is renewed.",
            **self._extensions(lease),
        )

    def _extensions(self, lease: Lease) -> dict[str, object]:
        return {"holder": lease.holder, "expires_in_s": self.remaining_s(lease)}

    def _keep(self, lease: Lease) -> Lease:
        self._forget()
        self._lease = replace(lease, expires_s=self._clock() + lease.duration_s)
        self._due(self._lease)
        self._timer = self._call_later(lease.duration_s, self._timer_fired)
        return self._lease

    def _forget(self) -> None:
        self._lease = None
        self._due(None)
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _expire(self) -> None:
        lease = self._lease
        if lease is not None and self.remaining_s(lease) == 0.0:
            self._forget()
            self._report("lapsed", lease, None)

    def _report(self, change: Change, lease: Lease, former: Lease | None) -> None:
        who = f"{lease.holder!r} ({lease.by})"
        if former is not None:
            _log.warning("%s took the lease over from %r (%s)", who, former.holder, former.by)
        elif change == "lapsed":
            _log.warning("the lease of %r lapsed; on lapse: %s", lease.holder, lease.on_lapse)
        else:
            _log.info("the lease of %s was %s", who, change)
        self._reported(change, lease, former)

    def _timer_fired(self) -> None:
        self._expire()
        if self._lease is not None:  # the timer runs by another clock and may be early
            self._timer = self._call_later(self.remaining_s(self._lease), self._timer_fired)
