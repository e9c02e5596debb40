"""The first process of a container: ``python -m transientcam_supervisor.init COMMAND...``.

Where the first process ends, the kernel kills all others, and with the daemon would die the
supervisor of its light. This one runs the command, hands signals on to it, and ends once every
process has ended.
"""

import ctypes
import os
import signal
import sys
from typing import Final

_HANDED_ON: Final = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)
_PR_SET_CHILD_SUBREAPER: Final = 36


def main() -> None:
    """Run the command, and exit with its code."""
    ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1)  # also where it is not the first one
    command = os.posix_spawnp(sys.argv[1], sys.argv[1:], os.environ)
    for each in _HANDED_ON:
        signal.signal(each, lambda number, _: os.kill(command, number))
    code = 0
    while True:
        try:
            process, status = os.wait()
        except ChildProcessError:
            break
        if process == command:
            ended = os.waitstatus_to_exitcode(status)
            code = ended if ended >= 0 else 128 - ended  # as a shell says it
            for each in _HANDED_ON:
                signal.signal(each, signal.SIG_IGN)  # its number may be another's by now
    sys.exit(code)


if __name__ == "__main__":
    main()
