"""Who may do what, over the whole table of routes: every operation by every kind of client."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Literal

import httpx
import pytest

from tests.server.contract import client_of
from tests.serving import Served, serving
from transientcam_server.api import TokenFile
from transientcam_server.api._auth import Role

NOW = datetime(2030, 1, 1, tzinfo=UTC)
Kind = Literal["read", "off", "change", "delete", "light", "camera"]
PREFIX: Final = "/api/v1"
# Whatever is not GET: a route that is not here fails a test until somebody says what it does.
# "light" is what switches the light on at once or after a while, "off" what only switches it off.
KINDS: Final[dict[str, Kind]] = {
    "PUT /acquisition": "change",  # to stop; to start is tried for itself below
    "POST /acquisition/safe-off": "off",
    "POST /calibrations": "light",
    "POST /calibrations/import": "change",
    "PUT /calibrations/active": "change",
    "POST /calibrations/active/undo": "change",
    "DELETE /calibrations/{calibration}": "delete",
    "POST /jobs/{job}/cancel": "read",  # of a plan; of a calibration it asks for more
    "POST /lease": "change",
    "PUT /lease": "change",
    "DELETE /lease": "change",
    "POST /plan": "read",
    "POST /plan/jobs": "read",
    "POST /tradeoff/jobs": "read",
    "POST /series/jobs": "light",
    "PUT /reconstruction": "change",
    "POST /recordings": "change",
    "POST /recordings/import": "change",
    "PATCH /recordings/{recording}": "change",
    "DELETE /recordings/{recording}": "delete",
    "POST /recordings/{recording}/stop": "change",
    "PUT /sequence": "change",
    "POST /sequence/validate": "read",
    "PUT /camera": "camera",
    "PUT /simulation": "change",
    "POST /simulation/faults": "change",
}
REFUSED: Final[dict[str, dict[Kind, str]]] = {
    "none": dict.fromkeys(("read", "off", "change", "delete", "light", "camera"), "token-required"),
    "viewer": dict.fromkeys(("change", "delete", "light", "camera"), "role-too-low"),
    "operator": {"delete": "role-too-low", "camera": "role-too-low"},
    "operator without light": {
        "delete": "role-too-low",
        "light": "may-not-light",
        "camera": "role-too-low",
    },
    "admin": {},
    "admin without light": {"light": "may-not-light", "camera": "may-not-light"},
}
"""What each client is refused, by the kind of what it wants."""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> TokenFile:
    return TokenFile(tmp_path_factory.mktemp("tokens") / "tokens.json")


@pytest.fixture(scope="module")
def headers(file: TokenFile) -> dict[str, dict[str, str]]:
    """What each client shows."""
    made = {
        "viewer": file.create("v", Role.VIEWER, now=NOW),
        "operator": file.create("o", Role.OPERATOR, now=NOW),
        "operator without light": file.create("o", Role.OPERATOR, now=NOW, may_light=False),
        "admin": file.create("a", Role.ADMIN, now=NOW),
        "admin without light": file.create("a", Role.ADMIN, now=NOW, may_light=False),
    }
    shown = {name: {"Authorization": f"Bearer {text}"} for name, (_, text) in made.items()}
    return {"none": {}, **shown}


@pytest.fixture(scope="module")
def daemon(file: TokenFile, headers: dict[str, dict[str, str]]) -> Iterator[Served]:
    with serving("sim:wall?noise=off", require_token=True, tokens_file=file.path) as served:
        served.start_all_workers()
        yield served


@pytest.fixture(scope="module")
def http(daemon: Served) -> Iterator[httpx.Client]:
    with client_of(daemon) as client:
        yield client


def operations(daemon: Served) -> Iterator[tuple[str, str]]:
    for path, methods in daemon.app.openapi()["paths"].items():
        if path.startswith(PREFIX):
            yield from ((method.upper(), path.removeprefix(PREFIX)) for method in methods)


def test_every_route_that_does_something_is_classified(daemon: Served) -> None:
    assert {f"{method} {path}" for method, path in operations(daemon) if method != "GET"} == (
        KINDS.keys()
    )


@pytest.mark.parametrize("who", REFUSED)
def test_each_client_is_refused_what_it_may_not(
    daemon: Served, http: httpx.Client, headers: dict[str, dict[str, str]], who: str
) -> None:
    wrong = []
    for method, path in operations(daemon):
        kind = KINDS.get(f"{method} {path}", "read")
        url = PREFIX + path.replace("{frame}", "1").replace("{product}", "range")
        # nothing is done for those that are let in: what they send is refused behind the door
        nonsense: dict[str, Any] = {"unheard_of": 1}
        sent: dict[str, Any] = {"params": nonsense} if method == "GET" else {"json": nonsense}
        answer = http.request(method, url, headers=headers[who], **sent)
        slug = answer.json().get("type", "").removeprefix("/problems/")
        refused = slug if answer.status_code in (401, 403) else None
        if refused != REFUSED[who].get(kind):
            wrong.append((method, path, kind, answer.status_code, slug))

    assert wrong == []


def test_a_page_of_another_origin_changes_and_lights_nothing_with_any_right(
    daemon: Served, http: httpx.Client, headers: dict[str, dict[str, str]]
) -> None:
    asked = [(method, path) for method, path in operations(daemon) if method != "GET"]
    for method, path in asked:
        foreign = headers["admin"] | {"Origin": "https://evil.example"}
        answer = http.request(method, PREFIX + path, headers=foreign)
        refused = answer.status_code, answer.json()["type"]
        assert refused == (403, "/problems/origin-not-allowed"), (method, path)
        assert "access-control-allow-origin" not in answer.headers
    assert len(asked) == len(KINDS)


@pytest.mark.parametrize("who", REFUSED)
def test_starting_takes_the_right_to_light_and_stopping_does_not(
    http: httpx.Client, headers: dict[str, dict[str, str]], who: str
) -> None:
    def put(running: bool) -> str | None:
        body = {"running": running}
        answer = http.put(f"{PREFIX}/acquisition", json=body, headers=headers[who])
        slug: str | None = answer.json().get("type")
        return slug and slug.removeprefix("/problems/")

    off = http.post(f"{PREFIX}/acquisition/safe-off", headers=headers[who])

    assert off.status_code == (401 if who == "none" else 200)
    assert put(False) == REFUSED[who].get("change")
    assert put(True) == REFUSED[who].get("light")
    running = http.get(f"{PREFIX}/acquisition", headers=headers["admin"]).json()["running"]
    assert running == (who in ("operator", "admin"))


def test_the_refusal_names_the_right(
    http: httpx.Client, headers: dict[str, dict[str, str]]
) -> None:
    answer = http.put(
        f"{PREFIX}/acquisition", json={"running": True}, headers=headers["operator without light"]
    )

    problem: dict[str, Any] = answer.json()
    assert (answer.status_code, problem["field"], problem["limit"]) == (403, "token", "may_light")
    assert "may_light" in problem["detail"]


@pytest.mark.parametrize("who", ["viewer", "operator", "operator without light", "admin"])
def test_each_client_learns_whether_it_may_light(
    http: httpx.Client, headers: dict[str, dict[str, str]], who: str
) -> None:
    caller = http.get(f"{PREFIX}/info", headers=headers[who]).json()["caller"]

    assert caller["may_light"] == (who in ("operator", "admin"))


def test_nothing_but_the_gate_lights() -> None:
    """Every call that lets a camera of the service emit is behind `Acquisition`'s announcement."""
    import transientcam_server

    (root,) = map(Path, transientcam_server.__path__)
    calls = (
        "_camera.start(",
        "start_unless(",
        "camera.start(",
        "capture_calibration(",
        ".reconnect(",
    )
    found = {
        f"{file.relative_to(root)}: {line.strip()}"
        for folder in ("camera", "api", "daemon", "broadcast", "imaging")
        for file in (root / folder).rglob("*.py")
        for line in file.read_text(encoding="utf-8").splitlines()
        if any(call in line for call in calls)
    }

    assert found == {
        "camera/_acquisition.py: self._camera.start()",
        "camera/_acquisition.py: self._camera.reconnect()",
        "camera/_calibrator.py: return capture_calibration(",  # within `Acquisition.occupy`
        "camera/_series.py: camera.start()",  # within it, too
        # of a camera that no daemon has
        "camera/_photon_transfer.py: capture = capture_calibration("
        "camera, takes=frames, average=average)",
        "camera/_shared.py: if not self._origin.start_unless(offs):",  # of a relay: at its origin
    }
