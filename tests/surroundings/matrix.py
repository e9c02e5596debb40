"""All cells of the matrix of one verb, and the table of all verbs."""

from collections import Counter
from collections.abc import Iterator

from tests.surroundings.surroundings import ALL, NUMBERS, TEXTS
from tests.surroundings.verbs import Ran, Verb, ran

Cell = tuple[str, str, Ran, str | None]
"""A surrounding, what was given where, the run, and what is wrong with it."""


def cells(verb: Verb) -> Iterator[Cell]:
    """Run a verb with every text and number in every place, and in every surrounding."""
    for kind, text in TEXTS.items():
        for place, words in verb.given(text):
            done = ran(words)
            yield f"text: {kind}", place, done, done.problem(text)
    for number in NUMBERS:
        for place, words in verb.given(number, number=True):
            done = ran(words)
            yield f"number: {number}", place, done, done.problem(number)
    for surrounding in ALL:
        with surrounding.enter():
            done = ran([*verb.words, *verb.usual], **surrounding.streams)
        yield surrounding.name, "as usual", done, done.problem()


def table(verbs: list[Verb]) -> str:
    """Return the matrix in Markdown: runs, and how they ended, by surrounding."""
    counts: dict[str, Counter[str]] = {}
    for verb in verbs:
        for name, _, done, problem in cells(verb):
            ended = "wrong" if problem else ("done", "refused", "usage")[done.code]
            counts.setdefault(name, Counter())[ended] += 1
    rows = [
        f"| {name} | {count.total()} | "
        + " | ".join(str(count[each]) for each in ("done", "refused", "usage", "wrong"))
        + " |"
        for name, count in counts.items()
    ]
    head = "| surrounding | runs | done | refused with a reason | wrong usage | faults |"
    return "\n".join([head, "|---|---:|---:|---:|---:|---:|", *rows])
