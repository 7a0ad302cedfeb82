"""Distances of all pairs of a database."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._databases import Database, Floats
from ._metrics import Metric, try_own
from ._progress import call, text

if TYPE_CHECKING:
    import pandas  # type: ignore[import]


class Distances:
    """The distances of all pairs of N materials, P = N(N-1)/2, under one metric or more.

    names: the materials, ascending bytewise.
    metrics: the names of the metrics.
    values: by metric, an array (P,), in the order of `pairs`.
    bounds: by metric, how far each can be from the exact distance, (P,), 0 for an exact one; None
        where the numbers count as exact (of a table), infinite where nothing is known.
    provenance: where they are from: program, database with hashes and grid, metrics, engines.
    warnings: one line each.

    d["pawcielab"] is d.values["pawcielab"].
    """

    def __init__(self, names: Sequence[str], columns: Sequence[tuple[str, Floats, Optional[Floats], bool]],
                 provenance: Mapping[str, Any], database: Optional[Database] = None,
                 metrics: Sequence[str] = ()) -> None:
        self.names = list(names)
        self.metrics = [column[0] for column in columns]
        self.values = {name: values for name, values, _, _ in columns}
        self.bounds = {name: bounds for name, _, bounds, _ in columns}
        self.provenance = dict(provenance)
        self.database = database
        self._columns = list(columns)
        self._texts = list(metrics)  # what opens the metrics again; none of a table
        for _, values, bounds, _ in columns:
            values.flags.writeable = False
            if bounds is not None:
                bounds.flags.writeable = False

    @property
    def warnings(self) -> list[str]:
        return list(self.provenance.get("warnings", []))

    @property
    def pairs(self) -> npt.NDArray[np.intp]:
        """(P, 2): the places in `names` of each pair, (0, 1), (0, 2) ... (1, 2) ..."""
        return np.stack(np.triu_indices(len(self.names), 1), axis=-1)

    def __getitem__(self, metric: str) -> Floats:
        return self.values[metric]

    def __len__(self) -> int:
        """The number of pairs."""
        return len(self.names) * (len(self.names) - 1) // 2

    def matrix(self, metric: str) -> Floats:
        """(N, N), symmetric, 0 on the diagonal."""
        matrix = np.zeros((len(self.names), len(self.names)))
        matrix[np.triu_indices(len(self.names), 1)] = self.values[metric]
        return matrix + matrix.T

    def to_csv(self, file: Union[str, os.PathLike[str]]) -> None:
        """Writes what `merl-scan --distances` and read_distances() read; every number reads back the
        same. Replaces the file."""
        _core.write_distances(text("file", file), self.names, self._columns)

    def to_pandas(self) -> pandas.DataFrame:
        """A row a pair: material_1, material_2, and a column a metric. Needs pandas."""
        import pandas

        names = np.array(self.names, dtype=object)
        first, second = self.pairs.T
        return pandas.DataFrame({"material_1": names[first], "material_2": names[second], **self.values})

    def __repr__(self) -> str:
        return (f"<merl_scan.Distances: {len(self)} pairs of {len(self.names)} materials under "
                f"{', '.join(self.metrics)}>")

    def _chosen(self, metrics: Sequence[str]) -> tuple[list[Any], Optional[_core.Database], list[_core.Metric]]:
        """Columns, database and metrics for what is computed of some of the metrics."""
        for name in metrics:
            if name not in self.metrics:
                raise _core.UsageError(f'found no distances under "{name}"; expected one of '
                                       + ", ".join(self.metrics))
        places = [self.metrics.index(name) for name in metrics]
        columns = [self._columns[place] for place in places]
        if self.database is None:
            return columns, None, []
        if self.database._may_change and self.database.content_hash() != self.provenance["database"]["content_hash"]:
            raise _core.InputError(f"{self.database.name}: arrays have changed since distances were computed; "
                                   "compute them again, or give Database.from_arrays() copy=True")
        return columns, self.database._core, [_core.Metric(self._texts[place]) for place in places]


def distances(database: Database, metrics: Union[str, Metric, Sequence[Union[str, Metric]]] = ("cwcbrt", "pawcielab"), *,
              device: str = "", memory: Union[str, int] = "1G", threads: int = 0) -> Distances:
    """The distances of all pairs, each material read once.

    metrics: names as `merl-scan --metrics` has them, "all" for the library, or Metric objects.
    device: "host" (this processor), or a Vulkan device by number or part of its name; without, a GPU
        if there is one, otherwise the host.
    memory: a bound on what is read and computed.
    threads: of the processor; 0: all.

    float32 with a bound on the error of each, or float64 with a bound of 0, as in pairs.csv; scan()
    and score() compute those again in float64 that they cannot decide otherwise.

    Raises InputError for samples that cannot be used and for less than two materials, UsageError for
    unknown metrics and too little memory, DeviceError where a metric of one's own finds no device.
    """
    if not isinstance(database, Database):
        raise TypeError(f"database: found {type(database).__name__}; expected a Database")
    if isinstance(metrics, (str, Metric)):
        metrics = [metrics]
    texts = [metric._core.text if isinstance(metric, Metric) else text("metric", metric) for metric in metrics]
    if not texts:
        raise _core.UsageError("metrics: found none; expected one or more")
    handles, left_out = _core.open_metrics(texts, database._core)
    try_own(handles, text("device", device))
    result = _core.distances(database._core, handles, call(device, memory, threads))
    provenance = {**result["provenance"], "left_out": left_out}
    return Distances(result["names"], result["columns"], provenance, database, [handle.text for handle in handles])


def read_distances(file: Union[str, os.PathLike[str]], metrics: Sequence[str] = ()) -> Distances:
    """Distances from a CSV file, as `merl-scan --distances` reads them: material_1, material_2 and a
    column a metric, or a square matrix. Its numbers count as exact.

    metrics: only these columns.

    Raises InputError for a file that cannot be used.
    """
    columns = [metrics] if isinstance(metrics, str) else list(metrics)
    result = _core.read_distances(text("file", file), columns, call())
    return Distances(result["names"], result["columns"], result["provenance"])
