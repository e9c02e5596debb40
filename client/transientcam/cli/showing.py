"""How verbs that run until interrupted show what happens meanwhile."""

import json
from collections.abc import Callable

from transientcam.cli.terminal import Terminal, echo
from transientcam.robotics import Report

_STYLES = {"info": "green", "warning": "yellow", "error": "red"}


def shown_on(console: Terminal, *, as_json: bool) -> Callable[[Report], None]:
    """Return what prints reports: in colours on ``console``, or as JSON on standard output."""

    def show(report: Report) -> None:
        if as_json:
            echo(json.dumps(report.to_document()))
        else:
            console.print(report.text, style=_STYLES[report.level])

    return show
