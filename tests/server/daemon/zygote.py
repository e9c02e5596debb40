"""Daemons as forks of one process that has imported everything: none waits for imports.

A line on standard input is a JSON object ``{"arguments": [...], "environment": {...}}``. The daemon
says on standard output where it serves, as ``transientcam serve --json`` does.
"""

import importlib
import json
import os
import signal
import sys

from stuck_daemon import run  # type: ignore[import-not-found]  # beside this script, no package

for _each in (
    *("transientcam_server.cli.serve", "transientcam_server.daemon._server", "uvloop"),
    *("transientcam_driver.cameras.kinect2", "transientcam_opt8241.plugin"),
    *("transientcam_simulation.entries", "uvicorn.protocols.http.httptools_impl"),
):
    importlib.import_module(_each)


def main() -> None:
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # none is waited for
    print(json.dumps("ready"), flush=True)  # noqa: T201 - the protocol of this process
    for line in sys.stdin:
        wanted = json.loads(line)
        if os.fork() == 0:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            os.environ.update(wanted["environment"])
            sys.argv[1:] = wanted["arguments"]
            run()
            return


if __name__ == "__main__":
    main()
