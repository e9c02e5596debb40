"""Whether clients can take the service away from others: ``python -m benchmarks.abuse [--write]``.

Each attack goes on at full speed from 1 and from 16 connections against a daemon of its own, with
the simulated camera at the paper's video setting (Sec. 6.3: 18.6 Hz). Meanwhile a viewer streams
range, /livez is asked, a lease lapses, the light is switched off, and SIGTERM ends it: half a
minute each. With ``--write`` and the names of some attacks their lines of the page are replaced.
``--before CHECKOUT`` attacks the daemon of another checkout instead, from 1 connection, and writes
the page's part that says what was before; ``--minutes 10`` mixes all attacks for so long instead.
"""

import argparse
import os
from pathlib import Path

from benchmarks.abuse.attacks import ATTACKS
from benchmarks.abuse.measuring import measure
from benchmarks.abuse.page import PAGE, mixed_page, page, page_with, page_with_before, row
from benchmarks.abuse.soaking import soak
from benchmarks.common.machine import commit_of

CONNECTIONS = (1, 16)
DURATION_S = 5.0


def main() -> None:
    """Attack, print, and with ``--write`` keep the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.abuse", description=__doc__)
    parser.add_argument("attacks", nargs="*", metavar="ATTACK", help=f"of {', '.join(ATTACKS)}")
    parser.add_argument("--before", type=Path, help="another checkout, measured instead")
    parser.add_argument(
        "--connections", type=int, nargs="+", default=CONNECTIONS, help="from how many"
    )
    parser.add_argument("--seconds", type=float, default=DURATION_S, help="of each attack")
    parser.add_argument("--minutes", type=float, help="a mix of all attacks for so long instead")
    parser.add_argument("--write", action="store_true", help=f"write docs/{PAGE.name}")
    arguments = parser.parse_args()
    for name in arguments.attacks:
        if name not in ATTACKS:
            parser.error(f"unknown attack {name!r}, choose from {', '.join(ATTACKS)}")
    if arguments.minutes is not None:
        text = mixed_page(soak(minutes=arguments.minutes))
        print(text)
        if arguments.write:
            PAGE.with_name("abuse-soak.md").write_text(text, encoding="utf-8")
        return
    duration_s, checkout = arguments.seconds, arguments.before
    load, _, _ = os.getloadavg()
    found = []
    for name in arguments.attacks or ATTACKS:
        for connections in arguments.connections if checkout is None else (1,):
            seen = measure(name, connections, duration_s=duration_s, checkout=checkout)
            found.append((name, connections, seen))
            print(row(*found[-1]), flush=True)
    command = _command(arguments)
    if checkout is not None:
        written = PAGE.read_text(encoding="utf-8")
        commit = commit_of(checkout)
        text = page_with_before(written, found, command=command, commit=commit, load=load)
    elif arguments.attacks and arguments.write:
        text = page_with(PAGE.read_text(encoding="utf-8"), found, command=command)
    else:
        text = page(found, duration_s=duration_s, command=command)
    print(text)
    if arguments.write:
        PAGE.write_text(text, encoding="utf-8")


def _command(arguments: argparse.Namespace) -> str:
    """Return what was asked for, as far as it differs from the defaults."""
    parts = ["python -m benchmarks.abuse", *map(repr, arguments.attacks)]
    if tuple(arguments.connections) != CONNECTIONS:
        parts += ["--connections", *map(str, arguments.connections)]
    if arguments.seconds != DURATION_S:
        parts.append(f"--seconds {arguments.seconds:g}")
    if arguments.before is not None:
        parts.append("--before CHECKOUT")
    return " ".join([*parts, "--write"])


if __name__ == "__main__":
    main()
