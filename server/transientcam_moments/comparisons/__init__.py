"""The techniques that the paper is compared with, and its own, in one form.

Each takes moments (m + 1, ...), one of them samples of a code, and gives an `Estimate`: returns or
a density, with the cumulative response and the phase of the first return. With fewer moments than
it needs, or an option out of its range, it raises a `ParameterError`. All compute in double
precision with NumPy. ::

    from transientcam_moments import comparisons

    for technique in comparisons.TECHNIQUES.values():
        print(technique.label, technique.estimate(b).cumulative(phase_rad))

`transientcam_moments.comparisons.technique_of` also finds those of other packages, entries of the
group ``transientcam.estimators`` (docs/add-an-estimator.md).

"After ..." in a label says that the technique follows what is known of a publication whose text
was not at hand; no label claims to be the authors' implementation.
"""

from transientcam_moments.comparisons import (
    _coded,
    _dorrington,
    _frequency_domain,
    _godbaz,
    _inverse_fourier,
    _logarithmic,
    _matching_pursuit,
    _matrix_pencil,
    _own,
    _regularised,
    _single_frequency,
    _spumic,
    _sra,
    _sra_table,
)
from transientcam_moments.comparisons._coded import (
    Code,
    coded,
    equal_shifts_rad,
    maximum_length_code,
)
from transientcam_moments.comparisons._estimate import (
    Estimate,
    GridEstimate,
    LikelihoodEstimate,
    MaximumEntropyEstimate,
    SparseEstimate,
    grid_rad,
)
from transientcam_moments.comparisons._pixels import check_order
from transientcam_moments.comparisons._plugins import PLUGINS, separated
from transientcam_moments.comparisons._technique import Technique, from_first, from_zeroth

TECHNIQUES: dict[str, Technique] = {
    technique.name: technique
    for technique in (
        _own.MAXIMUM_ENTROPY, _own.PISARENKO, _own.LIKELIHOOD, _own.MERGED,
        _single_frequency.SINGLE_FREQUENCY, _inverse_fourier.TECHNIQUE, _godbaz.TECHNIQUE,
        _spumic.TECHNIQUE, _sra.TECHNIQUE, _sra_table.TECHNIQUE, _matrix_pencil.TECHNIQUE,
        _matching_pursuit.TECHNIQUE, _dorrington.TECHNIQUE, _regularised.TECHNIQUE,
        _coded.TECHNIQUE, _frequency_domain.TECHNIQUE, _logarithmic.TECHNIQUE,
        _single_frequency.HIGH_FREQUENCY,
    )
}  # fmt: skip
"""Every technique by its name; the paper's first."""
PLUGINS.taken.update(("automatic", *TECHNIQUES))


def technique_of(name: str) -> Technique:
    """Return a technique, ours or another package's.

    Raises
    ------
    PluginFailed
        Where another package's cannot be used.
    KeyError
        Where there is none of that name.
    """
    return TECHNIQUES[name] if name in TECHNIQUES else PLUGINS.load(name)


__all__ = [
    "PLUGINS", "TECHNIQUES", "Code", "Estimate", "GridEstimate", "LikelihoodEstimate",
    "MaximumEntropyEstimate", "SparseEstimate", "Technique", "check_order", "coded",
    "equal_shifts_rad", "from_first", "from_zeroth", "grid_rad", "maximum_length_code", "separated",
    "technique_of",
]  # fmt: skip
