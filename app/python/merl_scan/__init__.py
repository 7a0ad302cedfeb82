"""merl-scan from Python: distances between measured BRDFs, and where metrics disagree.

    import merl_scan as ms

    db = ms.Database.from_arrays({"a": f_a, "b": f_b, "c": f_c})
    d = ms.distances(db, ["cwcbrt", "pawcielab"])
    d["pawcielab"], d.matrix("pawcielab")
    ms.scan(d, "cwcbrt", "pawcielab").counts

A BRDF is an array of shape (theta_h, theta_d, phi_d, 3) in 1/sr, red, green and blue, on the grid
of MERL (Matusik et al. 2003) or one of other sizes; grid() has the angles of its voxels. What is NaN
or negative was not measured.

Errors are Error and the classes below it, with the text that the command line would print. Calls let
other threads of Python run, hear Ctrl-C, and may come from several threads. Importing the package
does nothing but that: no thread, no device, no signal handler, no output.
"""

from ._core import (
    DeviceError,
    Error,
    InputError,
    OutputError,
    ResourceError,
    UsageError,
    __version__,
)
from ._databases import Database, Grid, Material, grid, open
from ._distances import Distances, distances, read_distances
from ._metrics import Metric, distance, metrics
from ._progress import progress
from ._scan import Scan, scan
from ._score import Figure, Judgements, MetricScore, PairScore, Score, read_judgements, score
from ._spheres import render

__all__ = [
    "Database",
    "DeviceError",
    "Distances",
    "Error",
    "Figure",
    "Grid",
    "InputError",
    "Judgements",
    "Material",
    "Metric",
    "MetricScore",
    "OutputError",
    "PairScore",
    "ResourceError",
    "Scan",
    "Score",
    "UsageError",
    "__version__",
    "distance",
    "distances",
    "grid",
    "metrics",
    "open",
    "progress",
    "read_distances",
    "read_judgements",
    "render",
    "scan",
    "score",
]
