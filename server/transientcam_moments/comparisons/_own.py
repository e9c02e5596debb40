"""The paper's own estimates in the form of the others (Sec. 3.2 and 5.1)."""

from transientcam_moments.arrays import Array
from transientcam_moments.comparisons._estimate import (
    LikelihoodEstimate,
    MaximumEntropyEstimate,
    SparseEstimate,
)
from transientcam_moments.comparisons._technique import Technique, from_first, from_zeroth
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
    name="maximum-entropy",
    label="Peters et al. 2015, maximum entropy",
    returns="density",
    frequencies="0, f .. m f",
    harmonics=from_zeroth,
    least_harmonics=1,
    assumptions="A positive density; nothing else.",
    cost="Closed form: O(m^2) once, O(m) a phase.",
    failure="Peaks broaden and merge where m moments leave the response open; contradictory "
    "moments have to be biased before.",
    estimate=maximum_entropy_estimate,
)

PISARENKO = Technique(
    name="pisarenko",
    label="Peters et al. 2015, Pisarenko",
    returns="m",
    frequencies="f .. m f; 0 for the uniform part",
    harmonics=from_first,
    least_harmonics=1,
    assumptions="At most m sharp returns and a uniform part.",
    cost="Closed form: a smallest eigenvalue and the roots of a polynomial of degree m.",
    failure="A continuous response is made sparse: outliers in range under diffuse light.",
    estimate=pisarenko_estimate,
)

MERGED = Technique(
    name="pisarenko-merged",
    label="Pisarenko, returns that noise split merged",
    returns="m",
    frequencies="0, f .. m f",
    harmonics=from_zeroth,
    least_harmonics=1,
    assumptions="At most m sharp returns and a uniform part; the noise of the moments.",
    cost="That of Pisarenko's, and up to m - 1 rounds over m pairs of returns.",
    failure="Returns that are closer than noise can tell become one; a continuous response is made "
    "sparse.",
    estimate=merged_estimate,
)

LIKELIHOOD = Technique(
    name="likelihood",
    label="Weighted least squares of few returns, or one with a tail",
    returns="3, or 1 and a tail",
    frequencies="f .. m f; 0 helps",
    harmonics=from_zeroth,
    least_harmonics=1,
    assumptions="Few sharp returns, or one with a gamma-shaped tail; the noise of the moments.",
    cost="Up to ten fits of 4 to 10 Levenberg-Marquardt steps, in compiled kernels.",
    failure="Light of another shape biases the range; chi-square then says so where it exceeds "
    "the noise.",
    estimate=likelihood_estimate,
)
