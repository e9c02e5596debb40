"""Few-parameter likelihood estimates of returns, from moments whose noise is known."""

from transientcam_moments.likelihood import (
    _choice as choice,
    _linear as linear,
    _pair_fit as pair_fit,
    _planar as planar,
    _scaled as scaled,
    _sharp as sharp,
    _start as start,
    _tail as tail,
)
from transientcam_moments.likelihood._chi_square import SIGNIFICANCE, ambiguous, chi_square_quantile
from transientcam_moments.likelihood._choice import MOST_RETURNS
from transientcam_moments.likelihood._estimate import (
    CORRECTED_ERROR,
    MODEL_ERROR,
    Likelihood,
    fitted,
    likelihood,
    places_of,
)
from transientcam_moments.likelihood._merging import merge_returns
from transientcam_moments.likelihood._pairs import (
    COINCIDE,
    FINALISTS,
    FIRST_STEPS,
    LAST_STEPS,
    LEAST_GAIN,
    PEAKS,
    STARTS,
    fitted_pairs,
    grid,
    least_alike,
    two_returns,
)
from transientcam_moments.likelihood._unwrapping import Unwrapped, unwrap
