"""The paper's own estimates in the form of the others (Sec. 3.2 and 5.1)."""

from transientcam_moments.arrays import Array
from transientcam_moments.comparisons._estimate import (
    LikelihoodEstimate,
    MaximumEntropyEstimate,
    SparseEstimate,
)
from transientcam_moments.comparisons._technique import TEXTS, Technique, from_first, from_zeroth
from transientcam_moments.likelihood import likelihood, merge_returns
from transientcam_moments.moment_problem import levinson, pisarenko


def maximum_entropy_estimate(b: Array) -> MaximumEntropyEstimate:
    """Estimate the density of least Burg entropy with the moments (m + 1, ...), b_0 included.

    Noisy moments have to be biased before: see `transientcam_moments.bias`.
    """
    return MaximumEntropyEstimate(levinson(b))


def pisarenko_estimate(b: Array) -> SparseEstimate:
    """Estimate at most m returns and a uniform part from moments (m + 1, ...).

    The returns do not depend on b_0, which only says how strong the uniform part is.
    """
    found = pisarenko(b)
    return SparseEstimate(found.phase_rad, found.weight, found.uniform)


def merged_estimate(b: Array) -> SparseEstimate:
    """Estimate as `pisarenko_estimate`, and merge returns that noise split.

    Their noise is not known here: it is what `transientcam_moments.likelihood` assumes.
    """
    merged = merge_returns(pisarenko(b))
    return SparseEstimate(merged.phase_rad, merged.weight, merged.uniform)


def likelihood_estimate(b: Array) -> LikelihoodEstimate:
    """Estimate one to three returns, or one with a tail, from moments (m + 1, ...), b_0 included.

    Their noise is not known here: see `transientcam_moments.likelihood` for what it assumes.
    """
    return LikelihoodEstimate(likelihood(b))


MAXIMUM_ENTROPY = Technique(
    **TEXTS["maximum-entropy"],
    harmonics=from_zeroth,
    least_harmonics=1,
    estimate=maximum_entropy_estimate,
)

PISARENKO = Technique(
    **TEXTS["pisarenko"], harmonics=from_first, least_harmonics=1, estimate=pisarenko_estimate
)

MERGED = Technique(
    **TEXTS["pisarenko-merged"], harmonics=from_zeroth, least_harmonics=1, estimate=merged_estimate
)

LIKELIHOOD = Technique(
    **TEXTS["likelihood"], harmonics=from_zeroth, least_harmonics=1, estimate=likelihood_estimate
)
