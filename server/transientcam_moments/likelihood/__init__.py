"""Few-parameter likelihood estimates of returns, from moments whose noise is known."""

from transientcam_moments.likelihood.estimate import Likelihood, likelihood

__all__ = ["Likelihood", "likelihood"]
