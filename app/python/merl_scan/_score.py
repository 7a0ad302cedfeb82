"""How well metrics predict what people said."""

from __future__ import annotations

import dataclasses
import os
from typing import TYPE_CHECKING, Any, NamedTuple, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._distances import Distances
from ._progress import call, text

if TYPE_CHECKING:
    import pandas  # type: ignore[import]


@dataclasses.dataclass(frozen=True, eq=False)
class Judgements:
    """Votes on which of two pairs of materials is more alike.

    file, format: where they are from, for people.
    names: of materials.
    rows: (rows, 7): the places in `names` of left_1, left_2, right_1 and right_2, then the votes for
        the left pair, for neither and for the right pair.
    """

    file: str
    format: str
    names: list[str] = dataclasses.field(repr=False)
    rows: npt.NDArray[np.uint64] = dataclasses.field(repr=False)

    def __len__(self) -> int:
        return len(self.rows)


class Figure(NamedTuple):
    """A figure and its 95 % interval, which is NaN where there is none."""

    value: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class MetricScore:
    """How well one metric predicts (docs/scoring.md has the definitions)."""

    metric: str
    majorities: Figure  #: share of the untied majorities
    votes: Figure  #: share of the votes
    slope: Figure  #: of the choice model
    log_likelihood: Figure  #: of the choice model, per vote
    ties: int  #: judgements whose two distances are equal
    undecided: int  #: judgements whose order bounds leave open


@dataclasses.dataclass(frozen=True)
class PairScore:
    """Who is right where two metrics predict different answers."""

    first: str
    second: str
    first_right: int
    second_right: int
    difference: Figure  #: majorities of the first minus those of the second
    p_holm: float


@dataclasses.dataclass(frozen=True)
class Score:
    """What `merl-scan score` says.

    metrics, pairs: a MetricScore for each metric, a PairScore for every two.
    judgements, untied, votes: how many there are on the materials at hand.
    ceiling: the share of the votes that the best prediction gets.
    too_few: why there are no intervals; empty where there are.
    unknown: materials of the judgements that have no distances.
    """

    metrics: list[MetricScore]
    pairs: list[PairScore]
    judgements: int
    untied: int
    votes: int
    ceiling: Figure
    too_few: str
    unknown: list[str]

    def __getitem__(self, metric: str) -> MetricScore:
        for one in self.metrics:
            if one.metric == metric:
                return one
        raise KeyError(metric)

    def to_pandas(self) -> pandas.DataFrame:
        """A row a metric. Needs pandas."""
        import pandas

        rows = []
        for one in self.metrics:
            row: dict[str, Any] = {"metric": one.metric}
            for name in ("majorities", "votes", "slope", "log_likelihood"):
                figure = getattr(one, name)
                row.update({name: figure.value, f"{name}_low": figure.low, f"{name}_high": figure.high})
            rows.append({**row, "ties": one.ties, "undecided": one.undecided})
        return pandas.DataFrame(rows)

    def __repr__(self) -> str:
        best = ", ".join(f"{one.metric} {one.majorities.value:.3f}"
                         for one in sorted(self.metrics, key=lambda one: -one.majorities.value)[:5])
        return f"<merl_scan.Score of {self.judgements} judgements, majorities: {best}>"


def read_judgements(file: Union[str, os.PathLike[str]]) -> Judgements:
    """Judgements in any of the three formats of docs/file-formats.md: CSV with reference, a, b, or
    with four materials, or the JSON of Lagunas et al. 2019.

    Raises InputError for a file that cannot be used.
    """
    return Judgements(**_core.read_judgements(text("file", file), call()))


def score(distances: Distances, judgements: Judgements, *, memory: Union[str, int] = "1G",
          threads: int = 0) -> Score:
    """How well the distances predict the judgements: as `merl-scan score`, with its very numbers.

    Raises InputError where no judgement is on these materials, and where samples can no longer be
    read or have changed.
    """
    for name, argument, kind in (("distances", distances, Distances), ("judgements", judgements, Judgements)):
        if not isinstance(argument, kind):
            raise TypeError(f"{name}: found {type(argument).__name__}; expected {kind.__name__}")
    rows = np.asarray(judgements.rows)
    if rows.dtype.kind not in "iu":
        raise TypeError(f"rows of judgements: found numbers of type {rows.dtype}; expected whole ones")
    columns, database, metrics = distances._chosen(distances.metrics)
    result = _core.score(distances.names, columns, database, metrics,
                         (judgements.file, judgements.format, judgements.names, rows),
                         call("", memory, threads))
    figures = ("majorities", "votes", "slope", "log_likelihood")
    return Score(
        metrics=[MetricScore(**{k: Figure(*v) if k in figures else v for k, v in one.items()})
                 for one in result["metrics"]],
        pairs=[PairScore(**dict(one, difference=Figure(*one["difference"]))) for one in result["pairs"]],
        judgements=result["judgements"], untied=result["untied"], votes=result["votes"],
        ceiling=Figure(*result["ceiling"]), too_few=result["too_few"], unknown=result["unknown"])
