"""Metrics, and the distance of two materials."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from typing import Any, Union

from . import _core
from ._databases import Material, _array
from ._progress import call, text

#: What was tried already: the text of the metric, that of its file, the device.
_tried: set[tuple[str, str, str]] = set()

_TRIAL_SECONDS = 60
_TRIAL_BYTES = 4 << 30
_TRIAL = """
import resource, sys
sys.path[:0] = [sys.argv[3]]
from merl_scan import _core
try:
    if _core.limits_memory:
        resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[4]), int(sys.argv[4])))
    _core.try_metric(sys.argv[1], sys.argv[2])
except _core.Error as error:
    sys.stdout.buffer.write(f"{type(error).__name__} {error}".encode("utf-8", "surrogateescape"))
"""


def try_own(metrics: Sequence[_core.Metric], device: str) -> None:
    """Compiles each metric of a user's own and tries it, in a process of its own, so that no file can
    hang or crash this one (a compiler or a driver may)."""
    for metric in metrics:
        key = (metric.text, metric.source_text, device)
        if not metric.is_own or key in _tried:
            continue
        package = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
        file = metric.text.split(".glsl")[0] + ".glsl"
        try:
            result = subprocess.run(
                [sys.executable, "-B", "-c", _TRIAL, metric.text, device, package, str(_TRIAL_BYTES)],
                stdin=subprocess.DEVNULL, capture_output=True, timeout=_TRIAL_SECONDS, check=False)
        except subprocess.TimeoutExpired:
            raise _core.InputError(f"{file}: compiling and trying it takes more than {_TRIAL_SECONDS} "
                                   "seconds") from None
        said = result.stdout.decode("utf-8", "surrogateescape")
        kind, _, message = said.partition(" ")
        if kind:
            raise getattr(_core, kind)(message)
        if result.returncode != 0:
            raise _core.InputError(f"{file}: compiling and trying it ended with status "
                                   f"{result.returncode}: {result.stderr.decode(errors='replace').strip()[-300:]}")
        _tried.add(key)


class Metric:
    """A metric with its parameters, and what can be kept for one distance after another under it.

    name: as `merl-scan --metrics` has it: "pawcielab", "pawcielab:white=80",
        "./my_metric.glsl:gamma=0.4".

    Raises UsageError for an unknown name or parameter, InputError for a file that cannot be used.
    """

    def __init__(self, name: Union[str, os.PathLike[str]]) -> None:
        self._core = _core.Metric(text("metric", name))

    @property
    def name(self) -> str:
        """With the parameters that are not at their defaults."""
        return self._core.name

    @property
    def title(self) -> str:
        return self._core.title

    @property
    def formula(self) -> str:
        return self._core.formula

    @property
    def source(self) -> str:
        """Where it is from."""
        return self._core.source

    @property
    def parameters(self) -> dict[str, float]:
        return self._core.parameters

    def distance(self, a: Any, b: Any, *, device: str = "", memory: Union[str, int] = "1G",
                 threads: int = 0) -> float:
        """The distance of two materials: arrays as Database.from_arrays() takes them, or Materials.

        Under a sum over voxels (all metrics of the library but the summaries) it is the float64
        distance, with the bits that the command line refines to, computed on this processor. What
        depends on the grid alone is kept from the first call on: some 100 MB on the grid of MERL,
        once for all metrics. Under a summary, or a metric of one's own, it is the distance of
        distances().

        Raises InputError where the two are on different grids, TypeError for other numbers.
        """
        of_a, of_b = _one(a, "a"), _one(b, "b")
        try_own([self._core], text("device", device))
        return self._core.distance(*of_a, *of_b, call(device, memory, threads))

    def __repr__(self) -> str:
        return f"<merl_scan.Metric {self.name!r}: {self.title}>"

    def __reduce__(self) -> Any:
        return Metric, (self._core.text,)


def _one(samples: Any, name: str) -> tuple[_core.Database, int]:
    """A database, and the place in it."""
    if isinstance(samples, Material):
        return samples.database._core, samples._place
    return _core.from_arrays("arrays", [name], [_array(name, samples, copy=False)], "pi"), 0


def distance(metric: Union[str, Metric], a: Any, b: Any, *, device: str = "",
             memory: Union[str, int] = "1G", threads: int = 0) -> float:
    """The distance of two materials, as Metric.distance(), which is faster when it is asked again.

        ms.distance("gloss-contrast", f_a, f_b)
    """
    one = metric if isinstance(metric, Metric) else Metric(metric)
    return one.distance(a, b, device=device, memory=memory, threads=threads)


def metrics() -> list[Metric]:
    """The library, by name."""
    return [Metric(name) for name in _core.library()]
