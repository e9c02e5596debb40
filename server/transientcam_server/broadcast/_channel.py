"""Channels of the stream: one product for one client, numbered so that clients share bytes."""

from collections import Counter
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from itertools import count
from typing import Final

from transientcam import wire
from transientcam_driver import AppliedSequence, Capabilities
from transientcam_server.imaging import (
    MSGPACK,
    WHOLE,
    Crop,
    Encoding,
    Product,
    encoding_name,
    travelling,
)

UNNUMBERED: Final = -1
"""The number of a channel that has none yet."""
_EARLY_PERIODS = 0.1
_LONGEST_PERIOD_S = 1e9
"""Thirty years: after the first frame none is due. The inverse of the least rates is infinite."""


@dataclass(frozen=True, slots=True)
class DroppedFrames:
    """How many frames of a channel were dropped, and of these for want of an acknowledgement."""

    count: int
    unacknowledged: int


@dataclass(slots=True)
class Channel:
    """One product for one client: in which form and how often, and what of it was lost."""

    number: int
    product: Product
    max_rate_hz: float | None
    encoding: Encoding = MSGPACK
    crop: Crop = WHOLE
    next_due_s: float = float("-inf")
    dropped: int = 0
    dropped_unacknowledged: int = 0
    dropped_total: int = 0

    def describe(self, capabilities: Capabilities, applied: AppliedSequence) -> wire.Channel:
        """Return what its frames look like with a sequence of a camera."""
        rows, columns = self.crop.shape(capabilities.height, capabilities.width)
        whole = self.product.shape(applied, rows, columns)
        dtype, shape = travelling(self.product, self.encoding, whole)
        description = self.product.description
        return wire.Channel(
            channel=self.number,
            product=description.name,
            unit=description.unit,
            axes=description.axes,
            dtype=dtype,
            shape=shape,
            encoding=encoding_name(self.encoding),
            region=self.crop.region,
            decimation=self.crop.decimation,
        )

    def take_lost(self) -> DroppedFrames:
        """Return what was dropped since this was asked last, and count anew."""
        lost = DroppedFrames(self.dropped, self.dropped_unacknowledged)
        self.dropped = self.dropped_unacknowledged = 0
        return lost

    def take(self, time_s: float) -> bool:
        """Return whether the frame captured at ``time_s`` is due, and count on from there."""
        if self.max_rate_hz is None:
            return True
        period_s = min(1.0 / self.max_rate_hz, _LONGEST_PERIOD_S)
        # a little early will do: frames come with jitter, also at the very rate requested
        if time_s < self.next_due_s - _EARLY_PERIODS * period_s:
            return False
        # by schedule, so that the mean rate is the one requested; anew after a pause
        late = time_s - self.next_due_s > period_s
        self.next_due_s = (time_s if late else self.next_due_s) + period_s
        return True


class ChannelNumbers:
    """Gives equal channels of all clients one number, as long as there are any.

    A channel's product, encoding and crop make its number, not its rate. Numbers stay small: one
    without users is given to the next new form.
    """

    def __init__(self) -> None:
        self._numbers: dict[Hashable, int] = {}
        self._users: Counter[Hashable] = Counter()

    def assign(self, channels: Iterable[Channel]) -> None:
        """Give some channels their numbers; each has to be released once."""
        for channel in channels:
            form = _form(channel)
            self._users[form] += 1
            if form not in self._numbers:
                taken = set(self._numbers.values())
                self._numbers[form] = next(each for each in count() if each not in taken)
            channel.number = self._numbers[form]

    def release(self, channels: Iterable[Channel]) -> None:
        """Forget some channels that were numbered here."""
        for channel in channels:
            form = _form(channel)
            self._users[form] -= 1
            if self._users[form] <= 0:
                del self._users[form]
                self._numbers.pop(form, None)

    def __len__(self) -> int:
        return len(self._numbers)


def _form(channel: Channel) -> Hashable:
    return channel.product.name, channel.encoding.name, channel.crop
