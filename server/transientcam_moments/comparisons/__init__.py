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
    _coded as coded,
    _dorrington as dorrington,
    _frequency_domain as frequency_domain,
    _godbaz as godbaz,
    _high_frequency as high_frequency,
    _inverse_fourier as inverse_fourier,
    _logarithmic as logarithmic,
    _matching_pursuit as matching_pursuit,
    _matrix_pencil as matrix_pencil,
    _own as own,
    _regularised as regularised,
    _single_frequency as single_frequency,
    _spumic as spumic,
    _sra as sra,
    _sra_table as sra_table,
)
from transientcam_moments.comparisons._coded import Code, equal_shifts_rad, maximum_length_code
from transientcam_moments.comparisons._estimate import (
    Estimate,
    GridEstimate,
    LikelihoodEstimate,
    MaximumEntropyEstimate,
    SparseEstimate,
    grid_rad,
)
from transientcam_moments.comparisons._pixels import check_order
from transientcam_moments.comparisons._technique import Technique

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
    "Code",
    "Estimate",
    "GridEstimate",
    "LikelihoodEstimate",
    "MaximumEntropyEstimate",
    "SparseEstimate",
    "Technique",
    "check_order",
    "coded",
    "equal_shifts_rad",
    "grid_rad",
    "maximum_length_code",
]
