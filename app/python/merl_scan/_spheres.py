"""Spheres of materials, as people see them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._metrics import _one
from ._progress import call, whole


def render(material: Any, *, size: int = 512, field_of_view: float = 60, light: Sequence[float] = (1, 1, 1),
           exposure: float = 0, background: float = 0.5, encoding: str = "gamma",
           device: str = "") -> npt.NDArray[np.float32]:
    """A sphere of a material, (size, size, 3), rows from the top: as `merl-scan render`.

    material: a Material, or an array as Database.from_arrays() takes it.
    field_of_view: degrees, of the whole image (Ryman 2018, 5.3; docs/experiment.md).
    light: direction towards it; x to the right, y up, z towards the camera.
    exposure: in stops, from -30 to 30.
    background: grey as displayed, from 0 to 1.
    encoding: "gamma" (1/2.2) or "srgb", from 0 to 1 as displayed; "linear" for linear light, in which
        the background is that of gamma.
    device: a Vulkan device by number or part of its name.

    Raises DeviceError where there is no Vulkan device, UsageError for options out of range.
    """
    direction = tuple(float(x) for x in light)
    if len(direction) != 3:
        raise _core.UsageError(f"light: found {len(direction)} numbers; expected x, y and z")
    return _core.render(*_one(material, "material"), whole("size", size, 1, 8192), field_of_view, direction, exposure, background,
                        encoding, call(device))
