"""Plan a sequence by the accuracy that is needed. ``marimo edit notebooks/plan_by_accuracy.py``."""

import marimo

app = marimo.App(width="medium", app_title="Plan by accuracy")


@app.cell
def _():
    import marimo as mo
    import matplotlib.pyplot as plt

    import transientcam

    return mo, plt, transientcam


@app.cell
def _(mo):
    mo.md("""
    # Plan by accuracy

    You say how accurate the range has to be. The service looks at the scene in front of the
    camera, and returns the sequence that reaches it in the least time. Nothing is changed until
    you set that sequence.
    """)
    return


@app.cell
def _(mo):
    url = mo.cli_args().get("url") or "http://127.0.0.1:8000"
    return (url,)


@app.cell
def _():
    # in m, noise and bias together; and what the plan may not change
    targets_m = (0.02, 0.01, 0.005)
    restrictions = {}
    return restrictions, targets_m


@app.cell
def _(restrictions, targets_m, transientcam, url):
    plans = {}
    with transientcam.Camera(url, timeout_s=300.0) as camera:
        present = camera.sequence
        for _target_m in targets_m:
            try:
                plans[_target_m] = camera.plan({"range_error_m": _target_m}, **restrictions)
            except transientcam.ProblemError as problem:
                plans[_target_m] = problem.document
    return plans, present


@app.cell
def _(mo, plans):
    mo.ui.table(
        [
            {
                "target in mm": 1e3 * target_m,
                "capture in ms": round(1e3 * plan["capture_s"], 1) if "capture_s" in plan else None,
                "harmonics": plan.get("sequence", {}).get("harmonics"),
                "takes": plan.get("sequence", {}).get("takes"),
                "estimator": plan.get("estimator"),
                "in words": plan.get("summary") or plan.get("detail"),
            }
            for target_m, plan in plans.items()
        ],
        selection=None,
    )
    return


@app.cell
def _(mo):
    mo.md("""
    ## What accuracy costs

    Time buys accuracy. The grey line is the sequence that is set now.
    """)
    return


@app.cell
def _(plans, plt, present):
    reached = {target_m: plan for target_m, plan in plans.items() if "capture_s" in plan}
    figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
    axes.loglog(
        [1e3 * plan["capture_s"] for plan in reached.values()],
        [1e3 * plan["predicted"]["range_error_m"]["median"] for plan in reached.values()],
        marker="o",
    )
    axes.axvline(1e3 * present["capture_s"], color="grey")
    axes.set(xlabel="time of a capture in ms", ylabel="predicted range error in mm")
    figure
    return


@app.cell
def _(mo):
    mo.md("""
    `camera.sequence = plans[0.01]["sequence"]` sets one.
    """)
    return


if __name__ == "__main__":
    app.run()
