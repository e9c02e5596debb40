"""Numbers of channels: what travels to several clients has one number, so its bytes are shared."""

from collections import Counter
from collections.abc import Hashable, Iterable
from itertools import count

from transientcam_server.broadcast.outbox import Channel


class ChannelNumbers:
    """Gives equal channels of all clients one number, as long as there are any.

    A channel's product, encoding and crop make its number, not its rate. Numbers stay small: one
    that nobody uses any more is given to what comes next.
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
