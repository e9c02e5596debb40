"""Few-parameter likelihood estimates of returns, from moments whose noise is known."""

from transientcam_moments.likelihood.estimate import MODEL_ERROR, Likelihood, likelihood

__all__ = ["MODEL_ERROR", "Likelihood", "likelihood"]
