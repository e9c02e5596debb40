"""The client's side of one stream, without any input or output.

A stream's owner sends `opening` on every new connection, passes every message it receives to
`received`, sends `acknowledgement` before it waits for the next message, and waits `retry_after_s`
before it connects again after a loss.
"""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from transientcam.errors import (
    ParameterError,
    ProblemError,
    ProtocolError,
    ServerUnreachable,
    StreamClosed,
    TransientcamError,
)
from transientcam.frame import Frame
from transientcam.requests import problem_error
from transientcam.wire import (
    MAX_CREDITS,
    MAX_DECIMATION,
    SUBPROTOCOL,
    Ack,
    Channel,
    CloseCode,
    ErrorMessage,
    Hello,
    Notice,
    Subscribe,
    Subscription,
    encode,
    encoding_names,
    fields,
    parse_channels,
    parse_server_message,
)

DEFAULT_CREDITS: Final = 2
_KEPT_NOTICES = 256
_FINAL = frozenset((CloseCode.POLICY, CloseCode.BAD_FIRST_MESSAGE, CloseCode.AUTHENTICATION_FAILED))
_RESTARTING = frozenset((502, 503, 504))
"""Statuses that a proxy, or a server not yet ready, answers the handshake with."""

NoticeHandler = Callable[[Notice], object]


@dataclass(frozen=True, slots=True)
class Reconnect:
    """How to reconnect after a lost connection: wait, try, and wait twice as long each time.

    Attributes
    ----------
    first_wait_s, longest_wait_s
        Bounds of the wait.
    attempts
        How many times to try before giving up; None for no end.
    resume
        Whether to resume with the frame after the last one, as far as the daemon still has them,
        instead of with the newest.
    """

    first_wait_s: float = 0.1
    longest_wait_s: float = 5.0
    attempts: int | None = None
    resume: bool = False

    def wait_s(self, attempt: int) -> float:
        """Return how long to wait before an attempt, counted from 0."""
        # an exponent without bound would overflow after a night without a server
        return min(self.longest_wait_s, self.first_wait_s * 2.0 ** min(attempt, 32))


def reconnect_policy(reconnect: bool | Reconnect) -> Reconnect | None:
    """Return the policy that the argument ``reconnect`` of a stream stands for."""
    if isinstance(reconnect, Reconnect):
        return reconnect
    return Reconnect() if reconnect else None


def subscribe_message(
    products: Iterable[str | Subscription],
    *,
    token: str | None,
    credits: int | None,  # noqa: A002 - the protocol calls them so
    max_rate_hz: float | None,
    start: int | None = None,
) -> Subscribe:
    """Build the message that subscribes to some products, given by name or in full.

    Raises ParameterError if there is no product, or a number is out of range.
    """
    subscriptions = tuple(
        Subscription(each, max_rate_hz) if isinstance(each, str) else each for each in products
    )
    if not subscriptions:
        raise ParameterError("products", (), "at least one product, such as 'range'")
    for each in subscriptions:
        _check(each)
    if start is not None and start < 1:
        raise ParameterError("start", start, "the number of a frame, from 1, or None")
    if credits is not None and not 1 <= credits <= MAX_CREDITS:
        raise ParameterError("credits", credits, f"from 1 to {MAX_CREDITS}, or None")
    return Subscribe(subscriptions, token=token, credits=credits, start=start)


def _check(subscription: Subscription) -> None:
    rate_hz, region = subscription.max_rate_hz, subscription.region
    if rate_hz is not None and not 0.0 < rate_hz < float("inf"):
        raise ParameterError("max_rate_hz", rate_hz, "a number of Hz above 0")
    if subscription.encoding not in encoding_names():
        raise ParameterError(
            "encoding", subscription.encoding, f"one of {', '.join(encoding_names())}"
        )
    if region is not None and (len(region) != len("xywh") or min(region) < 0):
        raise ParameterError("region", region, "x, y, width and height in pixels")
    if not 1 <= subscription.decimation <= MAX_DECIMATION:
        limit = f"an integer from 1 to {MAX_DECIMATION}"
        raise ParameterError("decimation", subscription.decimation, limit)


class StreamState:
    """State of one stream: what it received and has yet to acknowledge; not thread-safe."""

    def __init__(
        self,
        subscribe: Subscribe,
        *,
        on_notice: NoticeHandler | None = None,
        reconnect: Reconnect | None = None,
    ) -> None:
        self.subscribe = subscribe
        self.hello: Hello | None = None
        self.channels: tuple[Channel, ...] = ()
        self.sequence: Mapping[str, Any] = {}
        self.notices: deque[Notice] = deque(maxlen=_KEPT_NOTICES)
        self._on_notice = on_notice
        self._reconnect = reconnect
        self._attempt = 0
        self._owed: int | None = None
        self._last: int | None = None

    def opening(self, subprotocol: str | None) -> bytes:
        """Return the first message of a connection for which the server chose ``subprotocol``.

        Raises ProtocolError if it chose none, as a server of another protocol may do.
        """
        if subprotocol != SUBPROTOCOL:
            raise ProtocolError("subprotocol", subprotocol, SUBPROTOCOL)
        self._owed = None
        if self.hello is None:
            return encode(self.subscribe)
        resumes = self._reconnect is not None and self._reconnect.resume
        start = self._last + 1 if resumes and self._last is not None else None
        return encode(replace(self.subscribe, start=start))

    def resubscribe(self, subscribe: Subscribe) -> bytes:
        """Return the message that replaces the subscription."""
        self.subscribe = replace(subscribe, token=self.subscribe.token)
        return encode(self.subscribe)

    def received(self, data: bytes | str) -> Frame | None:
        """Process one message; return the frame if it is one.

        Raises ProblemError if the server refuses a message of this client.
        Raises ProtocolError if the message is not one of the protocol.
        """
        message = parse_server_message(data)
        match message:
            case Frame():
                if self.hello is None:
                    raise ProtocolError("type", "frame", "hello, before anything else")
                self._owed = self._last = message.frame
                return message
            case Hello():
                if self._attempt:
                    self.notify(Notice("reconnected", {"attempts": self._attempt}))
                self._attempt = 0
                self.hello = message
                self.channels = message.channels
                self.sequence = message.sequence
            case Notice():
                self._follow(message)
                self.notify(message)
            case ErrorMessage():
                self._refused(message)
        return None

    def _follow(self, notice: Notice) -> None:
        if notice.kind == "sequence-changed":
            sequence = fields.mapping(notice.details, "sequence")
            self.channels = parse_channels(notice.details)
            self.sequence = sequence

    def _refused(self, message: ErrorMessage) -> None:
        # one product that fails must not end the others: only the answer to a message of this
        # client, which names no channel, is raised
        if "channel" not in message.problem:
            raise problem_error(message.problem)
        self.notify(Notice("product-failed", message.problem))

    def acknowledgement(self) -> bytes | None:
        """Return the acknowledgement of the last frame, once; None if there is none to send."""
        if self._owed is None or self.subscribe.credits is None:
            return None
        owed, self._owed = self._owed, None
        return encode(Ack(owed))

    def retry_after_s(self, error: TransientcamError) -> float:
        """Return how long to wait before connecting again after ``error``, or raise it.

        It is raised if reconnecting is off, no connection has succeeded before, the server would
        refuse again, or the attempts are used up.
        """
        policy = self._reconnect
        if policy is None or self.hello is None or not _may_pass(error):
            raise error
        if policy.attempts is not None and self._attempt >= policy.attempts:
            raise error
        if self._attempt == 0:
            self.notify(Notice("connection-lost", {"reason": str(error)}))
        wait_s = policy.wait_s(self._attempt)
        self._attempt += 1
        return wait_s

    def notify(self, notice: Notice) -> None:
        """Keep a notice and pass it to the handler."""
        self.notices.append(notice)
        if self._on_notice is not None:
            self._on_notice(notice)


def _may_pass(error: TransientcamError) -> bool:
    match error:
        case StreamClosed():
            return error.code not in _FINAL
        case ProblemError():
            return error.status in _RESTARTING
        case _:
            return isinstance(error, ServerUnreachable)
