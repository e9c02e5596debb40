"""The process around the service: settings, socket, connections, signals, systemd, mDNS.

`configuration` reads the settings, `server` listens and serves, `check` and `doctor` say what is
wrong.
"""

from transientcam_server.daemon import _check as check, _server as server
from transientcam_server.daemon._configuration import load, load_settings, tokens_file_of

__all__ = [
    "check",
    "load",
    "load_settings",
    "server",
    "tokens_file_of",
]
