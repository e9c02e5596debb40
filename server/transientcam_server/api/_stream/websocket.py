"""The WebSocket of docs/stream.md: a loop that receives beside a loop that sends."""

import asyncio
import logging
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from transientcam import wire
from transientcam.errors import ProtocolError
from transientcam_server.api._auth.guard import Guard, Principal, log_refusal
from transientcam_server.api._problems import problem_response
from transientcam_server.api._stream.sender import Sender
from transientcam_server.broadcast import UNNUMBERED, Channel, Close, Hub, Outbox
from transientcam_server.errors import Problem, kinds, problem_document, problem_of
from transientcam_server.imaging import Crop, stream_encoding
from transientcam_server.service import Service

_log = logging.getLogger("transientcam_server.api.stream.websocket")
router = APIRouter()
_TOKENS_EVERY_S = 1.0
_REVOKED = "the token is not valid any more"


@router.websocket("/stream")
async def stream(websocket: WebSocket) -> None:
    """Serve one client from its handshake to its close."""
    service: Service = websocket.app.state.service
    offered = websocket.scope["subprotocols"]
    if wire.SUBPROTOCOL not in offered:
        problem = Problem(
            kinds.SUBPROTOCOL_REQUIRED,
            f"Offer the subprotocol {wire.SUBPROTOCOL}.",
            field="Sec-WebSocket-Protocol",
            value=offered,
            limit=wire.SUBPROTOCOL,
            supported=[wire.SUBPROTOCOL],
        )
        await websocket.send_denial_response(problem_response(problem, instance=websocket.url.path))
        return
    await websocket.accept(subprotocol=wire.SUBPROTOCOL)
    try:
        await _Client(websocket, service).serve()
    except WebSocketDisconnect:
        _log.debug("client %s is gone", websocket.client)


@asynccontextmanager
async def watching_tokens(hub: Hub, guard: Guard) -> AsyncIterator[None]:
    """Close the streams of clients whose token is revoked or expires, to the end of the block."""
    watching = asyncio.create_task(_watch_tokens(hub, guard))
    try:
        yield
    finally:
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)


async def _watch_tokens(hub: Hub, guard: Guard) -> None:
    while True:
        await asyncio.sleep(_TOKENS_EVERY_S)
        for outbox in hub.outboxes:
            owner = outbox.owner
            if isinstance(owner, Principal) and not guard.still_valid(owner):
                outbox.put(Close(wire.CloseCode.AUTHENTICATION_FAILED, _REVOKED))


class _Client:
    """One connected client."""

    def __init__(self, websocket: WebSocket, service: Service) -> None:
        self._websocket = websocket
        self._service = service
        self._session = secrets.token_hex(8)
        self._outbox = Outbox(depth=service.settings.stream.queue_frames)
        self._sender = Sender(websocket, self._outbox, websocket.app.state.metrics)

    async def serve(self) -> None:
        """Subscribe, then send and receive until either end closes."""
        hub = self._service.hub
        limit = self._service.settings.stream.max_clients
        if hub.clients >= limit:
            problem = Problem(
                kinds.TOO_MANY_CLIENTS, f"{limit} clients are connected.", limit=limit
            )
            await self._close_with(problem, wire.CloseCode.TRY_AGAIN_LATER)
            return
        # counted from here on, so that clients that do not subscribe are limited too
        hub.join(self._outbox)
        try:
            try:
                await self._first_message()
            except Problem as problem:
                await self._refuse(problem)
                return
            await self._exchange()
        finally:
            hub.leave(self._outbox)

    async def _first_message(self) -> None:
        limit_s = self._service.settings.stream.first_message_s
        try:
            async with asyncio.timeout(limit_s):
                data = await self._receive()
        except TimeoutError:
            raise Problem(
                kinds.FIRST_MESSAGE_LATE,
                f"No subscription arrived within {limit_s:g} s.",
                limit=limit_s,
            ) from None
        try:
            message = wire.parse_client_message(data)
        except ProtocolError as error:
            raise problem_of(error) from error
        if not isinstance(message, wire.Subscribe):
            raise Problem(
                kinds.BAD_MESSAGE,
                "The first message must be subscribe.",
                field="type",
                value="ack",
                limit="subscribe",
            )
        guard: Guard = self._websocket.app.state.guard
        self._outbox.owner = guard.identify(self._websocket.headers, first_message=message.token)
        self._subscribe(message)

    async def _refuse(self, problem: Problem) -> None:
        code = wire.CloseCode.BAD_FIRST_MESSAGE
        if problem.kind in (kinds.TOKEN_REQUIRED, kinds.TOKEN_REFUSED):
            log_refusal(self._websocket.scope, problem)
            code = wire.CloseCode.AUTHENTICATION_FAILED
        await self._close_with(problem, code)

    async def _exchange(self) -> None:
        """Send beside receiving; whichever ends first ends the other."""
        receiving = asyncio.create_task(self._receive_all())
        sending = asyncio.create_task(self._sender.send_all())
        try:
            await asyncio.wait((receiving, sending), return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (receiving, sending):
                task.cancel()
            results = await asyncio.gather(receiving, sending, return_exceptions=True)
        for result in results:
            if isinstance(result, Exception):
                raise result

    async def _receive_all(self) -> None:
        while True:
            data = await self._receive()
            try:
                message = wire.parse_client_message(data)
                if isinstance(message, wire.Ack):
                    self._outbox.acknowledge(message.frame)
                else:
                    self._subscribe(message)
            except (ProtocolError, Problem) as error:
                self._outbox.put(wire.ErrorMessage(problem_document(problem_of(error))))

    async def _receive(self) -> bytes | str:
        message = await self._websocket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(message.get("code", wire.CloseCode.ABNORMAL))
        data: bytes | str | None = message.get("bytes")
        return data if data is not None else message["text"]

    def _subscribe(self, message: wire.Subscribe) -> None:
        """Take a subscription, whole or not at all, and answer it with a hello."""
        service, outbox = self._service, self._outbox
        most = service.settings.stream.max_subscriptions
        if len(message.subscriptions) > most:
            raise Problem(
                kinds.BAD_MESSAGE,
                f"{len(message.subscriptions)} subscriptions are more than {most}.",
                field="subscriptions",
                value=len(message.subscriptions),
                limit=f"at most {most}",
            )
        channels: list[Channel] = []
        for index, wanted in enumerate(message.subscriptions):
            channel = self._channel(wanted, f"subscriptions[{index}].")
            if any(_alike(channel, each) for each in channels):
                raise _refused(
                    f"subscriptions[{index}].product",
                    wanted.product,
                    "another product, or this one in another form",
                )
            channels.append(channel)
        service.hub.subscribe(outbox, channels, credit=message.credits)
        outbox.put(
            wire.Hello(
                session=self._session,
                server=service.identity,
                channels=service.channel_table(outbox.channels),
                sequence=service.applied.to_document(),
                camera={"state": service.acquisition.status().state},
            )
        )
        if message.start is not None:
            outbox.resume(service.history, start=message.start)

    def _channel(self, wanted: wire.Subscription, path: str) -> Channel:
        product = self._service.pipeline.product(wanted.product)
        if product.over_time:
            limit = "a product without times of flight (coefficients hold all of them)"
            raise _refused(f"{path}product", product.name, limit)
        if wanted.encoding not in product.description.encodings:
            limit = f"{' or '.join(product.description.encodings)} for {product.name}"
            raise _refused(f"{path}encoding", wanted.encoding, limit)
        capabilities = self._service.camera.capabilities
        try:
            crop = Crop.of(
                wanted.region,
                wanted.decimation,
                height=capabilities.height,
                width=capabilities.width,
                path=path,
            )
        except Problem as problem:
            raise Problem(kinds.BAD_MESSAGE, problem.detail, **problem.extensions) from None
        encoding = stream_encoding(wanted.encoding)
        return Channel(UNNUMBERED, product, wanted.max_rate_hz, encoding, crop)

    async def _close_with(self, problem: Problem, code: wire.CloseCode) -> None:
        message = wire.ErrorMessage(problem_document(problem))
        await self._websocket.send_bytes(wire.encode(message))
        await self._websocket.close(code, problem.kind.title)


def _alike(one: Channel, other: Channel) -> bool:
    """Whether two channels would carry the same bytes."""
    return (
        one.product.name == other.product.name
        and one.encoding.name == other.encoding.name
        and one.crop == other.crop
    )


def _refused(field: str, value: object, limit: str) -> Problem:
    detail = f"{value} cannot be streamed here: {field} must be {limit}."
    return Problem(kinds.BAD_MESSAGE, detail, field=field, value=value, limit=limit)
