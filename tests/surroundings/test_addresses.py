"""Each verb that talks to a daemon, at each kind of address; none prints its token."""

import shutil
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest

from tests.serving import Served, serving
from tests.surroundings.proxies import PREFIX, below_a_path, by_program
from tests.surroundings.verbs import ran, verbs
from transientcam.cli import record
from transientcam_server.api import Role, TokenFile, utc_now

ADDRESSES = ("127.0.0.1", "[::1]", "below a path", "below a path that is not taken off")
NAME = "Größe [b] [link=x] 'a' #1"
ON_DAEMON: dict[str, Callable[[str], list[str]]] = {
    "calibrate": lambda url: [url, "--undo"],
    "capture": lambda url: [url, "range", "-o", f"{NAME}.npy"],
    "conformance": lambda url: [url, "--only", "documents", "--quick"],
    "doctor": lambda url: [url, "--seconds", "0.1"],
    "foxglove": lambda url: [url, "no-such-product"],
    "plan": lambda url: ["--daemon", url, "--estimator", NAME],
    "record": lambda url: [url, "--frames", "1", "--name", NAME, "-o", f"{NAME}.h5"],
    "rerun": lambda url: [url, "no-such-product", "--save", f"{NAME}.rrd"],
    "series": lambda url: [url, "--m", "2,3", "--frames", "2", "--csv", f"{NAME}.csv"],
    "watch": lambda url: [url, "--count", "1"],
}
REFUSED = {"calibrate", "conformance", "foxglove", "plan", "rerun"}
"""What the daemon, or the verb, has no such thing for."""


@pytest.fixture(scope="module")
def token(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    file = tmp_path_factory.mktemp("tokens") / "tokens.json"
    _, text = TokenFile(file).create("bench", Role.ADMIN, now=utc_now())
    return file, text


@pytest.fixture(scope="module")
def served(token: tuple[Path, str], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("recordings")
    host = "::" if socket.has_dualstack_ipv6() else "0.0.0.0"
    with serving(
        "sim:wall?noise=off",
        host=host,
        root_path=PREFIX,
        tokens_file=token[0],
        announce="off",
        recordings={"directory": folder, "min_free_bytes": 0},
    ) as found:
        found.start_all_workers()  # so that no test seems to leave one behind
        yield found


@pytest.fixture(scope="module", autouse=True)
def addresses(served: Served) -> Iterator[dict[str, str]]:
    port = served.url.rpartition(":")[2]
    here = f"http://127.0.0.1:{port}"
    with below_a_path(here, stripped=True) as one, below_a_path(here, stripped=False) as other:
        found = dict(
            zip(ADDRESSES, (here, f"http://[::1]:{port}", one.url, other.url), strict=True)
        )
        yield found if socket.has_dualstack_ipv6() else found | {"[::1]": here}


def test_each_verb_that_takes_the_address_of_a_daemon_is_tried() -> None:
    taking = {each.name for each in verbs() if any("http://" in word for word in each.usual)}

    assert taking <= set(ON_DAEMON)


@pytest.mark.parametrize("verb", ON_DAEMON)
def test_a_verb_works_at_every_address_and_prints_no_token(
    verb: str,
    addresses: dict[str, str],
    token: tuple[Path, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setenv("TRANSIENTCAM_TOKEN", token[1])
    monkeypatch.setenv("COLUMNS", "2000")
    monkeypatch.setattr(record, "_LOOK_S", 0.01)
    monkeypatch.chdir(tmp_path)
    for url in addresses.values():
        done = ran([verb, *ON_DAEMON[verb](url)])

        assert done.problem(NAME) is None
        # whether a camera keeps its rate is no matter here
        assert verb == "doctor" or (done.code == 0) == (verb not in REFUSED), done.out + done.err
        assert token[1] not in done.out + done.err + caplog.text


@pytest.mark.parametrize("address", ADDRESSES)
def test_nothing_that_is_handed_out_begins_at_the_root(
    address: str, addresses: dict[str, str], token: tuple[Path, str]
) -> None:
    url = addresses[address]
    with httpx.Client(headers={"authorization": f"Bearer {token[1]}"}, timeout=60.0) as http:
        begun = http.post(f"{url}/api/v1/tradeoff/jobs", json={"region": [0, 0, 2, 2]})
        job = http.get(begun.url.join(begun.headers["location"]))
        http.post(f"{job.url}/cancel")
        document = http.get(f"{url}/openapi.json")
        (server,) = document.json()["servers"]
        info = httpx.URL(f"{document.url.join(server['url'])}").join("api/v1/info")
        slashed = http.get(f"{url}/api/v1/info/", follow_redirects=True)
        problems = http.get(f"{url}/problems")

    assert (begun.status_code, job.status_code) == (202, 200), begun.text
    assert job.json()["id"] == begun.json()["id"]
    assert str(info) == f"{url}/api/v1/info"
    assert slashed.status_code in (200, 404)
    assert str(slashed.url).startswith(url)
    assert 'href="/' not in problems.text


@pytest.mark.parametrize("program", ["nginx", "caddy"])
def test_a_program_in_between_serves_it_below_its_path(
    program: str, addresses: dict[str, str], token: tuple[Path, str], tmp_path: Path
) -> None:
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    with ExitStack() as stack:
        url = stack.enter_context(by_program(program, addresses["127.0.0.1"], tmp_path))
        transport = httpx.HTTPTransport(retries=8)  # until it listens
        http = stack.enter_context(httpx.Client(transport=transport, timeout=60.0))
        page = http.get(f"{url}/")
        seen = ran(["watch", url, "--count", "1", "--token", token[1]])

    assert page.status_code == 200
    assert seen.problem() is None
    assert seen.code == 0, seen.err
