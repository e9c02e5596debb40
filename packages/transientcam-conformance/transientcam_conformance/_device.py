"""The camera that is checked: requests, streams, and its state before the checks."""

import re
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from typing import Any, Final

import httpx

from transientcam.errors import PromiseBroken, ProtocolError
from transientcam.requests import problem
from transientcam.transport import (
    answer_of,
    http_client,
    media_type,
    parse_address,
    set_lease,
    translated,
)
from transientcam.wire import LEASE_HEADER, MEDIA_TYPE, PROBLEM_MEDIA_TYPE, Frame, parse_frame
from transientcam_conformance._conversation import Conversation, connected
from transientcam_conformance._expecting import equal, expect, skip_unless

API: Final = "/api/v1"
HOLDER: Final = "transientcam conformance"
_STATE: Final = ("sequence", "reconstruction")
_CHANGE_COUNTERS: Final = frozenset(("sequence_id", "reconstruction_id"))
_LEASE_S: Final = 600.0
_SHOWN = 120


class Device:
    """A running camera, its raw answers, and its state before the checks.

    ``url``, ``token``: as of `Camera`.
    ``timeout_s``: how long an event may take that is not the answer to a request.
    """

    def __init__(self, url: str, *, token: str | None = None, timeout_s: float = 30.0) -> None:
        self.address = parse_address(url)
        self.token = token
        self.timeout_s = timeout_s
        self._http = http_client(
            httpx.Client, base_url=self.address.url, token=token, timeout_s=timeout_s
        )
        self._lease_id: str | None = None
        self.answers: list[tuple[dict[str, Any], httpx.Response]] = []
        """The answers of routes that were read already, each with the route's description."""

    # -- requests ------------------------------------------------------------------------------

    def send(self, method: str, path: str, **options: Any) -> httpx.Response:
        """Return the answer to a request, whatever its status."""
        with translated(self.address.url):
            return self._http.request(method, path, **options)

    def peek(self, path: str, *, most_bytes: int = 2**26, **options: Any) -> httpx.Response:
        """Return an answer that may be endless: its head, and its body if it has an end."""
        with translated(self.address.url), self._http.stream("GET", path, **options) as response:
            if not media_type(response.headers.get("content-type", "")).startswith("multipart/"):
                response.read()
                expect(len(response.content) <= most_bytes, f"{path} is without end")
            return response

    def read(self, path: str, **options: Any) -> dict[str, Any]:
        """Return the JSON document at a path. Raises PromiseBroken if there is none."""
        return self.document(self.send("GET", path, **options))

    def document(self, response: httpx.Response, *, status: int = 200) -> dict[str, Any]:
        """Return the JSON document that a request is answered with."""
        what = _named(response)
        if response.status_code != status:
            reason = problem(answer_of(response))
            raise PromiseBroken(f"{what} is answered with {response.status_code}: {reason}")
        equal(_media_type(response), "application/json", f"the media type of {what}")
        return _object(response)

    def refusal(
        self, response: httpx.Response, status: int, *slugs: str, field: str | None = None
    ) -> dict[str, Any]:
        """Return the problem that a request is refused with, which is one of ``slugs``."""
        what = _named(response)
        equal(response.status_code, status, f"the status of {what}")
        equal(_media_type(response), PROBLEM_MEDIA_TYPE, f"the media type of the refusal of {what}")
        document = _object(response)
        equal(document.get("status"), status, f"`status` in the problem of {what}")
        for key in ("type", "title", "detail"):
            expect(document.get(key), f"the problem of {what} has no `{key}`")
        if slugs:
            expect(
                document["type"] in [f"/problems/{slug}" for slug in slugs],
                f"{what} is refused with the problem {document['type']}, not {' or '.join(slugs)}",
            )
        if field is not None:
            equal(document.get("field"), field, f"`field` in the problem of {what}")
            expect("limit" in document, f"the problem of {what} has no `limit`")
        return document

    def frame(self, path: str, **options: Any) -> Frame:
        """Return the product of a frame at a path, as msgpack."""
        response = self.send("GET", path, headers={"accept": MEDIA_TYPE}, **options)
        if response.status_code != httpx.codes.OK:
            reason = problem(answer_of(response))
            raise PromiseBroken(f"{_named(response)} is refused: {reason}")
        equal(_media_type(response), MEDIA_TYPE, f"the media type of {_named(response)}")
        try:
            return parse_frame(response.content)
        except ProtocolError as error:
            raise PromiseBroken(f"{_named(response)} is no frame: {error}") from error

    @contextmanager
    def stream(self, *products: str, **options: Any) -> Iterator[Conversation]:
        """Subscribe for the length of a block; options as of `connected`."""
        chosen = {"token": self.token, "timeout_s": self.timeout_s} | options
        with connected(self.address.stream, *products, **chosen) as conversation:
            yield conversation

    # -- what it is ----------------------------------------------------------------------------

    @cached_property
    def openapi(self) -> dict[str, Any]:
        """The interface as the camera describes it."""
        return self.read("/openapi.json")

    def offers(self, method: str, path: str) -> bool:
        """Return whether an operation is described."""
        described = _nameless(API + path)
        paths = self.openapi.get("paths", {})
        return any(method.lower() in paths[each] for each in paths if _nameless(each) == described)

    @property
    def camera(self) -> dict[str, Any]:
        """Capabilities and state of the camera."""
        return self.read(f"{API}/camera")

    @property
    def sequence(self) -> dict[str, Any]:
        """The sequence that is captured."""
        return self.read(f"{API}/sequence")

    def require_simulation(self) -> None:
        """Skip the check unless the camera is simulated."""
        skip_unless(self.camera["simulated"], "the camera is a real one: nothing can be broken")

    def require_product(self, name: str) -> None:
        """Skip the check unless frames of this camera have a product."""
        skip_unless(self.offered(name), f"frames of this camera have no {name}")

    def offered(self, *names: str) -> tuple[str, ...]:
        """Return those products of these that frames of this camera have."""
        products = {each["name"] for each in self.read(f"{API}/info")["products"]}
        return tuple(name for name in names if name in products)

    @property
    def fixed_harmonics(self) -> int | None:
        """How many frequencies there are where the camera has no choice; None where it has."""
        sampling = self.camera["capabilities"].get("sampling", {})  # older ones do not state it
        return len(sampling.get("multiples", ())) or None

    def wait_until(self, happened: Callable[[], bool], what: str) -> None:
        """Wait until ``happened`` returns true; a promise is broken if it does not in time."""
        end_s = time.monotonic() + self.timeout_s
        while not happened():
            if time.monotonic() >= end_s:
                raise PromiseBroken(f"{what} within {self.timeout_s:g} s")
            time.sleep(0.05)

    # -- changing it ---------------------------------------------------------------------------

    @contextmanager
    def control(self) -> Iterator[None]:
        """Hold the lease for a block, and undo its changes at the end.

        Raises CheckSkipped if another client holds the lease, or the token allows no changes.
        """
        if self._lease_id is not None:
            yield
            return
        terms = {"holder": HOLDER, "duration_s": _LEASE_S, "on_lapse": "keep"}
        response = self.send("POST", f"{API}/lease", json=terms)
        if response.status_code in (401, 403, 409):
            skip_unless(False, f"nothing may be changed: {problem(answer_of(response))}")
        granted = self.document(response, status=201)
        before = self.state()
        self.hold(granted["lease_id"])
        try:
            yield
        finally:
            # the check may have lost it, as a part of what it checks
            held = self.send("PUT", f"{API}/lease").is_success
            if not held:
                self.hold(None)
            try:
                self._restore(before)
            finally:
                if held:
                    self.send("DELETE", f"{API}/lease")
                self.hold(None)

    @contextmanager
    def as_another(self) -> Iterator[dict[str, str]]:
        """Send requests without the lease for a block; yields the header that carries it."""
        lease_id = self._lease_id
        assert lease_id is not None  # noqa: S101 - it is used within `control`
        del self._http.headers[LEASE_HEADER]
        try:
            yield {LEASE_HEADER: lease_id}
        finally:
            self.hold(self._lease_id)

    def hold(self, lease_id: str | None) -> None:
        """Send this lease with every change from now on."""
        self._lease_id = lease_id
        set_lease(self._http.headers, lease_id)

    @contextmanager
    def capturing(self) -> Iterator[None]:
        """Capture for the length of a block."""
        if self.read(f"{API}/acquisition")["running"]:
            yield
            return
        with self.control():
            self.document(self.send("PUT", f"{API}/acquisition", json={"running": True}))
            yield

    def accepted(self, sequence: Mapping[str, Any]) -> dict[str, Any]:
        """Return the sequence if it can be set; skip the check otherwise."""
        response = self.send("POST", f"{API}/sequence/validate", json=dict(sequence))
        if not response.is_success:
            skip_unless(False, f"this camera does not take it: {problem(answer_of(response))}")
        return dict(sequence)

    def state(self) -> dict[str, Any]:
        """Return all settings that checks change, without the counters of their changes."""
        state = {
            name: {
                key: value
                for key, value in self.read(f"{API}/{name}").items()
                if key not in _CHANGE_COUNTERS
            }
            for name in _STATE
            if self.offers("PUT", f"/{name}")
        }
        return state | {"running": self.read(f"{API}/acquisition")["running"]}

    def _restore(self, before: Mapping[str, Any]) -> None:
        now = self.state()
        for name in _STATE:
            if now.get(name) != before.get(name):
                self.document(self.send("PUT", f"{API}/{name}", json=before[name]))
        if now["running"] != before["running"]:
            body = {"running": before["running"]}
            self.document(self.send("PUT", f"{API}/acquisition", json=body))

    # -- life ----------------------------------------------------------------------------------

    def close(self) -> None:
        """Close all connections."""
        self._http.close()

    def __enter__(self) -> "Device":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _nameless(path: str) -> str:
    """Return a path without the names of its parameters, which are no part of the contract."""
    return re.sub(r"\{\w+\}", "{}", path)


def _named(response: httpx.Response) -> str:
    request = response.request
    path = request.url.raw_path.decode("ascii", "replace")
    return f"{request.method} {path if len(path) <= _SHOWN else path[: _SHOWN - 1] + '…'}"


def _media_type(response: httpx.Response) -> str:
    return media_type(response.headers.get("content-type", ""))


def _object(response: httpx.Response) -> dict[str, Any]:
    try:
        document = response.json()
    except (ValueError, RecursionError) as error:
        raise PromiseBroken(f"{_named(response)} is answered with no JSON") from error
    expect(isinstance(document, dict), f"{_named(response)} is answered with no JSON object")
    return dict(document)
