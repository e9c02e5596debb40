"""Waiting for what a bridge reports."""

import queue

from transientcam.robotics import Report

WAIT_S = 120.0
"""For an event that comes, on a machine that is laden; not a measurement."""


def said(reports: queue.Queue[Report], text: str) -> Report:
    """Wait for a report that contains a text."""
    while True:
        report = reports.get(timeout=WAIT_S)
        if text in report.text:
            return report
