"""From moments to light: the trigonometric moment problem and its two solutions.

Levinson's recursion, biasing, maximum entropy and Pisarenko's estimate (sections 3 and 4 of the
paper), with the bounds on what moments leave open.
"""

from transientcam_moments.moment_problem import (
    _circle as circle,
    _cumulative as integrals,
    _eigenvalue as eigenvalue,
    _evaluation as evaluation,
    _extension as extension,
    _maxima as maxima,
    _sorting as sorting,
    _sparse as sparse,
    _toeplitz as toeplitz,
)
from transientcam_moments.moment_problem._biasing import (
    EPSILON,
    Biased,
    bias,
    estimate_zeroth,
    smallest_eigenvalue,
)
from transientcam_moments.moment_problem._bounds import bounds, smoothed_density
from transientcam_moments.moment_problem._circle import half_turns, phase_of
from transientcam_moments.moment_problem._cumulative import cumulative
from transientcam_moments.moment_problem._levinson import (
    Coefficients,
    extend,
    from_reflection,
    levinson,
    moments_of,
)
from transientcam_moments.moment_problem._maximum_entropy import density
from transientcam_moments.moment_problem._peaks import Peaks, peaks
from transientcam_moments.moment_problem._pisarenko import (
    DIRECT_THRESHOLD,
    Returns,
    Separation,
    first_returns,
    pisarenko,
    redo,
    separate,
)
