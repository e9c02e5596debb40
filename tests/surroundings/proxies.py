"""Proxies that serve a daemon below a path: one of our own, nginx and Caddy."""

import re
import shutil
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from socketserver import StreamRequestHandler, ThreadingTCPServer
from typing import Final
from urllib.parse import urlsplit

PREFIX: Final = "/lidar"
_NGINX: Final = """\
daemon off; pid {folder}/pid; error_log stderr; events {{}}
http {{
  access_log off; client_body_temp_path {folder}/b; proxy_temp_path {folder}/p;
  fastcgi_temp_path {folder}/f; uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s;
  server {{
    listen 127.0.0.1:{port};
    location {prefix}/ {{
      proxy_pass {target}/; proxy_http_version 1.1; proxy_set_header Host $http_host;
      proxy_set_header Upgrade $http_upgrade; proxy_set_header Connection $http_connection;
    }}
  }}
}}
"""
_CADDY: Final = """\
{{ admin off
}}
http://127.0.0.1:{port} {{
  handle_path {prefix}/* {{
    reverse_proxy {target}
  }}
}}
"""


@dataclass
class Proxy:
    """A proxy of our own: its address, and the connections through it."""

    url: str = ""
    connections: list[socket.socket] = field(default_factory=list)

    def cut(self) -> None:
        """End all connections, as a network does while a machine sleeps."""
        for each in self.connections:
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
        self.connections.clear()


@contextmanager
def below_a_path(url: str, *, stripped: bool) -> Iterator[Proxy]:
    """Serve a daemon below `PREFIX`, which is taken off or not."""
    target, proxy = urlsplit(url), Proxy()

    class Handler(StreamRequestHandler):
        def handle(self) -> None:
            head = b"".join(iter(self.rfile.readline, b"\r\n"))
            if not head:
                return
            request, _, fields = head.partition(b"\r\n")
            method, path, version = request.split(b" ")
            if not path.startswith(f"{PREFIX}/".encode()):
                self.wfile.write(b"HTTP/1.1 404 Not here\r\ncontent-length: 0\r\n\r\n")
                return
            path = path[len(PREFIX) :] if stripped else path
            if not re.search(rb"(?i)^upgrade:", fields, re.MULTILINE):  # one request a connection
                fields = re.sub(rb"(?im)^connection:.*\r\n", b"", fields) + b"connection: close\r\n"
            with socket.create_connection((target.hostname, target.port)) as onward:
                onward.sendall(b" ".join((method, path, version)) + b"\r\n" + fields + b"\r\n")
                proxy.connections += (onward, self.connection)
                back = threading.Thread(target=_pass, args=(onward, self.connection))
                back.start()
                _pass(self.rfile, onward)
                back.join()

    with ThreadingTCPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            proxy.url = f"http://127.0.0.1:{server.server_address[1]}{PREFIX}"
            yield proxy
        finally:
            server.shutdown()
            proxy.cut()
            thread.join()


def _pass(source: object, to: socket.socket) -> None:
    """Pass on what comes until it ends, and end the other half."""
    read = getattr(source, "read1", None) or source.recv  # type: ignore[attr-defined]
    with suppress(OSError):
        while data := read(1 << 16):
            to.sendall(data)
    with suppress(OSError):
        to.shutdown(socket.SHUT_WR)


@contextmanager
def by_program(name: str, url: str, folder: Path) -> Iterator[str]:
    """The same by nginx or Caddy, which must be installed."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    text = {"nginx": _NGINX, "caddy": _CADDY}[name]
    file = folder / name
    file.write_text(text.format(folder=folder, port=port, prefix=PREFIX, target=url))
    command = {
        "nginx": f"nginx -e stderr -p {folder} -c {file}",
        "caddy": f"caddy run --adapter caddyfile --config {file}",
    }[name].split()
    with subprocess.Popen(command, executable=shutil.which(name), stderr=subprocess.DEVNULL) as run:
        try:
            yield f"http://127.0.0.1:{port}{PREFIX}"
        finally:
            run.terminate()
