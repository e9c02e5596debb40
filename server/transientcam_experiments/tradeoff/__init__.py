"""What accuracy costs: in time to capture, in time to compute, and in bytes to send.

Measured on simulated scenes, whose truth is known, by the same stages that the daemon runs, from
images that come over the emulated USB. `measure` goes through a `Grid` point by point and writes
each result into the output folder before it begins the next; `report` makes tables, plots and a
page of the results so far.
"""

from transientcam_experiments.tradeoff.comparing import SCENES, Compared, compare, draw, rivals
from transientcam_experiments.tradeoff.grid import Grid, load_grid
from transientcam_experiments.tradeoff.measuring import Point, camera_before, measure, points_of
from transientcam_experiments.tradeoff.page import file_name, report
from transientcam_experiments.tradeoff.records import Record, Records
