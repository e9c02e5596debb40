"""The techniques that the paper is compared with, and its own, in one form.

Each takes moments (m + 1, ...), one of them samples of a code, and gives an `Estimate`: returns or
a density, with the cumulative response and the phase of the first return. All compute in double
precision with NumPy. ::

    from transientcam_moments import comparisons

    for technique in comparisons.TECHNIQUES.values():
        print(technique.label, technique.estimate(b).cumulative(phase_rad))

"After ..." in a label says that the technique follows what is known of a publication whose text
was not at hand; no label claims to be the authors' implementation.
"""

from transientcam_moments.comparisons import (
    coded,
    dorrington,
    frequency_domain,
    godbaz,
    high_frequency,
    inverse_fourier,
    logarithmic,
    matching_pursuit,
    matrix_pencil,
    own,
    regularised,
    single_frequency,
    spumic,
    sra,
    sra_table,
)
from transientcam_moments.comparisons._pixels import check_order
from transientcam_moments.comparisons.estimate import (
    Estimate,
    GridEstimate,
    LikelihoodEstimate,
    MaximumEntropyEstimate,
    SparseEstimate,
    grid_rad,
)
from transientcam_moments.comparisons.technique import Technique

TECHNIQUES: dict[str, Technique] = {
    technique.name: technique
    for technique in (
        own.MAXIMUM_ENTROPY,
        own.PISARENKO,
        own.LIKELIHOOD,
        own.MERGED,
        single_frequency.TECHNIQUE,
        inverse_fourier.TECHNIQUE,
        godbaz.TECHNIQUE,
        spumic.TECHNIQUE,
        sra.TECHNIQUE,
        sra_table.TECHNIQUE,
        matrix_pencil.TECHNIQUE,
        matching_pursuit.TECHNIQUE,
        dorrington.TECHNIQUE,
        regularised.TECHNIQUE,
        coded.TECHNIQUE,
        frequency_domain.TECHNIQUE,
        logarithmic.TECHNIQUE,
        high_frequency.TECHNIQUE,
    )
}
"""Every technique by its name; the paper's first."""

__all__ = [
    "TECHNIQUES",
    "Estimate",
    "GridEstimate",
    "LikelihoodEstimate",
    "MaximumEntropyEstimate",
    "SparseEstimate",
    "Technique",
    "check_order",
    "grid_rad",
]
