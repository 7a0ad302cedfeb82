"""Where two metrics disagree about which pair is more alike."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._databases import Floats
from ._distances import Distances
from ._progress import call, whole

if TYPE_CHECKING:
    import pandas  # type: ignore[import]

#: Of `disagreements` and `selection`: four materials as places in `names`, their distances, and how
#: far the metrics agree, from 0 to 1.
CONFIGURATION = np.dtype([
    ("left_1", np.uint32), ("left_2", np.uint32), ("right_1", np.uint32), ("right_2", np.uint32),
    ("first_left", np.float64), ("first_right", np.float64),
    ("second_left", np.float64), ("second_right", np.float64), ("agreement", np.float64),
])


@dataclasses.dataclass(frozen=True)
class Scan:
    """What `merl-scan scan` finds.

    names: the materials.
    first, second: the metrics.
    counts: of configurations: configurations, disagreements, rate, discordant, tied_first_only,
        tied_second_only, tied_both.
    disagreements: the strongest first, of type CONFIGURATION. The left pair is the more alike under
        the first metric.
    selection: those for people to judge, likewise.
    values, bounds: by metric, (P,), after what was open was computed again in float64.
    refined: how many distances that were, under each metric.
    exact: whether nothing is left open; undecided: how many configurations are.
    """

    names: list[str]
    first: str
    second: str
    counts: dict[str, Any]
    disagreements: npt.NDArray[np.void] = dataclasses.field(repr=False)
    selection: npt.NDArray[np.void] = dataclasses.field(repr=False)
    values: dict[str, Floats] = dataclasses.field(repr=False)
    bounds: dict[str, Optional[Floats]] = dataclasses.field(repr=False)
    refined: tuple[int, int]
    exact: bool
    undecided: int

    def to_pandas(self, table: str = "disagreements") -> pandas.DataFrame:
        """`disagreements` or `selection` with names, in the columns of the CSV files. Needs pandas."""
        import pandas

        if table not in ("disagreements", "selection"):
            raise ValueError(f"table: found {table!r}; expected disagreements or selection")
        rows = getattr(self, table)
        names = np.array(self.names, dtype=object)
        columns = {side: names[rows[side]] for side in ("left_1", "left_2", "right_1", "right_2")}
        for field, metric in (("first", self.first), ("second", self.second)):
            for side in ("left", "right"):
                columns[f"{metric}_{side}"] = rows[f"{field}_{side}"]
        return pandas.DataFrame({**columns, "agreement": rows["agreement"]})

    def __repr__(self) -> str:
        c = self.counts
        return (f"<merl_scan.Scan of {self.first} and {self.second}: {c['disagreements']:,} disagreements "
                f"among {c['configurations']:,} configurations ({c['rate']:.2%})>")


def _configurations(pairs: npt.NDArray[np.intp], first: Floats, second: Floats, found: Any) -> npt.NDArray[np.void]:
    left, right, agreement = found
    rows = np.empty(len(left), CONFIGURATION)
    for side, place in (("left", left), ("right", right)):
        rows[f"{side}_1"], rows[f"{side}_2"] = pairs[place].T
        rows[f"first_{side}"] = first[place]
        rows[f"second_{side}"] = second[place]
    rows["agreement"] = agreement
    return rows


def scan(distances: Distances, first: Optional[str] = None, second: Optional[str] = None, *, select: int = 100,
         per_material: int = 10, disagreements: Optional[int] = 1000, fast: bool = False,
         memory: Union[str, int] = "1G", threads: int = 0) -> Scan:
    """Where two metrics disagree (Ryman 2018, 4.11): as `merl-scan scan`, with its very numbers.

    first, second: metrics of the distances; without, the first two.
    select: so many configurations are selected for people, per_material of which a material may take
        part in.
    disagreements: so many are listed, the strongest; None: all, which may be millions.
    fast: do not compute in float64 what float32 leaves open.

    Raises UsageError for a metric that is not there, InputError where samples can no longer be read
    or have changed.
    """
    if not isinstance(distances, Distances):
        raise TypeError(f"distances: found {type(distances).__name__}; expected Distances")
    both = [first if first is not None else _metric(distances, 0), second if second is not None else _metric(distances, 1)]
    select, per_material = whole("select", select, 0, 2**32 - 1), whole("per_material", per_material, 0, 2**32 - 1)
    if disagreements is not None:
        disagreements = whole("disagreements", disagreements, 0, 2**32 - 1)
    columns, database, metrics = distances._chosen(both)
    result = _core.scan(distances.names, columns, database, metrics, select, per_material, disagreements, bool(fast),
                        call("", memory, threads))
    pairs = distances.pairs
    values = {name: numbers for name, numbers, _, _ in result["columns"]}
    return Scan(
        names=distances.names, first=both[0], second=both[1], counts=result["counts"],
        disagreements=_configurations(pairs, values[both[0]], values[both[1]], result["disagreements"]),
        selection=_configurations(pairs, values[both[0]], values[both[1]], result["selection"]),
        values=values, bounds={name: bounds for name, _, bounds, _ in result["columns"]},
        refined=result["refined"], exact=result["exact"], undecided=result["undecided"])


def _metric(distances: Distances, place: int) -> str:
    if len(distances.metrics) <= place:
        raise _core.UsageError(f"found distances under {', '.join(distances.metrics)}; expected two metrics")
    return distances.metrics[place]
