"""Your own measurement. ``marimo edit notebooks/your_own_measurement.py``."""

import marimo

app = marimo.App(width="medium", app_title="Your own measurement")


@app.cell
def _():
    import tempfile
    from pathlib import Path

    import marimo as mo
    import numpy as np

    import transientcam
    import transientcam_moments as tm
    from transientcam_server import offline

    return Path, mo, np, offline, tempfile, tm, transientcam


@app.cell
def _(mo):
    mo.md("""
    # Your own measurement

    Put the path of your file here. It may be an `.npz` (moments, photon counts, or what
    mitransient renders), or an HDF5 file of tal; [these](https://github.com/diegoroyo/tal) are
    impulse responses, which are measured as this camera would. Without a file, a small one is
    made: a slanted wall, and a mirror that shows it once more, 1.2 m behind.
    """)
    return


@app.cell
def _():
    path = None
    frequency_hz, harmonics = 23e6, 8
    return frequency_hz, harmonics, path


@app.cell
def _(Path, np, path, tempfile):
    if path is None:
        bin_m = 0.02
        way_m = np.add.outer(np.linspace(2.0, 3.0, 30), np.linspace(0.0, 1.0, 40))
        bins = np.arange(400)
        transient = np.zeros((30, 40, bins.size))
        for _later_m, _weight in ((0.0, 1.0), (2.4, 0.4)):
            _at = np.rint((way_m + _later_m) / bin_m - 0.5).astype(int)
            np.put_along_axis(transient, _at[..., np.newaxis], _weight, axis=2)
        file = Path(tempfile.mkdtemp()) / "slanted.npz"
        np.savez(file, transient=transient, start_opl=0.0, bin_width_opl=bin_m)
    else:
        file = Path(path)
    return (file,)


@app.cell
def _(file, frequency_hz, harmonics, offline, tm):
    measurement = offline.load_measurement(file, frequency_hz=frequency_hz, harmonics=harmonics)
    moments, _ = tm.bias(measurement.moments)
    result = tm.separate(tm.pisarenko(moments))
    range_m = tm.range_m(result.phase_rad, measurement.base_frequency_hz)
    return measurement, moments, range_m


@app.cell
def _(measurement, moments, tm, transientcam):
    transientcam.player(
        tm.levinson(moments), base_frequency_hz=measurement.base_frequency_hz, time_s=10e-9
    )
    return


@app.cell
def _(mo):
    mo.md("""
    ## A recording

    Recordings of this service open frame by frame, and so does what `transientcam import-kinect2
    FILE.h5 -o recording.h5` makes of raw frames of a Kinect v2. Such a path goes here.
    """)
    return


@app.cell
def _():
    recording_path = None
    return (recording_path,)


@app.cell
def _(recording_path, transientcam):
    recording = None if recording_path is None else transientcam.open(recording_path)
    first_range = None if recording is None else recording[0].product("range")
    first_range
    return first_range, recording


if __name__ == "__main__":
    app.run()
