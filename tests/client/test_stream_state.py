"""The client's side of a stream, fed with bytes."""

from typing import Any

import numpy as np
import pytest

from tests.client.conftest import Recording
from transientcam import wire
from transientcam.errors import (
    FrameTimeout,
    ParameterError,
    ProblemError,
    ProtocolError,
    ServerUnreachable,
    StreamClosed,
    TransientcamError,
)
from transientcam.stream_state import Reconnect, StreamState, reconnect_policy, subscribe_message

_LOST = StreamClosed(1006, "the connection broke")


def _state(*products: str, credit: int | None = 2, **options: Any) -> StreamState:
    subscribe = subscribe_message(
        products or ("range",), token="secret", credits=credit, max_rate_hz=None
    )
    return StreamState(subscribe, **options)


def _frame(number: int, channel: int = 0) -> bytes:
    return wire.encode_frame(
        product="range",
        unit="m",
        axes=("y", "x"),
        meta={"frame": number},
        array=np.zeros((1, 1), "<f4"),
        channel=channel,
    )


def test_the_opening_subscribes_with_token_and_credits() -> None:
    message = wire.parse_client_message(_state("range", "coefficients").opening(wire.SUBPROTOCOL))

    assert message == wire.Subscribe(
        (wire.Subscription("range"), wire.Subscription("coefficients")), token="secret", credits=2
    )


@pytest.mark.parametrize("subprotocol", [None, "transientcam.v2.msgpack"])
def test_a_server_that_chose_another_subprotocol_is_refused(subprotocol: str | None) -> None:
    with pytest.raises(ProtocolError, match=r"subprotocol is .* transientcam\.v1\.msgpack"):
        _state().opening(subprotocol)


def test_a_rate_is_for_all_products_given_by_name() -> None:
    message = subscribe_message(
        ("range", wire.Subscription("raw", 1.0)), token=None, credits=None, max_rate_hz=5.0
    )

    assert [each.max_rate_hz for each in message.subscriptions] == [5.0, 1.0]


def test_a_hello_is_remembered(recorded: dict[str, Recording]) -> None:
    state = _state()

    assert state.received(recorded["hello"].data) is None

    assert state.hello is not None
    assert state.channels == (wire.Channel(0, "range", "m", ("y", "x"), "<f4", (2, 2)),)
    assert state.sequence == {"harmonics": 3}


def test_a_frame_is_handed_out(recorded: dict[str, Recording]) -> None:
    state = _state()
    state.received(recorded["hello"].data)

    frame = state.received(recorded["frame"].data)

    assert frame is not None
    assert frame.frame == 17


def test_a_frame_before_the_hello_is_an_error(recorded: dict[str, Recording]) -> None:
    with pytest.raises(ProtocolError, match="must be hello"):
        _state().received(recorded["frame"].data)


def test_each_frame_is_acknowledged_once_and_after_it_was_handed_out(
    recorded: dict[str, Recording],
) -> None:
    state = _state()
    state.received(recorded["hello"].data)
    assert state.acknowledgement() is None

    state.received(recorded["frame"].data)

    assert state.acknowledgement() == recorded["ack"].data
    assert state.acknowledgement() is None


def test_nothing_is_acknowledged_without_credits(recorded: dict[str, Recording]) -> None:
    state = _state(credit=None)
    state.received(recorded["hello"].data)
    state.received(recorded["frame"].data)

    assert state.acknowledgement() is None


def test_a_new_connection_owes_nothing_for_frames_of_the_old_one(
    recorded: dict[str, Recording],
) -> None:
    state = _state()
    state.received(recorded["hello"].data)
    state.received(recorded["frame"].data)

    state.opening(wire.SUBPROTOCOL)

    assert state.acknowledgement() is None


def test_notices_are_kept_and_passed_to_the_handler(recorded: dict[str, Recording]) -> None:
    passed: list[wire.Notice] = []
    state = _state(on_notice=passed.append)

    assert state.received(recorded["notice"].data) is None

    expected = wire.Notice("dropped", {"channel": 0, "count": 3, "total": 17})
    assert passed == [expected]
    assert list(state.notices) == [expected]


def test_only_the_newest_notices_are_kept() -> None:
    state = _state()
    for number in range(300):
        state.received(wire.encode(wire.Notice("lost-images", {"count": number})))

    assert [each.details["count"] for each in state.notices] == list(range(44, 300))


def test_a_change_of_the_sequence_changes_the_channels(recorded: dict[str, Recording]) -> None:
    state = _state()
    state.received(recorded["hello"].data)
    channel = wire.Channel(0, "range", "m", ("y", "x"), "<f4", (4, 4))
    details = {"sequence": {"harmonics": 4}, "channels": [channel.to_document()]}

    state.received(wire.encode(wire.Notice("sequence-changed", details)))

    assert state.channels == (channel,)
    assert state.sequence == {"harmonics": 4}


def test_a_broken_change_of_the_sequence_changes_nothing(recorded: dict[str, Recording]) -> None:
    state = _state()
    state.received(recorded["hello"].data)

    with pytest.raises(ProtocolError, match="channels is"):
        state.received(wire.encode(wire.Notice("sequence-changed", {"sequence": {}})))

    assert state.sequence == {"harmonics": 3}


def test_a_refusal_is_raised_and_the_stream_goes_on(recorded: dict[str, Recording]) -> None:
    state = _state()
    state.received(recorded["hello"].data)

    with pytest.raises(ProblemError) as caught:
        state.received(recorded["error"].data)

    assert (caught.value.status, caught.value.field, caught.value.value) == (422, "v", 2)
    assert state.received(recorded["frame"].data) is not None


def test_a_product_that_fails_is_a_notice_and_the_others_go_on(
    recorded: dict[str, Recording],
) -> None:
    state = _state("range", "coefficients")
    state.received(recorded["hello"].data)
    problem = {"type": "/problems/product-failed", "channel": 1}

    assert state.received(wire.encode(wire.ErrorMessage(problem))) is None

    assert state.notices[-1] == wire.Notice("product-failed", problem)
    assert state.received(_frame(1)) is not None


def test_another_subscription_keeps_the_token() -> None:
    state = _state("range")
    wanted = subscribe_message(("raw",), token=None, credits=1, max_rate_hz=2.0)

    message = wire.parse_client_message(state.resubscribe(wanted))

    assert message == wire.Subscribe((wire.Subscription("raw", 2.0),), token="secret", credits=1)
    assert wire.parse_client_message(state.opening(wire.SUBPROTOCOL)) == message


def test_a_lost_connection_is_raised_unless_asked_otherwise(recorded: dict[str, Recording]) -> None:
    state = _state()
    state.received(recorded["hello"].data)

    with pytest.raises(StreamClosed):
        state.retry_after_s(_LOST)


def test_a_connection_that_never_was_is_not_tried_again() -> None:
    with pytest.raises(ServerUnreachable):
        _state(reconnect=Reconnect()).retry_after_s(ServerUnreachable("ws://h", "refused"))


@pytest.mark.parametrize(
    "error",
    [
        StreamClosed(1000),
        StreamClosed(1001),
        StreamClosed(1006),
        StreamClosed(1013),
        ServerUnreachable("ws://h", "refused"),
        ProblemError(status=503),
    ],
)
def test_what_may_pass_is_waited_for(
    error: TransientcamError, recorded: dict[str, Recording]
) -> None:
    state = _state(reconnect=Reconnect(first_wait_s=0.25, longest_wait_s=1.5))
    state.received(recorded["hello"].data)

    waits_s = [state.retry_after_s(error) for _ in range(5)]

    assert waits_s == [0.25, 0.5, 1.0, 1.5, 1.5]
    assert [notice.kind for notice in state.notices] == ["connection-lost"]


@pytest.mark.parametrize(
    "error",
    [
        StreamClosed(4001),
        StreamClosed(4003),
        StreamClosed(1008),
        ProblemError(status=400),
        ProtocolError("f", 1, "2"),
        FrameTimeout(1.0),
    ],
)
def test_what_would_happen_again_is_raised(
    error: TransientcamError, recorded: dict[str, Recording]
) -> None:
    state = _state(reconnect=Reconnect())
    state.received(recorded["hello"].data)

    with pytest.raises(type(error)):
        state.retry_after_s(error)


def test_a_reconnection_is_announced_and_counts_anew(recorded: dict[str, Recording]) -> None:
    state = _state(reconnect=Reconnect(first_wait_s=1.0))
    state.received(recorded["hello"].data)
    state.retry_after_s(_LOST)
    state.retry_after_s(_LOST)

    state.received(recorded["hello"].data)

    assert [notice.kind for notice in state.notices] == ["connection-lost", "reconnected"]
    assert state.notices[-1].details == {"attempts": 2}
    assert state.retry_after_s(_LOST) == 1.0


def test_attempts_can_be_limited(recorded: dict[str, Recording]) -> None:
    state = _state(reconnect=Reconnect(attempts=2))
    state.received(recorded["hello"].data)
    state.retry_after_s(_LOST)
    state.retry_after_s(_LOST)

    with pytest.raises(StreamClosed):
        state.retry_after_s(_LOST)


def test_a_night_without_a_server_is_survived() -> None:
    assert Reconnect().wait_s(10**9) == Reconnect().longest_wait_s


def test_a_policy_is_given_as_such_or_as_yes_and_no() -> None:
    policy = Reconnect(attempts=3)

    assert reconnect_policy(policy) is policy
    assert reconnect_policy(True) == Reconnect()
    assert reconnect_policy(False) is None


def _opened(state: StreamState) -> wire.Subscribe:
    message = wire.parse_client_message(state.opening(wire.SUBPROTOCOL))
    assert isinstance(message, wire.Subscribe)
    return message


@pytest.mark.parametrize(("resume", "start"), [(True, 18), (False, None)])
def test_only_a_resuming_client_continues_after_the_last_frame(
    resume: bool, start: int | None, recorded: dict[str, Recording]
) -> None:
    subscribe = subscribe_message(("range",), token=None, credits=None, max_rate_hz=None, start=5)
    state = StreamState(subscribe, reconnect=Reconnect(resume=resume))
    assert _opened(state).start == 5
    state.received(recorded["hello"].data)
    state.received(recorded["frame"].data)
    state.retry_after_s(_LOST)

    assert _opened(state).start == start


def test_a_subscription_says_region_decimation_and_encoding() -> None:
    wanted = wire.Subscription("range", encoding="u16", region=(1, 2, 30, 40), decimation=2)
    state = StreamState(subscribe_message((wanted,), token=None, credits=None, max_rate_hz=None))

    assert _opened(state).subscriptions == (wanted,)


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"encoding": "f16"}, "encoding"),
        ({"region": (1, 2, 3)}, "region"),
        ({"region": (-1, 0, 3, 3)}, "region"),
        ({"decimation": 0}, "decimation"),
        ({"decimation": 65}, "decimation"),
        ({"max_rate_hz": 0.0}, "max_rate_hz"),
    ],
)
def test_what_a_server_would_refuse_is_refused_before_it_is_asked(
    options: dict[str, Any], field: str
) -> None:
    with pytest.raises(ParameterError) as caught:
        subscribe_message(
            (wire.Subscription("range", **options),), token=None, credits=None, max_rate_hz=None
        )

    assert caught.value.field == field


def test_frames_are_counted_from_one() -> None:
    with pytest.raises(ParameterError, match="start"):
        subscribe_message(("range",), token=None, credits=None, max_rate_hz=None, start=0)
