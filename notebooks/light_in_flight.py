"""Light in flight from a live camera. ``marimo edit notebooks/light_in_flight.py``."""

import marimo

app = marimo.App(width="medium", app_title="Light in flight")


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
    # Light in flight

    A lidar with modulated light measures a few numbers for every pixel. They suffice to say when
    light arrived there, to a fraction of a nanosecond. First start a camera; a simulated one will
    do: `transientcam serve`.
    """)
    return


@app.cell
def _(mo):
    url = mo.cli_args().get("url") or "http://127.0.0.1:8000"
    return (url,)


@app.cell
def _(transientcam, url):
    camera = transientcam.Camera(url)
    camera.latest(wait_s=10)
    camera
    return (camera,)


@app.cell
def _(mo):
    mo.md("""
    ## Scrub through it

    What the player shows is computed in the browser, from seven numbers a pixel. Press *Play*, or
    drag the slider.
    """)
    return


@app.cell
def _(camera, transientcam):
    transientcam.player(camera, time_s=10e-9)
    return


@app.cell
def _(mo):
    mo.md("""
    ## One pixel

    The same numbers, for one pixel: when light arrives there, and how much. The dashed line is
    the range of the first return, as the service computes it.
    """)
    return


@app.cell
def _():
    column, row = 80, 60
    return column, row


@app.cell
def _(camera, column, np, row, transientcam):
    coefficients = camera.frame("coefficients")
    base_frequency_hz = coefficients.meta["base_frequency_hz"]
    time_s = np.linspace(0.0, 1.0 / base_frequency_hz, 500, endpoint=False)
    response = transientcam.transient(
        coefficients.array[:, row, column], time_s, base_frequency_hz=base_frequency_hz
    )
    range_m = float(camera.frame("range", number=coefficients.frame).array[row, column])
    return range_m, response, time_s


@app.cell
def _(column, plt, range_m, response, row, time_s):
    figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
    axes.plot(1e9 * time_s, 1e-9 * response)
    axes.axvline(1e9 * 2.0 * range_m / 299_792_458.0, linestyle="--", color="grey")
    axes.set(
        title=f"Pixel ({column}, {row}): first return at {range_m:.2f} m",
        xlabel="time of flight in ns",
        ylabel="light in DN per ns",
    )
    figure
    return


if __name__ == "__main__":
    app.run()
