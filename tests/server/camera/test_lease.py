"""The manager of the lease, against a clock that the test moves."""

from collections.abc import Callable

import pytest

from transientcam_server.camera import Change, Lease, LeaseManager
from transientcam_server.camera._lease import (
    DEFAULT_DURATION_S,
    MAX_DURATION_S,
    MIN_DURATION_S,
    OnLapse,
)
from transientcam_server.errors import Problem


class Time:
    """A clock with timers."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.timers: list[Timer] = []

    def __call__(self) -> float:
        return self.now_s

    def call_later(self, delay_s: float, callback: Callable[[], None]) -> "Timer":
        self.timers.append(Timer(self.now_s + delay_s, callback))
        return self.timers[-1]

    def pass_s(self, duration_s: float) -> None:
        self.now_s += duration_s
        for each in [timer for timer in self.timers if timer.time_s <= self.now_s]:
            self.timers.remove(each)
            if not each.cancelled:
                each.callback()


class Timer:
    def __init__(self, time_s: float, callback: Callable[[], None]) -> None:
        self.time_s = time_s
        self.callback = callback
        self.cancelled = False

    def cancel(self) -> None:
        self.cancelled = True


News = list[tuple[Change, str, str | None]]


@pytest.fixture
def time() -> Time:
    return Time()


@pytest.fixture
def news() -> News:
    return []


@pytest.fixture
def manager(time: Time, news: News) -> LeaseManager:
    def report(change: Change, lease: Lease, former: Lease | None) -> None:
        news.append((change, lease.holder, former.holder if former else None))

    return LeaseManager(report=report, call_later=time.call_later, clock=time)


def grant(
    manager: LeaseManager,
    holder: str = "anna",
    *,
    rank: int = 2,
    duration_s: float = 30.0,
    on_lapse: OnLapse = "stop",
    takeover: bool = False,
) -> Lease:
    return manager.grant(
        holder=holder,
        by="token 1",
        rank=rank,
        duration_s=duration_s,
        on_lapse=on_lapse,
        takeover=takeover,
    )


def holder(manager: LeaseManager) -> str | None:
    return None if manager.current is None else manager.current.holder


def refusal(call: Callable[[], object]) -> Problem:
    with pytest.raises(Problem) as caught:
        call()
    return caught.value


def test_a_lease_lasts_a_second_to_an_hour_and_half_a_minute_where_nothing_is_said() -> None:
    assert (MIN_DURATION_S, DEFAULT_DURATION_S, MAX_DURATION_S) == (1.0, 30.0, 3600.0)


def test_without_a_lease_every_change_passes(manager: LeaseManager) -> None:
    manager.check(None)


def test_only_the_holder_changes_anything(manager: LeaseManager) -> None:
    lease = grant(manager)

    manager.check(lease.id)
    problem = refusal(lambda: manager.check(None))

    assert problem.kind.slug == "lease-held"
    assert problem.extensions == {"holder": "anna", "expires_in_s": 30.0}
    assert "anna" in problem.detail


@pytest.mark.parametrize("shown", ["", "x", "ü", "\udc80"])
def test_a_wrong_id_is_a_lost_lease(manager: LeaseManager, shown: str) -> None:
    assert refusal(lambda: manager.check(shown)).kind.slug == "lease-lost"
    grant(manager)
    assert refusal(lambda: manager.check(shown)).kind.slug == "lease-lost"


def test_a_second_one_is_refused_and_changes_nothing(manager: LeaseManager, news: News) -> None:
    lease = grant(manager)

    assert refusal(lambda: grant(manager, "bert")).kind.slug == "lease-held"
    assert manager.current == lease
    assert news == [("granted", "anna", None)]


def test_a_lapse_is_reported_once(manager: LeaseManager, time: Time, news: News) -> None:
    lease = grant(manager, duration_s=10.0)

    time.pass_s(9.9)
    assert holder(manager) == "anna"
    time.pass_s(0.2)

    assert holder(manager) is None
    manager.check(None)
    assert refusal(lambda: manager.check(lease.id)).kind.slug == "lease-lost"
    assert news == [("granted", "anna", None), ("lapsed", "anna", None)]


def test_renewing_moves_the_end_without_a_report(
    manager: LeaseManager, time: Time, news: News
) -> None:
    lease = grant(manager, duration_s=10.0)

    for _ in range(5):
        time.pass_s(9.0)
        manager.renew(lease.id, duration_s=None, on_lapse=None)

    assert manager.current is not None
    assert manager.remaining_s(manager.current) == 10.0
    assert news == [("granted", "anna", None)]
    time.pass_s(10.0)
    assert news[1:] == [("lapsed", "anna", None)]


def test_renewing_may_change_the_terms_but_not_the_id(manager: LeaseManager) -> None:
    lease = grant(manager)

    renewed = manager.renew(lease.id, duration_s=60.0, on_lapse="keep")

    assert (renewed.id, renewed.duration_s, renewed.on_lapse) == (lease.id, 60.0, "keep")
    assert manager.remaining_s(renewed) == 60.0


def test_giving_it_back_frees_it_at_once(manager: LeaseManager, time: Time, news: News) -> None:
    lease = grant(manager)

    manager.release(lease.id)
    time.pass_s(1000.0)

    assert manager.current is None
    assert news == [("granted", "anna", None), ("released", "anna", None)]
    assert refusal(lambda: manager.release(lease.id)).kind.slug == "lease-lost"
    assert refusal(lambda: manager.renew(lease.id, duration_s=None, on_lapse=None)).kind.slug == (
        "lease-lost"
    )


def test_taking_over_is_no_lapse_and_says_from_whom(
    manager: LeaseManager, time: Time, news: News
) -> None:
    first = grant(manager, duration_s=5.0)

    second = grant(manager, "bert", takeover=True)
    time.pass_s(6.0)

    assert manager.current == second
    problem = refusal(lambda: manager.check(first.id))
    assert (problem.kind.slug, problem.extensions["holder"]) == ("lease-lost", "bert")
    assert news == [("granted", "anna", None), ("taken-over", "bert", "anna")]


def test_no_client_of_a_lower_rank_takes_it_over(manager: LeaseManager) -> None:
    grant(manager, rank=3)

    assert refusal(lambda: grant(manager, "bert", rank=2, takeover=True)).kind.slug == "lease-held"
    assert grant(manager, "carl", rank=3, takeover=True).holder == "carl"


def test_a_timer_that_is_early_is_set_again(manager: LeaseManager, time: Time, news: News) -> None:
    grant(manager, duration_s=10.0)
    (timer,) = time.timers
    time.timers.clear()
    time.now_s += 9.999

    timer.callback()
    assert len(news) == 1
    time.pass_s(0.001)

    assert news[1:] == [("lapsed", "anna", None)]


def test_closing_drops_the_lease_and_its_timer(
    manager: LeaseManager, time: Time, news: News
) -> None:
    grant(manager)

    manager.close()
    time.pass_s(1000.0)

    assert manager.current is None
    assert len(news) == 1


def test_the_id_shows_up_in_no_representation(manager: LeaseManager) -> None:
    lease = grant(manager)

    assert lease.id not in repr(lease)
    assert len(lease.id) >= 22  # 128 bits in base 64
