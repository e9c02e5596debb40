"""The desk where the lease is handed out, against a clock that the test moves."""

from collections.abc import Callable

import pytest

from transientcam_server.camera.lease import Change, Lease, LeaseManager, OnLapse
from transientcam_server.errors.exceptions import Problem


class Time:
    """A clock with alarms."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.alarms: list[Ringing] = []

    def __call__(self) -> float:
        return self.now_s

    def alarm(self, delay_s: float, ring: Callable[[], None]) -> "Ringing":
        self.alarms.append(Ringing(self.now_s + delay_s, ring))
        return self.alarms[-1]

    def pass_s(self, duration_s: float) -> None:
        self.now_s += duration_s
        for each in [alarm for alarm in self.alarms if alarm.time_s <= self.now_s]:
            self.alarms.remove(each)
            if not each.cancelled:
                each.ring()


class Ringing:
    def __init__(self, time_s: float, ring: Callable[[], None]) -> None:
        self.time_s = time_s
        self.ring = ring
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
def desk(time: Time, news: News) -> LeaseManager:
    def report(change: Change, lease: Lease, former: Lease | None) -> None:
        news.append((change, lease.holder, former.holder if former else None))

    return LeaseManager(report=report, alarm=time.alarm, clock=time)


def grant(
    desk: LeaseManager,
    holder: str = "anna",
    *,
    rank: int = 2,
    duration_s: float = 30.0,
    on_lapse: OnLapse = "stop",
    takeover: bool = False,
) -> Lease:
    return desk.grant(
        holder=holder,
        by="somebody",
        rank=rank,
        duration_s=duration_s,
        on_lapse=on_lapse,
        takeover=takeover,
    )


def holder(desk: LeaseManager) -> str | None:
    return None if desk.current is None else desk.current.holder


def refusal(call: Callable[[], object]) -> Problem:
    with pytest.raises(Problem) as caught:
        call()
    return caught.value


def test_without_a_lease_every_change_passes(desk: LeaseManager) -> None:
    desk.check(None)


def test_only_the_holder_changes_anything(desk: LeaseManager) -> None:
    lease = grant(desk)

    desk.check(lease.id)
    problem = refusal(lambda: desk.check(None))

    assert problem.kind.slug == "lease-held"
    assert problem.extensions == {"holder": "anna", "expires_in_s": 30.0}
    assert "anna" in problem.detail


@pytest.mark.parametrize("shown", ["", "x", "ü", "\udc80"])
def test_a_wrong_id_is_a_lost_lease(desk: LeaseManager, shown: str) -> None:
    assert refusal(lambda: desk.check(shown)).kind.slug == "lease-lost"
    grant(desk)
    assert refusal(lambda: desk.check(shown)).kind.slug == "lease-lost"


def test_a_second_one_is_refused_and_changes_nothing(desk: LeaseManager, news: News) -> None:
    lease = grant(desk)

    assert refusal(lambda: grant(desk, "bert")).kind.slug == "lease-held"
    assert desk.current == lease
    assert news == [("granted", "anna", None)]


def test_a_lease_lapses_once_and_is_told(desk: LeaseManager, time: Time, news: News) -> None:
    lease = grant(desk, duration_s=10.0)

    time.pass_s(9.9)
    assert holder(desk) == "anna"
    time.pass_s(0.2)

    assert holder(desk) is None
    desk.check(None)
    assert refusal(lambda: desk.check(lease.id)).kind.slug == "lease-lost"
    assert news == [("granted", "anna", None), ("lapsed", "anna", None)]


def test_renewing_moves_the_end_and_tells_nobody(
    desk: LeaseManager, time: Time, news: News
) -> None:
    lease = grant(desk, duration_s=10.0)

    for _ in range(5):
        time.pass_s(9.0)
        desk.renew(lease.id, duration_s=None, on_lapse=None)

    assert desk.current is not None
    assert desk.remaining_s(desk.current) == 10.0
    assert news == [("granted", "anna", None)]
    time.pass_s(10.0)
    assert news[1:] == [("lapsed", "anna", None)]


def test_renewing_may_change_the_terms_but_not_the_id(desk: LeaseManager) -> None:
    lease = grant(desk)

    renewed = desk.renew(lease.id, duration_s=60.0, on_lapse="keep")

    assert (renewed.id, renewed.duration_s, renewed.on_lapse) == (lease.id, 60.0, "keep")
    assert desk.remaining_s(renewed) == 60.0


def test_giving_it_back_frees_it_at_once(desk: LeaseManager, time: Time, news: News) -> None:
    lease = grant(desk)

    desk.release(lease.id)
    time.pass_s(1000.0)

    assert desk.current is None
    assert news == [("granted", "anna", None), ("released", "anna", None)]
    assert refusal(lambda: desk.release(lease.id)).kind.slug == "lease-lost"
    assert refusal(lambda: desk.renew(lease.id, duration_s=None, on_lapse=None)).kind.slug == (
        "lease-lost"
    )


def test_taking_over_is_no_lapse_and_says_from_whom(
    desk: LeaseManager, time: Time, news: News
) -> None:
    first = grant(desk, duration_s=5.0)

    second = grant(desk, "bert", takeover=True)
    time.pass_s(6.0)

    assert desk.current == second
    problem = refusal(lambda: desk.check(first.id))
    assert (problem.kind.slug, problem.extensions["holder"]) == ("lease-lost", "bert")
    assert news == [("granted", "anna", None), ("taken-over", "bert", "anna")]


def test_nobody_of_a_lower_rank_takes_it_over(desk: LeaseManager) -> None:
    grant(desk, rank=3)

    assert refusal(lambda: grant(desk, "bert", rank=2, takeover=True)).kind.slug == "lease-held"
    assert grant(desk, "carl", rank=3, takeover=True).holder == "carl"


def test_an_alarm_that_rings_early_is_set_anew(desk: LeaseManager, time: Time, news: News) -> None:
    grant(desk, duration_s=10.0)
    (alarm,) = time.alarms
    time.alarms.clear()
    time.now_s += 9.999

    alarm.ring()
    assert len(news) == 1
    time.pass_s(0.001)

    assert news[1:] == [("lapsed", "anna", None)]


def test_closing_forgets_the_lease_and_its_alarm(
    desk: LeaseManager, time: Time, news: News
) -> None:
    grant(desk)

    desk.close()
    time.pass_s(1000.0)

    assert desk.current is None
    assert len(news) == 1


def test_the_id_shows_up_in_no_representation(desk: LeaseManager) -> None:
    lease = grant(desk)

    assert lease.id not in repr(lease)
    assert len(lease.id) >= 20
