"""What long calls tell of themselves."""

from __future__ import annotations

import contextlib
import contextvars
import os
import sys
from collections.abc import Callable, Iterator
from typing import Any, Optional, Union

from . import _core

Report = Callable[[str, float], object]

_report: contextvars.ContextVar[Optional[Report]] = contextvars.ContextVar("report", default=None)


def call(device: str = "", memory: Union[str, int] = "1G", threads: int = 0) -> dict[str, Any]:
    """The options that every function of _core takes that computes."""
    return {"device": text("device", device), "memory": _bytes(memory),
            "threads": whole("threads", threads, 0, 4096), "progress": _report.get()}


def whole(name: str, number: Any, least: int, most: int) -> int:
    """The argument `name`, a whole number."""
    if isinstance(number, bool) or not hasattr(number, "__index__"):
        raise TypeError(f"{name}: found {number!r}; expected a whole number")
    result: int = number.__index__()
    if not least <= result <= most:
        raise _core.UsageError(f"{name}: found {number}; expected {least} to {most}")
    return result


def text(name: str, argument: Any) -> str:
    """The argument `name`, a str or what names a file."""
    if not isinstance(argument, (str, bytes, os.PathLike)):
        raise TypeError(f"{name}: found {argument!r}; expected a str")
    result = os.fsdecode(argument)
    if "\0" in result:
        raise _core.UsageError(f"{name}: found {result!r}; expected no NUL")
    return result


def _bytes(memory: Union[str, int]) -> int:
    """Bytes, also as the command line has them: 512M, 2G."""
    if isinstance(memory, str):
        unit = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}.get(memory[-1:].upper(), 1)
        digits = memory[:-1] if unit > 1 else memory
        if not (digits.isascii() and digits.isdigit()):
            raise ValueError(f'memory: found "{memory}"; expected bytes, like 512M or 2G')
        return whole("memory", int(digits) * unit, 1, 1 << 62)
    return whole("memory", memory, 1, 1 << 62)


class _Bar:
    """One line on standard error, written over again and again."""

    def __init__(self) -> None:
        self._width = 0

    def __call__(self, stage: str, share: float) -> None:
        done = round(30 * share)
        line = f"{stage}: {share:4.0%} |{'#' * done}{'.' * (30 - done)}|"
        sys.stderr.write("\r" + line.ljust(self._width))
        sys.stderr.flush()
        self._width = len(line)

    def close(self) -> None:
        if self._width:
            sys.stderr.write("\r" + " " * self._width + "\r")
            sys.stderr.flush()


class _Tqdm:
    """Bars of tqdm, one for each stage, which are widgets in a notebook."""

    def __init__(self, tqdm: Any) -> None:
        self._tqdm = tqdm
        self._bar: Any = None
        self._stage = ""

    def __call__(self, stage: str, share: float) -> None:
        if self._bar is None or stage != self._stage:
            self.close()
            self._bar = self._tqdm(total=100, desc=stage, leave=False, bar_format="{l_bar}{bar}| {elapsed}")
            self._stage = stage
        self._bar.update(100 * share - self._bar.n)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


@contextlib.contextmanager
def progress(report: Optional[Report] = None) -> Iterator[None]:
    """Shows how far the calls inside are; of this thread, or this task of asyncio.

        with ms.progress():
            d = ms.distances(db, ["pawcielab"])

    Without `report` a bar on standard error or in a notebook, by tqdm where that is installed;
    nothing where standard error is no terminal. `report(stage, share)` is called several times a
    second instead, with the share of the stage that is done, from 0 to 1; what it raises ends the
    work and comes out.
    """
    if report is not None and not callable(report):
        raise TypeError(f"report: found {report!r}; expected a function of stage and share")
    bar: Union[_Bar, _Tqdm, None] = None
    if report is None and (sys.stderr is not None and sys.stderr.isatty() or "ipykernel" in sys.modules):
        try:
            from tqdm.auto import tqdm  # type: ignore[import]

            bar = _Tqdm(tqdm)
        except ImportError:
            bar = _Bar()
        report = bar
    token = _report.set(report)
    try:
        yield
    finally:
        _report.reset(token)
        if bar is not None:
            bar.close()
