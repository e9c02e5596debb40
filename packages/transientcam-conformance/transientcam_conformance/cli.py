"""``transientcam conformance``: checks of a running camera against the documentation."""

import json
from pathlib import Path
from typing import Annotated

import typer

from transientcam.cli.options import TokenOption, UrlArgument
from transientcam.cli.terminal import Terminal, Text, echo
from transientcam_conformance import CHECKS, SLOW, Check, Device, Report, Result, chosen, run

_MARKS = {
    "passed": ("passed ", "green"),
    "failed": ("FAILED ", "bold red"),
    "skipped": ("skipped", "dim"),
}


def conformance(
    url: UrlArgument,
    report: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Also write the report as JSON; - prints it."),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="GROUP", help="Only the checks of this group; may be repeated."),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help=f"Skip the slow checks: {', '.join(SLOW)}.")
    ] = False,
    timeout_s: Annotated[
        float,
        typer.Option(
            "--timeout", min=1.0, help="Timeout in s for events the camera reports unasked."
        ),
    ] = 30.0,
    token: TokenOption = None,
) -> None:
    """Check a running camera, simulated or real, against the documented interface.

    It takes the lease, changes the sequence, records, unplugs a simulated camera, and sets
    everything back. Exit code 0: every promise is kept, or was skipped for the reason printed. What
    rests on frames that arrive in time is skipped where the camera does not keep its rate.
    """
    checks = chosen(only or (), quick=quick)
    to_standard_output = report is not None and str(report) == "-"
    console = Terminal(stderr=to_standard_output, highlight=False)
    width = max(len(each.name) for each in CHECKS)

    with Device(url, token=token, timeout_s=timeout_s) as device, console.status("") as status:

        def begin(check: Check) -> None:
            status.update(f"{check.group}: {check.promise}")

        def end(result: Result) -> None:
            check = result.check
            name = f" {check.group:<14} {check.name:<{width}} "
            took = f"{result.duration_s:6.2f} s", "dim"
            console.print(Text.assemble(_MARKS[result.outcome], name, took))
            if result.reason is not None:
                console.print(f"        {result.reason}")
            if result.outcome == "failed":
                console.print(f"        {check.promise}", style="dim")

        outcome = run(device, checks, begin=begin, end=end)
    console.print(_summary(outcome))
    if report is not None:
        text = json.dumps(outcome.to_document(), indent=2)
        if to_standard_output:
            echo(text)
        else:
            report.write_text(text + "\n", encoding="utf-8")
    if outcome.failed:
        raise typer.Exit(code=1)


def _summary(report: Report) -> str:
    counts = ", ".join(f"{count} {name}" for name, count in report.counts.items())
    camera = report.camera
    what = f"{camera['model']} {camera['serial']} at {report.url}" if camera else report.url
    summary = f"{what}: {counts}, in {report.duration_s:.0f} s"
    if report.slow is None:
        return summary
    slow = f"{report.slow}; what rests on it could not be tried"
    return f"{summary}\n{slow[0].upper()}{slow[1:]}."
