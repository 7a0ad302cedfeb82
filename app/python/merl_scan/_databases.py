"""Databases of BRDFs: opened by name, or made of arrays."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Optional, Union, overload

import numpy as np
import numpy.typing as npt

from . import _core
from ._progress import call, text, whole

Floats = npt.NDArray[np.float64]
Patterns = Union[str, Sequence[str]]


@dataclasses.dataclass(frozen=True)
class _Part:
    """A database by itself, what it is called beside others, and how it is made again."""

    core: _core.Database
    label: str
    is_labelled: bool
    recipe: dict[str, Any]  # of _open() or _from_arrays()
    chosen: Optional[list[str]] = None  # only these materials of it


def _open(label: str, is_labelled: bool, **recipe: Any) -> _Part:
    core = _core.open(recipe["name"], recipe["shape"], recipe["phi_d_range"], recipe["skip_bad"],
                      recipe["materials"], recipe["exclude"], call())
    return _Part(core, label, is_labelled, recipe)


def _from_arrays(label: str, is_labelled: bool, **recipe: Any) -> _Part:
    core = _core.from_arrays(label, recipe["names"], recipe["arrays"], recipe["phi_d_range"])
    return _Part(core, label, is_labelled, recipe)


def _remake(part: _Part) -> _Part:
    make = _from_arrays if "arrays" in part.recipe else _open
    made = make(part.label, part.is_labelled, **part.recipe)
    return made if part.chosen is None else _choose(made, part.chosen)


def _choose(part: _Part, names: list[str]) -> _Part:
    wanted = set(names)
    places = [i for i, name in enumerate(part.core.materials) if name in wanted]
    return dataclasses.replace(part, core=part.core.subset(places), chosen=names)


def _array(name: str, samples: Any, copy: bool) -> npt.NDArray[Any]:
    if isinstance(samples, Material):
        samples = samples.samples()
    array: npt.NDArray[Any] = np.array(samples) if copy else np.asarray(samples)
    if array.dtype.kind == "f" and not array.dtype.isnative:
        array = array.astype(array.dtype.newbyteorder("="))
    if array.dtype not in (np.float64, np.float32):
        raise TypeError(f"{name}: found numbers of type {array.dtype}; expected float64 or float32")
    return array


class Database:
    """BRDFs on one grid, under names that ascend bytewise. It never changes.

    open() and Database.from_arrays() make one. `a + b` joins two, whose materials are then called
    "label/name"; db["gold-paint"] is a Material, db[["gold-paint", "chrome"]] a Database of some.
    """

    def __init__(self, parts: Sequence[_Part]) -> None:
        self._parts = tuple(parts)
        if len(parts) == 1 and not parts[0].is_labelled:
            self._core = parts[0].core
        else:
            self._core = _core.join([part.label for part in parts], [part.core for part in parts])

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any], *, label: str = "arrays", phi_d_range: str = "pi",
                    copy: bool = False) -> Database:
        """A database of one's own arrays.

        arrays: by name, of shape (theta_h, theta_d, phi_d, 3), float64 or float32, in 1/sr, at most
            1e12; the same shape for all. NaN and negative numbers were not measured. What is not an
            array becomes one by np.asarray().
        label: what it is called in messages, and beside other databases.
        phi_d_range: where phi_d ends: "pi", as in MERL, or "2pi", for what is not reciprocal.
        copy: arrays are read where they are, whatever their strides. So they may not change while
            the database is used; scan() and score() raise an InputError where they find that.
            With copy=True they may.

        Raises TypeError for numbers of another type, InputError for other shapes, bad names and, in
        what reads them, for samples that are infinite or too large. Nothing is read here.
        """
        if not isinstance(arrays, Mapping):
            raise TypeError(f"arrays: found {type(arrays).__name__}; expected a dict from names to arrays")
        for name in arrays:
            if not isinstance(name, str):
                raise TypeError(f"arrays: found the name {name!r}; expected a str")
        text("label", label)
        text("phi_d_range", phi_d_range)
        names = sorted(arrays, key=os.fsencode)
        return cls([_from_arrays(label, False, names=names,
                                 arrays=[_array(name, arrays[name], copy) for name in names],
                                 phi_d_range=phi_d_range)])

    @property
    def materials(self) -> list[str]:
        """The names, ascending bytewise."""
        return self._core.materials

    @property
    def name(self) -> str:
        return self._core.name

    @property
    def kind(self) -> str:
        """What it is: "MERL directory", "arrays" ..."""
        return self._core.kind

    @property
    def path(self) -> str:
        """Where it is; empty for what is not in files."""
        return self._core.path

    @property
    def shape(self) -> tuple[int, int, int]:
        """How many theta_h, theta_d and phi_d."""
        return self._core.shape

    @property
    def phi_d_range(self) -> str:
        return self._core.phi_d_range

    @property
    def skipped(self) -> list[tuple[str, str]]:
        """What was left out because it cannot be used, and why; only with skip_bad."""
        return self._core.skipped

    @property
    def grid(self) -> Grid:
        return grid(self.shape, self.phi_d_range)

    def content_hash(self) -> str:
        """Identifies names, grid and samples, as in summaries of the command line. Reads all."""
        return self._core.content_hash(call())

    def __len__(self) -> int:
        return len(self._core.materials)

    def __iter__(self) -> Iterator[str]:
        return iter(self._core.materials)

    def __contains__(self, name: object) -> bool:
        return name in self._core.materials

    @overload
    def __getitem__(self, names: str) -> Material: ...  # type: ignore[misc]  # a str is a sequence

    @overload
    def __getitem__(self, names: Sequence[str]) -> Database: ...

    def __getitem__(self, names: Union[str, Sequence[str]]) -> Union[Material, Database]:
        """One material, or a database of some. Raises KeyError for a name that is not there."""
        if isinstance(names, str):
            if names not in self._core.materials:
                raise KeyError(names)
            return Material(self, names)
        if not isinstance(names, Iterable):
            raise TypeError(f"found {names!r}; expected the name of a material, or several")
        wanted = list(names)
        there = set(self._core.materials)
        for name in wanted:
            if name not in there:
                raise KeyError(name)
        if not wanted:
            raise ValueError("found no names; expected one or more")
        if len(self._parts) == 1 and not self._parts[0].is_labelled:
            return Database([_choose(self._parts[0], wanted)])
        parts = []
        for part in self._parts:
            begin = part.label + "/"
            own = [name[len(begin):] for name in wanted if name.startswith(begin)]
            if own:
                parts.append(_choose(dataclasses.replace(part, is_labelled=True), own))
        return Database(parts)

    def __add__(self, other: Database) -> Database:
        """Both, whose grids must be the same; what is evaluated takes that of the other.

        Raises UsageError for a label that both have: ms.open("LABEL=PATH") gives another.
        """
        if not isinstance(other, Database):
            return NotImplemented
        parts = list(self._parts + other._parts)
        labels = [part.label for part in parts]
        for label in labels:
            if labels.count(label) > 1:
                raise _core.UsageError(f'found the label "{label}" twice; ms.open("LABEL=PATH") and '
                                       "Database.from_arrays(label=...) give others")
        fixed = [part for part in parts if part.recipe.get("shape", ()) is not None]
        shape = fixed[0].core.shape if fixed else parts[0].core.shape
        for i, part in enumerate(parts):
            if part.core.shape != shape and part not in fixed:
                parts[i] = _remake(dataclasses.replace(part, recipe={**part.recipe, "shape": shape}))
        return Database(parts)

    def __repr__(self) -> str:
        materials = "1 material" if len(self) == 1 else f"{len(self)} materials"
        sides = " x ".join(map(str, self.shape))
        return f"<merl_scan.Database {self.name!r}: {materials}, {sides}, {self.kind}>"

    def __reduce__(self) -> Any:
        parts = [(part.label, part.is_labelled, part.recipe, part.chosen) for part in self._parts]
        return _unpickled, (parts,)

    def __copy__(self) -> Database:
        return self

    @property
    def _may_change(self) -> bool:
        return any("arrays" in part.recipe for part in self._parts)


def _unpickled(parts: list[tuple[str, bool, dict[str, Any], Optional[list[str]]]]) -> Database:
    made = []
    for label, is_labelled, recipe, chosen in parts:
        part = (_from_arrays if "arrays" in recipe else _open)(label, is_labelled, **recipe)
        made.append(part if chosen is None else _choose(part, chosen))
    return Database(made)


class Material:
    """One BRDF of a database. np.asarray() makes samples() of it."""

    def __init__(self, database: Database, name: str) -> None:
        self.database = database
        self.name = name

    @property
    def _place(self) -> int:
        return self.database._core.materials.index(self.name)

    def samples(self) -> Floats:
        """(theta_h, theta_d, phi_d, 3) in 1/sr, NaN where nothing was measured; read anew each time.

        Raises InputError for a file that cannot be used.
        """
        return self.database._core.read(self._place)

    def __array__(self, dtype: Any = None, copy: Any = None) -> npt.NDArray[Any]:
        samples = self.samples()
        return samples if dtype is None else samples.astype(dtype)

    def __repr__(self) -> str:
        return f"<merl_scan.Material {self.name!r} of {self.database.name!r}>"


def _patterns(patterns: Patterns) -> list[str]:
    return [patterns] if isinstance(patterns, str) else list(patterns)


def _sides(shape: Sequence[int]) -> tuple[int, ...]:
    if isinstance(shape, str) or not isinstance(shape, Iterable):
        raise TypeError(f"shape: found {shape!r}; expected (theta_h, theta_d, phi_d)")
    sides = tuple(whole("shape", side, 1, 65536) for side in shape)
    if len(sides) != 3:
        raise _core.UsageError(f"shape: found {sides}; expected (theta_h, theta_d, phi_d)")
    return sides


def open(name: Union[str, os.PathLike[str]] = "built-in", *, shape: Optional[Sequence[int]] = None,
         phi_d_range: Optional[str] = None, materials: Patterns = (), exclude: Patterns = (),
         skip_bad: bool = False) -> Database:
    """Opens a database as `merl-scan --database` does.

    name: "built-in", a directory of MERL .binary or RGL .bsdf files, a model ("sgd"), or
        "model:table.csv". With "label=" before it materials are called "label/name".
    shape: (theta_h, theta_d, phi_d) of what can be evaluated on any grid; (90, 90, 180) without.
    phi_d_range: "pi" or "2pi": where phi_d of MERL files ends, which is otherwise seen by their
        sizes.
    materials, exclude: only these, or all but these: names, or patterns like "gold-*".
    skip_bad: leave out files that cannot be used (Database.skipped). Reads all once.

    Raises InputError where there is nothing that could be one, UsageError for a bad label or
    pattern.
    """
    whole_name = text("name", name)
    if not whole_name:
        raise _core.UsageError("name: found an empty text; expected a path")
    label, separator, path = whole_name.partition("=")
    is_labelled = bool(separator) and "/" not in label
    if not is_labelled:
        path = whole_name
    if path == "~" or path.startswith("~/"):
        path = os.path.expanduser(path)
    if is_labelled and not path:
        raise _core.UsageError(f'{whole_name}: found nothing after the "="; expected LABEL=PATH')
    recipe = {"name": path, "shape": None if shape is None else _sides(shape), "phi_d_range": phi_d_range,
              "skip_bad": bool(skip_bad), "materials": _patterns(materials), "exclude": _patterns(exclude)}
    part = _open(label if is_labelled else _core.default_label(path), is_labelled, **recipe)
    if not _core.is_evaluated(path):
        part = dataclasses.replace(part, recipe={**recipe, "shape": part.core.shape})
    return Database([part])


@dataclasses.dataclass(frozen=True)
class Grid:
    """The voxels of a grid, at their centres: arrays of shape (theta_h, theta_d, phi_d), in radians.

    Half-difference angles are those of Rusinkiewicz 1998; phi_d runs evenly from 0 to pi (or 2 pi),
    theta_d to pi/2, theta_h as the square of even steps. A sample of a BRDF f is
    f(light[i, j, k], view[i, j, k]).
    """

    shape: tuple[int, int, int]
    phi_d_range: str
    theta_h: Floats = dataclasses.field(repr=False)
    theta_d: Floats = dataclasses.field(repr=False)
    phi_d: Floats = dataclasses.field(repr=False)
    cos_theta_i: Floats = dataclasses.field(repr=False)  #: of light and normal (Ryman 2018, 4.5)
    cos_theta_o: Floats = dataclasses.field(repr=False)  #: of view and normal (4.6)
    s_merl: Floats = dataclasses.field(repr=False)  #: the MERL scale factor (docs/numerics.md)
    solid_angle: Floats = dataclasses.field(repr=False)  #: in sr^2, of the whole grid over pi

    @property
    def above_horizon(self) -> npt.NDArray[np.bool_]:
        """Where light and view both are: what metrics look at."""
        return (self.cos_theta_i > 0) & (self.cos_theta_o > 0)

    @functools.cached_property
    def half(self) -> Floats:
        """Unit vectors halfway between light and view, (..., 3); the normal is z."""
        zero = np.zeros(self.shape)
        return np.stack([np.sin(self.theta_h), zero, np.cos(self.theta_h)], axis=-1)

    @functools.cached_property
    def light(self) -> Floats:
        """Unit vectors towards the light, (..., 3); the normal is z."""
        x = np.sin(self.theta_d) * np.cos(self.phi_d)
        y = np.sin(self.theta_d) * np.sin(self.phi_d)
        z = np.cos(self.theta_d)
        sine, cosine = np.sin(self.theta_h), np.cos(self.theta_h)
        return np.stack([cosine * x + sine * z, y, cosine * z - sine * x], axis=-1)

    @functools.cached_property
    def view(self) -> Floats:
        """Unit vectors towards the eye, (..., 3); the normal is z."""
        return 2 * np.cos(self.theta_d)[..., np.newaxis] * self.half - self.light


def grid(shape: Sequence[int] = (90, 90, 180), phi_d_range: str = "pi") -> Grid:
    """The voxels of a grid of (theta_h, theta_d, phi_d), at which one's own model is evaluated.

    Raises UsageError for sizes that no grid has.
    """
    sides = _sides(shape)
    return Grid(shape=(sides[0], sides[1], sides[2]), phi_d_range=phi_d_range,
                **_core.geometry(sides, text("phi_d_range", phi_d_range)))
