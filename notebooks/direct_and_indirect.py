"""Separate direct from indirect light. ``marimo edit notebooks/direct_and_indirect.py``."""

import marimo

app = marimo.App(width="medium", app_title="Direct and indirect light")


@app.cell
def _():
    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np

    import transientcam

    return mo, np, plt, transientcam


@app.cell
def _(mo):
    mo.md("""
    # Direct and indirect light

    Light comes back from a surface directly, and over other surfaces. What took a detour arrives
    later. An ordinary time-of-flight camera adds both up, and its corners are round; here they
    are told apart.
    """)
    return


@app.cell
def _(mo):
    url = mo.cli_args().get("url") or "http://127.0.0.1:8000"
    return (url,)


@app.cell
def _(transientcam, url):
    camera = transientcam.Camera(url)
    newest = camera.latest(wait_s=10)["frame"]
    direct, indirect, range_ = (
        camera.frame(product, number=newest) for product in ("direct", "indirect", "range")
    )
    return camera, direct, indirect, range_


@app.cell
def _(direct, indirect, mo):
    mo.hstack([direct, indirect])
    return


@app.cell
def _(mo):
    mo.md("""
    ## How much took a detour

    The share of indirect light, pixel by pixel. Where it is large, a camera with one frequency
    errs most.
    """)
    return


@app.cell
def _(direct, indirect, np):
    both = direct.array + indirect.array
    share = np.divide(indirect.array, both, out=np.full_like(both, np.nan), where=both > 0.0)
    return (share,)


@app.cell
def _(plt, share):
    share_figure, share_axes = plt.subplots(figsize=(6, 4), layout="constrained")
    picture = share_axes.imshow(share, vmin=0.0, vmax=1.0, cmap="viridis")
    share_figure.colorbar(picture, label="indirect light / (direct + indirect)")
    share_axes.set_axis_off()
    share_figure
    return


@app.cell
def _(mo):
    mo.md("""
    ## What a single frequency would have measured

    The phase of the first moment alone is the range of an ordinary camera. Its difference from
    the range of the first return is the error that indirect light makes there.
    """)
    return


@app.cell
def _(camera, np, range_):
    moments = camera.frame("moments", number=range_.frame)
    base_frequency_hz = range_.meta["base_frequency_hz"]
    period_m = 299_792_458.0 / (2.0 * base_frequency_hz)
    one_frequency_m = np.angle(moments.array[1]) % (2.0 * np.pi) / (2.0 * np.pi) * period_m
    difference_m = one_frequency_m - range_.array
    return (difference_m,)


@app.cell
def _(difference_m, np, plt):
    error_figure, error_axes = plt.subplots(figsize=(8, 3), layout="constrained")
    error_axes.hist(1e3 * difference_m[np.isfinite(difference_m)], bins=100, range=(-500.0, 2000.0))
    error_axes.set(xlabel="one frequency minus first return, in mm", ylabel="pixels")
    error_figure
    return


if __name__ == "__main__":
    app.run()
