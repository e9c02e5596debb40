"""The page docs/plans.md, whose parts are measured and written one by one."""

import re
from pathlib import Path
from typing import Final

from benchmarks.common.machine import machine

PAGE: Final = Path(__file__).parents[2] / "docs" / "plans.md"
PARTS: Final = {
    "expectations": "What to expect",
    "promises": "Do plans keep what they promise?",
    "audit": "The worst cases of an audit",
    "calibrating": "What the intervals are made of",
    "checking": "Do intervals hold on scenes that took no part in them?",
    "regret": "How much quicker could a plan have been?",
}
_HEAD: Final = """# Do plans keep what they promise?

A plan looks at a scene once, and says which sequence reaches a target soonest and how large its
error will be. Here many scenes are looked at, each plan is captured with other noise, and its error
is held against the truth of the simulation.

An error is noise and bias together, of the median lit pixel. Each part below is measured by a
command of its own, which it names.

`outlier_share` counts what noise throws off and what the frequencies of the look show to be biased.
"""


def write(part: str, text: str, command: str) -> None:
    """Put a part into the page, and leave the others as they are."""
    page = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    PAGE.write_text(replaced(page, part, text, command), encoding="utf-8")


def replaced(page: str, part: str, text: str, command: str) -> str:
    """Return a page with another text of one part; parts keep their order."""
    parts = dict(re.findall(r"<!-- (\w+) -->\n(.*?)(?=<!-- \w+ -->\n|\Z)", page, re.DOTALL))
    measured = f"Written by `{command}` on\n{machine()}."
    parts[part] = f"## {PARTS[part]}\n\n{measured}\n\n{text}\n\n"
    known = [f"<!-- {name} -->\n{parts[name]}" for name in PARTS if name in parts]
    return f"{_HEAD}\n{''.join(known)}".rstrip() + "\n"
