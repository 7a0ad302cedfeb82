"""No file includes a header of a layer above its own, sources and headers alike.

The order of the layers is docs/architecture.md's."""

import pathlib
import re
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[1]
INCLUDE = re.compile(r'^ *# *include "([^"]+\.h)"', re.MULTILINE)

# From the bottom up: a folder may include its own files and those of the folders that it names, and
# what those may include.
LAYERS = {
    "engine/base": (),
    "engine/device": ("engine/base",),
    "engine/database": ("engine/base",),
    "engine/metric": ("engine/database", "engine/device"),
    "engine/metric/check": ("engine/database", "engine/device", "engine/metric"),
    "engine/distance/parts": ("engine/metric",),
    "engine/distance/host": ("engine/distance/parts",),
    "engine/distance/vulkan": ("engine/distance/parts", "engine/metric/check"),
    "engine/distance": ("engine/distance/host", "engine/distance/vulkan"),
    "engine/render": ("engine/database", "engine/metric"),
    "scan/io": ("engine/base",),
    "scan/pairs": ("scan/io",),
    "scan/select": ("scan/pairs",),
    "scan/reference": ("scan/select",),
    "scan/statistics": ("scan/io",),
    "scan/score": ("scan/pairs", "scan/statistics"),
    "scan/tune": ("scan/score",),
    "scan/votes": ("scan/reference", "scan/statistics"),
    "app/pipeline": ("engine/distance", "engine/render", "scan/tune", "scan/votes"),
    "app/python": ("app/pipeline",),
    "app/cli": ("app/pipeline",),
    "app/output": ("app/cli",),
    "app/pages": ("app/output",),
    "app/commands": ("app/pages",),
    "app": ("app/commands",),
}

# A file of a folder that two folders share halves of: what declares the metric is below its check, and
# what compiles it is above.
ABOVE = {"engine/metric/metric_kernels.cpp": ("engine/metric/check",)}


def below(layer):
    """The layers that a layer may include."""
    found = {layer}
    for lower in LAYERS[layer]:
        found |= below(lower)
    return found


def layer_of(path):
    """The folder of LAYERS that a file is in; none for other files."""
    folder = pathlib.PurePosixPath(path).parent
    return next((str(f) for f in (folder, *folder.parents) if str(f) in LAYERS), None)


def violations():
    """(file, header, layer of the file, layer of the header) of every include that goes up, and how
    many includes were looked at. Ours are in quotes, from the top of the tree; what shaders share is in no layer."""
    found, includes = [], 0
    for path in sorted(path for folder in ("app", "engine", "scan") for path in (SOURCE / folder).rglob("*")
                       if path.suffix in (".cpp", ".h")):
        file = path.relative_to(SOURCE).as_posix()
        own = layer_of(file)
        allowed = below(own)
        for layer in ABOVE.get(file, ()):
            allowed |= below(layer)
        for header in INCLUDE.findall(path.read_text(encoding="utf-8")):
            includes += 1
            if layer_of(header) not in allowed:
                found.append((file, header, own, layer_of(header)))
    return found, includes


def main():
    found, includes = violations()
    for file, header, own, other in found:
        print(f"{file} includes {header}: {own} may not include {other} (tests/layers_test.py)")
    print(f"{includes} includes, {len(found)} that go up")
    assert includes > 500, "the tree has no includes to look at"
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
