"""Searches of the local network, on behalf of clients."""

import asyncio
import threading
from collections.abc import Callable

import pytest

from transientcam.discovery import MAX_CAMERAS, FoundCamera, Search
from transientcam.errors import ServerUnreachable
from transientcam_server.api._neighbours import FRESH_S, KEPT_S, OFF, NeighbourSearch
from transientcam_server.settings import Settings


def camera(name: str, *, state: str = "streaming") -> FoundCamera:
    return FoundCamera(name, f"http://{name}:8000", "", "", "v1", tls=False, state=state)


class Network:
    """What announces itself at a time of its own."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.found = Search((), 0)
        self.searches = 0

    def search(self) -> Search:
        self.searches += 1
        return self.found

    def names(self, search: NeighbourSearch) -> list[tuple[str, str, float]]:
        found = asyncio.run(search.neighbours())
        return [(each.name, each.state, age_s) for each, age_s in found.cameras]


@pytest.fixture
def network() -> Network:
    return Network()


@pytest.fixture
def search(network: Network) -> NeighbourSearch:
    return NeighbourSearch(network.search, clock=lambda: network.now_s)


def test_a_camera_is_listed_until_it_has_not_answered_for_long(
    network: Network, search: NeighbourSearch
) -> None:
    network.found = Search((camera("bench"), camera("attic")), 0)
    assert network.names(search) == [("attic", "streaming", 0.0), ("bench", "streaming", 0.0)]

    network.found = Search((camera("attic", state="lost"),), 0)
    network.now_s += KEPT_S
    assert network.names(search) == [("attic", "lost", 0.0), ("bench", "streaming", KEPT_S)]

    network.now_s += FRESH_S
    assert network.names(search) == [("attic", "lost", 0.0)]


def test_a_result_is_given_again_until_it_is_old(network: Network, search: NeighbourSearch) -> None:
    for passed_s, searches in ((0.0, 1), (0.9 * FRESH_S, 1), (0.1 * FRESH_S, 2)):
        network.now_s += passed_s
        network.names(search)
        assert network.searches == searches


def test_requests_of_a_moment_share_a_search_and_one_that_leaves_hurts_no_other() -> None:
    begun, go_on = threading.Event(), threading.Event()
    searches = []

    def slowly() -> Search:
        searches.append(1)
        begun.set()
        go_on.wait()
        return Search((camera("bench"),), 0)

    async def ask() -> list[int]:
        search = NeighbourSearch(slowly)
        asked = [asyncio.create_task(search.neighbours()) for _ in range(3)]
        await asyncio.to_thread(begun.wait)
        asked.pop().cancel()
        go_on.set()
        return [len((await each).cameras) for each in asked]

    assert (asyncio.run(ask()), searches) == ([1, 1], [1])


def test_what_is_listed_is_bounded_and_the_rest_counted(
    network: Network, search: NeighbourSearch
) -> None:
    network.found = Search(tuple(camera(f"a{each}") for each in range(MAX_CAMERAS)), 7)
    asyncio.run(search.neighbours())
    network.found = Search(tuple(camera(f"b{each}") for each in range(MAX_CAMERAS)), 3)
    network.now_s += FRESH_S

    found = asyncio.run(search.neighbours())

    assert {each.name[0] for each, _ in found.cameras} == {"b"}
    assert (len(found.cameras), found.left_out) == (MAX_CAMERAS, MAX_CAMERAS + 3)


def missing() -> Search:
    raise ModuleNotFoundError("No module named 'zeroconf'", name="zeroconf")


def without_network() -> Search:
    raise ServerUnreachable("the local network", "Network is unreachable")


@pytest.mark.parametrize(
    ("fails", "words"),
    [(missing, "transientcam[discovery]"), (without_network, "Network is unreachable")],
)
def test_a_search_that_cannot_be_made_says_why(fails: Callable[[], Search], words: str) -> None:
    found = asyncio.run(NeighbourSearch(fails).neighbours())

    assert (found.cameras, found.left_out) == ((), 0)
    assert found.reason is not None
    assert words in found.reason


def test_where_mdns_is_off_nothing_is_searched() -> None:
    found = asyncio.run(NeighbourSearch.of(Settings(announce="off")).neighbours())

    assert (found.cameras, found.reason) == ((), OFF)
