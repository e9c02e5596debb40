"""One controller, many watchers: who may change things, and until when.

Everything here lives on the event loop. Time and its alarms are arguments.
"""

import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, Literal, Protocol

from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem

DEFAULT_DURATION_S: Final = 30.0
MIN_DURATION_S: Final = 1.0
MAX_DURATION_S: Final = 3600.0

OnLapse = Literal["stop", "keep"]
Change = Literal["granted", "released", "lapsed", "taken-over"]


@dataclass(frozen=True, slots=True)
class Lease:
    """Leave to change things, for somebody who shows its ``id``.

    Attributes
    ----------
    id
        The secret that its holder shows with every change.
    holder
        What the holder calls itself.
    by
        Who has shown to be asking.
    rank
        The rank of whoever took it; nobody of a lower rank takes it over.
    on_lapse
        Whether the capture, and with it the light, ends when nobody renews it in time.
    expires_s
        By the desk's clock.
    """

    id: str = field(repr=False)
    holder: str
    by: str
    rank: int
    duration_s: float
    on_lapse: OnLapse
    expires_s: float


class Alarm(Protocol):
    """Something that will happen, unless it is cancelled."""

    def cancel(self) -> None:
        """Let it not happen."""


Report = Callable[[Change, Lease, Lease | None], None]
"""Told of every change: what, the lease it is about, and the one that this one replaced."""


class LeaseManager:
    """Where the lease is asked for, renewed and given back.

    Parameters
    ----------
    report
        Called with every change; renewals are none.
    alarm
        Calls a function after so many seconds.
    """

    def __init__(
        self,
        *,
        report: Report,
        alarm: Callable[[float, Callable[[], None]], Alarm],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._report = report
        self._set_alarm = alarm
        self._clock = clock
        self._lease: Lease | None = None
        self._alarm: Alarm | None = None

    @property
    def current(self) -> Lease | None:
        """The lease that holds now."""
        self._expire()
        return self._lease

    def remaining_s(self, lease: Lease) -> float:
        """Return how long a lease lasts if nobody renews it."""
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
        """Give the lease to somebody.

        Raises
        ------
        Problem
            ``lease-held`` if somebody has it, and it was not to be taken over or may not be.
        """
        former = self.current
        if former is not None and not (takeover and rank >= former.rank):
            raise self._held(former)
        lease = Lease(secrets.token_urlsafe(16), holder, by, rank, duration_s, on_lapse, 0.0)
        lease = self._keep(lease)
        self._report("granted" if former is None else "taken-over", lease, former)
        return lease

    def renew(
        self, lease_id: str | None, *, duration_s: float | None, on_lapse: OnLapse | None
    ) -> Lease:
        """Let the lease last from now on, on its former terms where none are given.

        Raises
        ------
        Problem
            ``lease-lost`` if it is not the one that holds.
        """
        lease = self._held_as(lease_id)
        return self._keep(
            replace(
                lease,
                duration_s=lease.duration_s if duration_s is None else duration_s,
                on_lapse=lease.on_lapse if on_lapse is None else on_lapse,
            )
        )

    def release(self, lease_id: str | None) -> None:
        """Give the lease back; the camera goes on as its holder left it.

        Raises
        ------
        Problem
            ``lease-lost`` if it is not the one that holds.
        """
        lease = self._held_as(lease_id)
        self._forget()
        self._report("released", lease, None)

    def check(self, lease_id: str | None) -> None:
        """Let a change pass that is made under this lease, or under none while nobody holds one.

        Raises
        ------
        Problem
            ``lease-held`` if somebody else has the lease, ``lease-lost`` if it is no more.
        """
        lease = self.current
        if lease_id is not None:
            # who believes to be alone in control must hear that this is over
            self._held_as(lease_id)
        elif lease is not None:
            raise self._held(lease)

    def close(self) -> None:
        """Forget the lease and its alarm; nobody is told."""
        self._forget()

    def _held_as(self, lease_id: str | None) -> Lease:
        lease = self.current
        if lease is not None and secrets.compare_digest(lease.id.encode(), _bytes(lease_id)):
            return lease
        if lease is not None:
            raise Problem(
                kinds.LEASE_LOST,
                f"This lease is over; {lease.holder} has one.",
                **self._extensions(lease),
            )
        raise Problem(kinds.LEASE_LOST, "This lease is over; nobody has one.", holder=None)

    def _held(self, lease: Lease) -> Problem:
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
        self._alarm = self._set_alarm(lease.duration_s, self._ring)
        return self._lease

    def _forget(self) -> None:
        self._lease = None
        if self._alarm is not None:
            self._alarm.cancel()
            self._alarm = None

    def _expire(self) -> None:
        lease = self._lease
        if lease is not None and self.remaining_s(lease) == 0.0:
            self._forget()
            self._report("lapsed", lease, None)

    def _ring(self) -> None:
        self._expire()
        if self._lease is not None:  # an alarm may ring a little early by another clock
            self._alarm = self._set_alarm(self.remaining_s(self._lease), self._ring)


def _bytes(text: str | None) -> bytes:
    return b"" if text is None else text.encode("utf-8", "surrogateescape")
