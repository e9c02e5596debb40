"""Debian's Chromium on the real page of a real daemon; a page that logs an error fails its test."""

import os
import re
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Page,
    Request,
    WebError,
    expect,
    sync_playwright,
)

from tests.serving import Served, serving
from transientcam.wire import LEASE_HEADER
from transientcam_driver.clock import Clock, RealClock

# A laden machine takes its time; nothing here is about how long.
_PATIENCE_MS = 60_000
expect.set_options(timeout=_PATIENCE_MS)

MIRRORS = "sim:mirrors?noise=off"

_ROOT = Path(__file__).resolve().parents[2]
_SOURCES = _ROOT / "client" / "dashboard"
_BUILT = _ROOT / "server" / "transientcam_server" / "static" / "index.html"


def pytest_configure(config: pytest.Config) -> None:
    """Name the marker of modules whose tests share a daemon."""
    config.addinivalue_line(
        "markers", "shared_daemon(camera, slower): the module's tests share one daemon"
    )


@pytest.fixture(scope="session")
def built() -> None:
    """The dashboard as it is in the sources, not as it was some builds ago."""
    sources = [_SOURCES / "index.html", _SOURCES / "package-lock.json", _SOURCES / "vite.config.ts"]
    # types alone, which are written anew by a check, are not in it
    sources += [each for each in (_SOURCES / "src").rglob("*.*") if not each.match("*.d.ts")]
    newest = max(path.stat().st_mtime for path in sources)
    if not _BUILT.exists() or _BUILT.stat().st_mtime < newest:
        pytest.fail("The built dashboard is missing or older than its sources: make dashboard")


# not for the session: while playwright runs, this thread has a running event loop, and no test that
# comes after those of the browser could run one of its own
@pytest.fixture(scope="module")
def browser(built: None) -> Iterator[Browser]:
    """Chromium without a window; needed in CI, and elsewhere skipped where it is not installed."""
    executable = shutil.which("chromium")
    if executable is None:
        message = "these tests need Debian's chromium: apt-get install chromium"
        if os.environ.get("CI"):
            pytest.fail(message)
        pytest.skip(message)
    with sync_playwright() as playwright:
        # pages of a context in one process, which starts and compiles the page's scripts once
        alone = ["--renderer-process-limit=1"]
        chromium = playwright.chromium.launch(executable_path=executable, args=alone)
        yield chromium
        chromium.close()


@dataclass
class Watch:
    """What a page did that its tests should know of."""

    host: str
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    refusals_expected: bool = False

    def on_console(self, message: ConsoleMessage) -> None:
        """Remember errors; a request that is refused on purpose is one to Chromium too."""
        refused = (
            self.refusals_expected and "the server responded with a status of 4" in message.text
        )
        # a page on a laden machine asks what pixels of a frame are worth that is not kept any more
        asked = re.search("/pixel[?]|/range_|/trust", message.location["url"])
        late = "a status of 410" in message.text and asked is not None
        if message.type == "error" and not (refused or late):
            self.complaints.append(f"console: {message.text}")

    def on_exception(self, error: WebError) -> None:
        """Remember what no script caught."""
        self.complaints.append(f"exception: {error.error}")

    def on_request(self, request: Request) -> None:
        """Remember every request, those of the worker included."""
        self.requests.append(f"{request.method} {request.url}")
        where = urlsplit(request.url)
        if where.scheme in ("http", "https", "ws", "wss") and where.netloc != self.host:
            self.complaints.append(f"request to another host: {request.url}")


@pytest.fixture
def camera() -> str:
    """A camera whose frames are all alike, so that a picture has to stay the same by itself."""
    return MIRRORS


class SlowClock(RealClock):
    """Time passes more slowly: daemon and page compute and draw so many times fewer frames."""

    def __init__(self, slower: float = 8.0) -> None:
        self._slower = slower

    def now_s(self) -> float:
        """Monotonic time."""
        return super().now_s() / self._slower

    def wait(self, condition: threading.Condition, timeout_s: float) -> None:
        """Sleep until notified or the time has passed."""
        super().wait(condition, self._slower * timeout_s)


@contextmanager
def _storing_in(directory: Path, camera: str, clock: Clock) -> Iterator[Served]:
    """A daemon that keeps what it stores in a directory of its own."""
    stored: dict[str, Any] = {
        "recordings": {"directory": directory / "recordings", "min_free_bytes": 0},
        "calibrations": {"directory": directory / "calibrations"},
    }
    with serving(camera, clock=clock, **stored) as daemon:
        yield daemon


# of every module, so that its threads are there before any test and none seems left behind
@pytest.fixture(scope="module", autouse=True)
def shared_daemon(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Served | None]:
    """One daemon for all tests of a module that is marked `shared_daemon`."""
    marker = request.node.get_closest_marker("shared_daemon")
    if marker is None:
        yield None
        return
    camera = marker.args[0] if marker.args else MIRRORS
    clock = SlowClock(**marker.kwargs)
    with _storing_in(tmp_path_factory.mktemp("daemon"), camera, clock) as daemon:
        daemon.start_all_workers()
        yield daemon


@pytest.fixture
def served(shared_daemon: Served | None, camera: str, tmp_path: Path) -> Iterator[Served]:
    """A daemon; where tests share one, all that they set or stored is as it began with."""
    if shared_daemon is None:
        with _storing_in(tmp_path, camera, SlowClock()) as own:
            yield own
        return
    daemon = shared_daemon
    began_with = {of: _document(daemon, of) for of in ("sequence", "reconstruction")}
    put(daemon, "acquisition", {"running": True})
    yield daemon
    _end_lease(daemon)
    if _document(daemon, "sequence")["sequence_id"] != began_with["sequence"]["sequence_id"]:
        put(daemon, "sequence", {name: began_with["sequence"][name] for name in SEQUENCE_FIELDS})
    settings = ("estimator", "smoothing_px")
    before, now = (
        {name: each[name] for name in settings}
        for each in (began_with["reconstruction"], _document(daemon, "reconstruction"))
    )
    if now != before:
        put(daemon, "reconstruction", before)
    for recording in _document(daemon, "recordings")["recordings"]:
        httpx.delete(f"{daemon.url}/api/v1/recordings/{recording['id']}").raise_for_status()


def _end_lease(served: Served) -> None:
    """Let every client change things again, whichever has the lease."""
    address = f"{served.url}/api/v1/lease"
    if _document(served, "lease")["held"]:
        terms = {"holder": "the next test", "takeover": True}
        taken = httpx.post(address, json=terms).raise_for_status().json()
        httpx.delete(address, headers={LEASE_HEADER: taken["lease_id"]}).raise_for_status()


def _document(served: Served, path: str) -> dict[str, Any]:
    """What a daemon says of something."""
    document: dict[str, Any] = httpx.get(f"{served.url}/api/v1/{path}").raise_for_status().json()
    return document


# what is set of a sequence; the rest of its document follows from it
SEQUENCE_FIELDS = (
    "base_frequency_hz",
    "harmonics",
    "zeroth",
    "exposure_s",
    "takes",
    "take_order",
    "sub_phases",
)


def put(served: Served, path: str, document: dict[str, Any]) -> None:
    """Set something of a daemon."""
    # a laden machine builds a scene in its own time
    url = f"{served.url}/api/v1/{path}"
    httpx.put(url, json=document, timeout=60).raise_for_status()


@pytest.fixture
def watch(served: Served) -> Watch:
    """What the test's page does."""
    return Watch(urlsplit(served.url).netloc)


def _context(browser: Browser, served: Served) -> BrowserContext:
    context = browser.new_context(
        viewport={"width": 1280, "height": 800}, reduced_motion="reduce", base_url=served.url
    )
    context.set_default_timeout(_PATIENCE_MS)
    # a laden machine is no thin link: what is compared to the last digit is sent whole
    context.add_init_script("try { localStorage['transientcam.link.adapts'] = 'false' } catch {}")
    return context


@pytest.fixture(scope="module")
def shared_context(
    browser: Browser, shared_daemon: Served | None
) -> Iterator[BrowserContext | None]:
    """One context for the tests that share a daemon: scripts stay compiled from page to page."""
    if shared_daemon is None:
        yield None
        return
    context = _context(browser, shared_daemon)
    context.new_page().goto("/icon.svg")  # keeps the process between the tests
    yield context
    context.close()


@pytest.fixture
def context(
    browser: Browser, shared_context: BrowserContext | None, served: Served, watch: Watch
) -> Iterator[BrowserContext]:
    """A context without pages of its own, storage and permissions, which is watched."""
    context = shared_context or _context(browser, served)
    listeners: dict[Any, Any] = {
        "console": watch.on_console,
        "weberror": watch.on_exception,
        "request": watch.on_request,
    }
    for event, listener in listeners.items():
        context.on(event, listener)
    before = context.pages
    yield context
    for each in context.pages:
        if each not in before:
            each.close()
    for event, listener in listeners.items():
        context.remove_listener(event, listener)
    if shared_context is None:
        context.close()
    else:
        context.clear_permissions()


@pytest.fixture
def page(context: BrowserContext, served: Served, watch: Watch) -> Iterator[Page]:
    """A fresh page, at rest until the test opens it; it may log no error until the test ends."""
    page = context.new_page()
    stored = {"origin": served.url, "storageTypes": "local_storage"}
    context.new_cdp_session(page).send("Storage.clearDataForOrigin", stored)
    yield page
    page.close()
    assert watch.complaints == []
