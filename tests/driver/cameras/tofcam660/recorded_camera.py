"""A camera that answers as the recorded one did, over real sockets, and notes what it was asked."""

import socket
import threading
from collections import defaultdict, deque
from pathlib import Path

from tests.driver.cameras.tofcam660.session import frames, steps
from transientcam_driver.cameras.tofcam660 import AnswerType, Command, pack_answer, payload_bytes
from transientcam_driver.cameras.tofcam660._wire import pack_request

NEVER_RECORDED = {Command.STOP_STREAM}
"""The vendor's client has no use for it: it takes single images."""
_REQUEST_BYTES = len(pack_request(Command.READ_CHIP))


class RecordedCamera:
    """Answers each request with the next answer that was recorded for the same bytes."""

    def __init__(self, data_dir: Path) -> None:
        self.requests: list[bytes] = []
        self.unknown: list[bytes] = []
        self._answers: dict[bytes, deque[bytes]] = defaultdict(deque)
        self._images: dict[int, bytes] = {}
        self._header = b""
        stored = frames(data_dir)
        for step in steps(data_dir):
            self._answers[step.request].append(step.response)
            if step.image and step.command == Command.GET_DCS and not self._header:
                self._header = bytes.fromhex(step.image["header"])
        for name, planes in stored.items():
            if name.endswith("_dcs_wire_u16"):
                hertz = round(float(name.split("_")[1].removesuffix("MHz")) * 1e6)
                self._images[hertz] = self._header + planes.astype("<u2").tobytes()
        self._control = socket.create_server(("127.0.0.1", 0))
        self._data = socket.create_server(("127.0.0.1", 0))
        self.control_port, self.data_port = (
            each.getsockname()[1] for each in (self._control, self._data)
        )
        self._thread = threading.Thread(target=self._serve, name="recorded camera")
        self._thread.start()

    def close(self) -> None:
        """Wait until the client has gone."""
        self._thread.join()
        self._control.close()
        self._data.close()

    def _serve(self) -> None:
        connection, _ = self._control.accept()
        images: socket.socket | None = None
        frequency_hz = 0
        with connection:
            while request := _whole(connection, _REQUEST_BYTES):
                self.requests.append(request)
                payload = request[8:-4]
                command = int.from_bytes(payload[:2], "big")
                if command == Command.SET_FREE_FREQUENCY:
                    frequency_hz = int.from_bytes(payload[2:6], "big")
                connection.sendall(self._answer(request, command))
                if command == Command.SET_DATA_PROTOCOL and payload[2] and images is None:
                    images, _ = self._data.accept()
                if command == Command.GET_DCS:
                    assert images is not None
                    images.sendall(self._images[frequency_hz])
        if images is not None:
            images.close()

    def _answer(self, request: bytes, command: int) -> bytes:
        answers = self._answers.get(request)
        if answers:
            return answers[0] if len(answers) == 1 else answers.popleft()
        if command not in NEVER_RECORDED:
            self.unknown.append(request)
        return pack_answer(AnswerType.ACKNOWLEDGE)


def _whole(connection: socket.socket, count: int) -> bytes:
    taken = b""
    while len(taken) < count and (part := connection.recv(count - len(taken))):
        taken += part
    assert not taken or payload_bytes(taken[:8])
    return taken
