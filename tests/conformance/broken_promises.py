"""For every check a daemon that fails it, and a word that the reason has to say."""

import json
from dataclasses import replace
from typing import Any

from tests.conformance.breaking import Answer, Breaking, Map

API = "/api/v1"


def answering(path: str, method: str = "GET", **changes: Any) -> Breaking:
    """Break documents: values changed, None taken away."""

    def answer(each: Answer) -> Answer:
        ours = (each.path, each.method) == (path, method) and each.body
        return each.with_json(**changes) if ours else each

    return Breaking(answer=answer)


def with_status(path: str, status: int, method: str = "GET") -> Breaking:
    """Break statuses."""
    return Breaking(
        answer=lambda each: (
            replace(each, status=status) if (each.path, each.method) == (path, method) else each
        )
    )


def plain(path: str, status: int, method: str = "GET") -> Breaking:
    """Answer with text where there should be a document."""
    return Breaking(
        answer=lambda each: (
            each.plain(status) if (each.path, each.method) == (path, method) else each
        )
    )


def without_header(name: str) -> Breaking:
    """Leave a header out of every answer."""
    return Breaking(answer=lambda each: each.without(name))


def deaf_to(name: str) -> Breaking:
    """Ignore a header of every request."""
    return Breaking(request=lambda headers: {k: v for k, v in headers.items() if k != name})


def never_saying(**wanted: Any) -> Breaking:
    """Swallow messages of the stream that have all these values."""
    return Breaking(said=lambda message: None if _has(message, wanted) else message)


def saying(kind: str, **changes: Any) -> Breaking:
    """Change values in all messages of one type."""
    return Breaking(
        said=lambda message: {**message, **changes} if message["type"] == kind else message
    )


def noticing(kind: str, **changes: Any) -> Breaking:
    """Change values in all notices of one kind."""
    return Breaking(
        said=lambda message: {**message, **changes} if message.get("kind") == kind else message
    )


def closing(code: int) -> Breaking:
    """Close with another code."""
    return Breaking(closed=lambda _: code)


def _has(message: Map, wanted: Map) -> bool:
    return all(message.get(key) == value for key, value in wanted.items())


def _no_routes(answer: Answer) -> Answer:
    return answer.with_json(paths={}) if answer.path == "/openapi.json" else answer


def describing(name: str, **changes: Any) -> Breaking:
    """Describe a parameter otherwise than it is."""

    def answer(each: Answer) -> Answer:
        if each.path != f"{API}/parameters":
            return each
        parameters = json.loads(each.body)["parameters"]
        for parameter in parameters:
            if parameter["name"] == name:
                parameter.update(changes)
        return each.with_json(parameters=parameters)

    return Breaking(answer=answer)


def one_bit_wrong(product: str) -> Breaking:
    """Flip one bit of every frame of a product."""

    def said(message: Map) -> Map:
        if message.get("type") != "frame" or message["product"] != product:
            return message
        data = bytearray(message["array"]["data"])
        data[len(data) // 2] ^= 1
        return {**message, "array": {**message["array"], "data": bytes(data)}}

    return Breaking(said=said)


def _shifted(answer: Answer) -> Answer:
    if answer.status != 206:
        return answer
    return replace(answer, body=answer.body[1:] + answer.body[:1])


def _lying_down(message: Map) -> Map:
    """Say that large images are as high as they are wide."""
    if message.get("type") != "frame" or len(message["array"]["data"]) < 2**20:
        return message
    images, height, width = message["array"]["shape"]
    return {**message, "array": {**message["array"], "shape": [images, width, height]}}


def _fewer_bins(answer: Answer) -> Answer:
    return answer.plain(200) if len(answer.body) > 2**20 else answer


class Losing:
    """Swallows every n-th frame of a product, and says nothing of it."""

    def __init__(self, product: str, every: int) -> None:
        self._product = product
        self._every = every
        self._count = 0

    def __call__(self, message: Map) -> Map | None:
        if message.get("type") == "frame" and message["product"] == self._product:
            self._count += 1
            if self._count % self._every == 0:
                return None
        return message


def _never_behind(message: Map) -> Map:
    """Ask for as many credits as there are: nothing is held back."""
    return {**message, "credits": None} if message.get("type") == "subscribe" else message


def _not_resuming(message: Map) -> Map:
    return {**message, "start": None} if message.get("type") == "subscribe" else message


def _only_in_full(message: Map) -> Map | None:
    """Ignore every subscription that leaves anything out, as the later ones do."""
    return None if message.get("type") == "subscribe" and "credits" not in message else message


def _unlimited(message: Map) -> Map:
    if message.get("type") != "subscribe":
        return message
    products = [{"product": each["product"]} for each in message["subscriptions"]]
    return {**message, "subscriptions": products}


def _in_the_address(answer: Answer) -> Answer:
    """Admit clients that write a token into the address."""
    return replace(answer, status=200) if "token=" in answer.query else answer


BROKEN: list[tuple[str, Breaking, str]] = [
    # routes
    ("every-route-of-the-contract-is-described", Breaking(answer=_no_routes), "GET /lease"),
    ("versions-are-stated", answering("/api/versions", api=[]), "without v1"),
    ("every-route-answers-as-documented", with_status(f"{API}/lease", 418), "418"),
    ("every-document-fits-its-schema", answering(f"{API}/camera", state=7), "state"),
    ("head-is-get-without-its-body", with_status("/livez", 405, "HEAD"), "HEAD /livez"),
    ("a-body-that-is-no-json-is-refused", plain(f"{API}/plan", 500, "POST"), "POST"),
    # problems
    ("an-unknown-path-is-a-problem", plain(f"{API}/no-such-thing", 404), "media type"),
    ("a-wrong-method-is-a-problem", without_header("allow"), "Allow"),
    ("a-broken-body-is-a-problem", with_status(f"{API}/acquisition", 500, "PUT"), "500"),
    ("a-wrong-value-is-named", answering(f"{API}/acquisition", "PUT", field="body"), "field"),
    (
        "an-unknown-field-is-named",
        answering(f"{API}/sequence/validate", "POST", limit=None),
        "no `limit`",
    ),
    (
        "an-unknown-product-is-a-problem",
        answering(f"{API}/frames/latest/no-such-product", known=[]),
        "range",
    ),
    ("an-unknown-recording-is-a-problem", with_status(f"{API}/recordings/none", 410), "410"),
    ("a-body-that-is-too-large-is-a-problem", with_status(f"{API}/acquisition", 400, "PUT"), "400"),
    ("every-problem-has-a-page", with_status("/problems/not-found", 404), "/problems/not-found"),
    ("every-answer-names-its-request", without_header("x-request-id"), "X-Request-ID"),
    # parameters
    (
        "every-value-is-within-its-limits",
        describing("sequence.exposure_s", max=1e-9),
        "above its max",
    ),
    (
        "every-parameter-has-unit-and-meaning",
        describing("sequence.exposure_s", description=""),
        "description",
    ),
    (
        "parameters-are-what-their-resources-say",
        describing("sequence.exposure_s", value=0.04),
        "sequence.exposure_s",
    ),
    (
        "a-parameter-out-of-range-is-refused-and-changes-nothing",
        describing("sequence.harmonics", max=2),
        "beyond its limits gives 200",
    ),
    (
        "the-limits-of-a-sequence-are-taken",
        describing("sequence.harmonics", max=4711),
        "its limit, is refused",
    ),
    (
        "a-sequence-out-of-range-is-refused-and-changes-nothing",
        answering(f"{API}/sequence", "PUT", field=None),
        "field",
    ),
    (
        "a-checked-sequence-is-not-set",
        answering(f"{API}/sequence/validate", "POST", harmonics=9),
        "what would be set",
    ),
    # tags
    ("what-can-be-changed-has-a-tag", without_header("etag"), "no ETag"),
    ("what-is-known-is-not-sent-again", deaf_to("if-none-match"), "200"),
    ("a-stale-tag-changes-nothing", deaf_to("if-match"), "200"),
    ("the-right-tag-changes-it", with_status(f"{API}/sequence", 412, "PUT"), "412"),
    # lease
    (
        "a-second-writer-learns-who-holds-the-lease",
        answering(f"{API}/acquisition", "PUT", holder="x"),
        "holder",
    ),
    ("watchers-are-never-blocked", answering(f"{API}/lease", lease_id="secret"), "shown"),
    ("the-holder-changes-things", with_status(f"{API}/acquisition", 409, "PUT"), "409"),
    ("a-renewed-lease-lasts-on", answering(f"{API}/lease", "PUT", expires_in_s=3.0), "renewed"),
    (
        "a-lease-given-back-is-over",
        answering(f"{API}/acquisition", "PUT", type="/problems/other"),
        "lease-lost",
    ),
    (
        "a-lease-that-is-not-renewed-lapses-and-the-light-goes-off",
        never_saying(kind="lease-changed", change="lapsed"),
        "within",
    ),
    ("a-takeover-is-notified", noticing("lease-changed", **{"from": None}), "former"),
    (
        "every-client-can-switch-the-light-off",
        with_status(f"{API}/acquisition/safe-off", 409, "POST"),
        "409",
    ),
    # stream
    ("a-handshake-without-the-subprotocol-is-refused", with_status(f"{API}/stream", 404), "404"),
    ("the-greeting-says-what-frames-look-like", saying("frame", unit="furlong"), "furlong"),
    ("the-products-of-a-frame-come-together", Breaking(said=Losing("range", 1)), "order"),
    ("frames-are-counted-and-announced", saying("frame", meta={"frame": 1}), "counted"),
    ("a-streamed-frame-is-the-one-that-is-asked-for", one_bit_wrong("range"), "differs"),
    ("a-bad-first-message-ends-the-stream", closing(1000), "close code"),
    ("a-bad-later-message-disturbs-nothing", never_saying(type="error"), "no problem"),
    ("a-subscription-can-be-replaced", Breaking(heard=_only_in_full), "no hello"),
    ("a-change-of-the-sequence-is-notified", never_saying(kind="sequence-changed"), "no notice"),
    ("a-rate-limit-is-kept", Breaking(heard=_unlimited), "quarter"),
    # slow readers
    ("drops-are-reported", never_saying(kind="dropped"), "reported as dropped"),
    (
        "who-does-not-acknowledge-gets-no-more-than-its-credits",
        Breaking(heard=_never_behind),
        "beyond the credits",
    ),
    (
        "a-client-that-never-reads-delays-no-other",
        Breaking(said=Losing("flags", 4)),
        "healthy client",
    ),
    ("who-never-reads-loses-frames", never_saying(kind="dropped"), "reported as dropped"),
    # resume
    ("a-stream-goes-on-where-it-stopped", Breaking(heard=_not_resuming), "resuming from"),
    ("a-gap-is-stated", Breaking(heard=_not_resuming), "resuming from 1"),
    # sizes
    ("an-answer-over-1-mib-arrives-whole", Breaking(answer=_fewer_bins), "media type"),
    ("an-answer-over-16-mib-arrives-whole", Breaking(answer=_fewer_bins), "media type"),
    ("a-message-over-1-mib-arrives-whole", Breaking(said=_lying_down), "shape"),
    ("a-message-over-16-mib-arrives-whole", Breaking(said=_lying_down), "shape"),
    (
        "an-answer-without-measure-is-refused",
        with_status(f"{API}/frames/latest/transient", 500),
        "500",
    ),
    # recording
    (
        "a-recording-is-announced-and-described",
        noticing("recording-stopped", recording="another"),
        "another",
    ),
    ("one-recording-runs-at-a-time", answering(f"{API}/recordings", "POST", recording="x"), "'x'"),
    ("a-file-can-be-fetched-in-parts", Breaking(answer=_shifted), "differs"),
    ("recorded-frames-are-those-that-were-streamed", one_bit_wrong("raw"), "differ"),
    ("a-replay-is-those-frames-again", one_bit_wrong("raw"), "replayed frame"),
    # unplug
    ("an-unplugged-camera-is-reported", with_status("/readyz", 200), "200"),
    ("a-lost-camera-refuses-and-remembers", plain(f"{API}/frames/latest", 503), "503"),
    ("a-camera-that-is-back-goes-on", never_saying(kind="camera-back"), "no notice"),
    ("spoilt-images-are-counted", noticing("lost-images", count=0), "no lost image"),
    # authentication
    ("health-is-open", with_status("/livez", 401), "401"),
    ("a-wrong-token-is-refused", without_header("www-authenticate"), "WWW-Authenticate"),
    ("a-stream-with-a-wrong-token-is-closed", closing(1000), "close code"),
]

BROKEN_WITH_TOKENS: list[tuple[str, Breaking, str]] = [
    ("no-request-is-served-without-a-token", with_status("/metrics", 200), "200"),
    ("a-token-in-the-address-is-none", Breaking(answer=_in_the_address), "200"),
    ("the-token-given-is-let-in", deaf_to("x-api-key"), "401"),
]
