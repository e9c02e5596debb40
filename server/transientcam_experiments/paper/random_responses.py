"""What the paper says of the continuous case in Figure 11, and whether it holds for others, too.

The paper shows one response whose parameters it does not print; a statement about a technique may
hold for one response and not for the next.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from transientcam_experiments.paper.bench import Bench
from transientcam_experiments.paper.contenders import CONTENDERS, PRINTED
from transientcam_experiments.paper.figure import Statement, Table, state
from transientcam_experiments.paper.outcome import Outcome, outcome
from transientcam_experiments.paper.synthetic import Response, Return

_Outcomes = Mapping[str, Outcome]
_Study = list[tuple[Response, dict[str, Outcome]]]
_LEAST_APART_S: Final = 5e-9
_NAMES: Final = {"godbaz": "The Dirac-δ model", "spumic": "SPUMIC"}


@dataclass(frozen=True, slots=True)
class Claim:
    """A sentence about a continuous response, and what to measure: of it, and of the sparse one."""

    key: str
    """Of the sentence in ``figures.toml``."""
    value: Callable[[Response, _Outcomes, _Outcomes], float]
    label: str = ""
    """Of the technique that it is about, where there are several."""

    def statement(
        self, response: Response, found: _Outcomes, sparse: _Outcomes, *, otherwise: str = ""
    ) -> Statement:
        """Hold it against what techniques found."""
        value = self.value(response, found, sparse)
        return state(self.key, value, otherwise=otherwise, label=self.label)


def valleys_s(response: Response) -> list[float]:
    """Return times after each return: just before the next, and at 38 ns."""
    before = [each.delay_s - 4 * each.width_s for each in response.returns[1:]]
    return [*before, 38e-9]


def _first(name: str) -> Callable[[Response, _Outcomes, _Outcomes], float]:
    return lambda response, found, _: found[name].error_at(valleys_s(response)[0])


def _rest(name: str) -> Callable[[Response, _Outcomes, _Outcomes], float]:
    return lambda response, found, _: max(
        found[name].error_at(time_s) for time_s in valleys_s(response)[1:]
    )


def _sensitive(name: str) -> Callable[[Response, _Outcomes, _Outcomes], float]:
    return lambda _, found, sparse: found[name].spread / sparse[name].spread


def _third(response: Response, found: _Outcomes, sparse: _Outcomes) -> float:
    sra = found["sra"]
    before, end = (sra.clean[sra.at(time_s)] for time_s in valleys_s(response)[1:])
    return float((end - before) * response.brightness / response.returns[2].weight)


def _in_valleys(response: Response, found: _Outcomes, sparse: _Outcomes) -> float:
    maximum = found["maximum-entropy"]
    between = [maximum.noisy[maximum.at(time_s)].std() for time_s in valleys_s(response)]
    return float(np.mean(between)) / maximum.spread


CLAIMS: Final = (
    *(
        claim
        for name, label in _NAMES.items()
        for claim in (
            Claim("11.first", _first(name), label),
            Claim("11.rest", _rest(name), label),
            Claim("11.more_sensitive", _sensitive(name), label),
        )
    ),
    Claim("11.sra_darker", lambda _, found, sparse: float(found["sra"].clean[-1])),
    Claim("11.sra_third", _third),
    Claim("11.sra_noise", lambda _, found, sparse: found["sra"].spread / found["pisarenko"].spread),
    Claim(
        "11.pisarenko_better",
        lambda _, found, sparse: found["pisarenko"].clean_error / found["sra"].clean_error,
    ),
    Claim("11.entropy_adequate", lambda _, found, sparse: found["maximum-entropy"].clean_error),
    Claim("11.entropy_noise", _in_valleys),
)
"""What the paper says of the continuous case."""


def drawn(rng: np.random.Generator) -> Response:
    """Return three exponentially modified Gaussians, drawn as the paper's may have been."""
    delays = np.sort(rng.uniform(4e-9, 26e-9, 3))
    while np.diff(delays).min() < _LEAST_APART_S:
        delays = np.sort(rng.uniform(4e-9, 26e-9, 3))
    weights = rng.uniform(0.2, 1.0, 3)
    widths, decays = rng.uniform(0.1e-9, 0.5e-9, 3), rng.uniform(0.2e-9, 1.5e-9, 3)
    each = zip(delays.tolist(), weights.tolist(), widths.tolist(), decays.tolist(), strict=True)
    return Response("random", tuple(Return(*values) for values in each))


def study(bench: Bench, sparse: _Outcomes) -> _Study:
    """Reconstruct many random responses by the techniques that the paper shows."""
    rng = np.random.default_rng([bench.seed, 11])
    contenders = [each for each in CONTENDERS if each.name in PRINTED]
    found = []
    for _ in range(bench.few(60, 4)):
        response = drawn(rng)
        outcomes = {
            each.name: outcome(each, response, draws=bench.few(12, 3), rng=rng)
            for each in contenders
        }
        found.append((response, outcomes))
    return found


def _share(claim: Claim, others: _Study, sparse: _Outcomes) -> float:
    """Return in what share of random responses a claim holds."""
    held = [claim.statement(response, found, sparse).passes for response, found in others]
    return float(np.mean(held))


def statements(
    response: Response, found: _Outcomes, sparse: _Outcomes, others: _Study
) -> list[Statement]:
    """Check all claims on one response; where one fails, add how it does on the others."""
    return [
        claim.statement(
            response,
            found,
            sparse,
            otherwise="it depends on the response: of random ones of this kind it holds in "
            f"{_share(claim, others, sparse):.0%}",
        )
        for claim in CLAIMS
    ]


def tables(others: _Study, sparse: _Outcomes) -> tuple[Table, Table]:
    """Return how often each claim holds, and each technique's mean errors."""
    rows: list[tuple[Any, ...]] = [
        (claim.statement(*others[0], sparse).says, 100 * _share(claim, others, sparse))
        for claim in CLAIMS
    ]
    labels = {each.name: each.label for each in CONTENDERS}
    errors = [
        (
            labels[name],
            *(
                100 * float(np.mean([getattr(found[name], what) for _, found in others]))
                for what in ("clean_error", "noisy_error", "spread")
            ),
        )
        for name in PRINTED
    ]
    kind = f"{len(others)} random responses of three exponentially modified Gaussians"
    columns = ("technique", "noise-free", "70 : 1", "deviation at 70 : 1")
    return (
        Table(f"In how many of {kind} a statement holds", ("statement", "%"), rows),
        Table(f"Mean error of the cumulative density over {kind}, in % of b_0", columns, errors),
    )
