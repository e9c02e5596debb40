"""Compiled lanes for the hot algorithms: what is ready, and how to make it ready."""

from transientcam_moments._kernels import registry


def state() -> dict[str, object]:
    """Return what is compiled: ``enabled``, ``compiled``, ``compiling``, ``failed``."""
    return {
        "enabled": True,
        "compiled": [f"{name} m={m} {p}" for name, m, p in sorted(registry.compiled)],
        "compiling": None,
        "failed": [],
    }
