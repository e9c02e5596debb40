"""The WebSocket of docs/stream.md: a loop that receives beside a loop that sends."""

import asyncio
import logging
import secrets
import time
from typing import Any

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from transientcam import wire
from transientcam.errors import ProtocolError
from transientcam_server import problem_kinds as kinds
from transientcam_server.auth import log_refusal
from transientcam_server.encoding import MSGPACK
from transientcam_server.errors import Problem
from transientcam_server.hub import Channel, Delivery, Goodbye, Outbox
from transientcam_server.metrics import Metrics
from transientcam_server.problems import problem_document, problem_of, problem_response
from transientcam_server.service import Service

_log = logging.getLogger(__name__)
router = APIRouter()


@router.websocket("/stream")
async def stream(websocket: WebSocket) -> None:
    """Serve one client from its handshake to its goodbye."""
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


class _Client:
    """One connected client."""

    def __init__(self, websocket: WebSocket, service: Service) -> None:
        self._websocket = websocket
        self._service = service
        self._session = secrets.token_hex(8)
        self._outbox = Outbox(depth=service.settings.stream.queue_frames)
        self._sender = _Sender(websocket, self._outbox, service.metrics)

    async def serve(self) -> None:
        """Subscribe, then send and receive until either end has enough."""
        hub = self._service.hub
        limit = self._service.settings.stream.max_clients
        if hub.clients >= limit:
            problem = Problem(kinds.TOO_MANY_CLIENTS, f"{limit} clients look on.", limit=limit)
            await self._dismiss(problem, wire.CloseCode.TRY_AGAIN_LATER)
            return
        # counted from here on, so that those who do not subscribe are limited too
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
        self._outbox.owner = self._service.guard.identify(
            self._websocket.headers, first_message=message.token
        )
        self._subscribe(message)

    async def _refuse(self, problem: Problem) -> None:
        code = wire.CloseCode.BAD_FIRST_MESSAGE
        if problem.kind in (kinds.TOKEN_REQUIRED, kinds.TOKEN_REFUSED):
            log_refusal(self._websocket.scope, problem)
            code = wire.CloseCode.AUTHENTICATION_FAILED
        await self._dismiss(problem, code)

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
        hub, pipeline = self._service.hub, self._service.pipeline
        channels: dict[str, Channel] = {}
        for index, wanted in enumerate(message.subscriptions):
            product = pipeline.product(wanted.product)
            if product.over_time or product.name in channels:
                limit = "another product" if product.over_time else "each product once"
                raise Problem(
                    kinds.BAD_MESSAGE,
                    f"{product.name} cannot be streamed here: {limit}; a stream of coefficients "
                    "holds all times of flight.",
                    field=f"subscriptions[{index}].product",
                    value=product.name,
                    limit=limit,
                )
            number = hub.channel_number(product)
            channels[product.name] = Channel(number, product, wanted.max_rate_hz)
        self._outbox.subscribe(tuple(channels.values()), credit=message.credits)
        self._outbox.put(
            wire.Hello(
                session=self._session,
                server=self._service.identity,
                channels=self._service.channel_table(self._outbox.channels),
                sequence=self._service.applied.to_document(),
                camera={"state": self._service.acquisition.status().state},
            )
        )
        self._resume(message.start)

    def _resume(self, start: int | None) -> None:
        """Send the newest frame if it was asked for, and say which older ones are not here."""
        latest = self._service.hub.latest
        if start is None or latest is None:
            return
        if start < latest.number:
            missing = {"from": start, "to": latest.number - 1, "reason": "not kept"}
            self._outbox.put(wire.Notice("gap", missing))
        if start <= latest.number:
            self._outbox.put_frame(latest)

    async def _dismiss(self, problem: Problem, code: wire.CloseCode) -> None:
        message = wire.ErrorMessage(problem_document(problem))
        await self._websocket.send_bytes(wire.encode(message))
        await self._websocket.close(code, problem.kind.title)


class _Sender:
    """Empties an outbox into a WebSocket."""

    def __init__(self, websocket: WebSocket, outbox: Outbox, metrics: Metrics) -> None:
        self._websocket = websocket
        self._metrics = metrics
        self._outbox = outbox
        self._failing: set[str] = set()

    async def send_all(self) -> None:
        """Send until the client is gone or was told goodbye."""
        while True:
            item = await self._outbox.next()
            if isinstance(item, Goodbye):
                await self._websocket.close(item.code, item.reason)
                return
            if isinstance(item, Delivery):
                await self._deliver(item)
            else:
                await self._websocket.send_bytes(wire.encode(item))

    async def _deliver(self, delivery: Delivery) -> None:
        # all products of the frame are under way at once; each is sent as soon as those before
        work = [self._encoded(delivery, channel) for channel in delivery.channels]
        tasks = [asyncio.ensure_future(each) for each in work]
        try:
            for channel, task in zip(delivery.channels, tasks, strict=True):
                await self._tell_dropped(channel)
                try:
                    data = await task
                except Problem as problem:
                    await self._tell_failed(channel, problem)
                else:
                    self._failing.discard(channel.product.name)
                    await self._websocket.send_bytes(data)
                    self._metrics.sent(time.time() - delivery.frame.raw.host_time_s)
        finally:
            for task in tasks:
                task.cancel()

    async def _encoded(self, delivery: Delivery, channel: Channel) -> bytes:
        return await delivery.frame.encoded(channel.product, MSGPACK, channel=channel.number)

    async def _tell_dropped(self, channel: Channel) -> None:
        if channel.dropped:
            count, channel.dropped = channel.dropped, 0
            channel.dropped_total += count
            details = {"channel": channel.number, "count": count, "total": channel.dropped_total}
            await self._websocket.send_bytes(wire.encode(wire.Notice("dropped", details)))

    async def _tell_failed(self, channel: Channel, problem: Problem) -> None:
        """Tell a failure once, not with every frame until it is mended."""
        if channel.product.name not in self._failing:
            self._failing.add(channel.product.name)
            document: dict[str, Any] = problem_document(problem)
            document["channel"] = channel.number
            await self._websocket.send_bytes(wire.encode(wire.ErrorMessage(document)))
