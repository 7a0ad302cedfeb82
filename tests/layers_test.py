"""No file includes a header of a layer above its own.

usage: layers_test.py BUILD_DIRECTORY

Looks at what the compiler read for every object of the build (ninja -t deps), so at headers of
headers too. The order of the layers is docs/architecture.md's."""

import pathlib
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[1]

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


def inside(path, build):
    """A path of the compiler as one below the sources or the generated files; none for others."""
    absolute = (build / path).resolve()
    for root in (build / "engine", build / "app", build / "scan", build, SOURCE):
        if absolute.is_relative_to(root) and layer_of(absolute.relative_to(root)):
            return absolute.relative_to(root).as_posix()
    return None


def violations(build):
    """(file, header, layer of the file, layer of the header) of every include that goes up."""
    listing = subprocess.run(["ninja", "-C", build, "-t", "deps"], capture_output=True, text=True,
                             check=True).stdout
    found, objects = set(), 0
    for block in listing.split("\n\n"):
        paths = [line.strip() for line in block.splitlines()[1:] if line.strip()]
        # Not always the first: a compiler may read files of its own before.
        unit = inside(next((path for path in paths if path.endswith(".cpp")), ""), build)
        if not unit:  # what tests are made of may include anything
            continue
        objects += 1
        allowed = below(layer_of(unit))
        for layer in ABOVE.get(unit, ()):
            allowed |= below(layer)
        for header in filter(None, (inside(path, build) for path in paths)):
            if layer_of(header) not in allowed:
                found.add((unit, header, layer_of(unit), layer_of(header)))
    return sorted(found), objects


def main():
    found, objects = violations(pathlib.Path(sys.argv[1]).resolve())
    for unit, header, own, other in found:
        print(f"{unit} includes {header}: {own} may not include {other} (tests/layers_test.py)")
    print(f"{objects} objects, {len(found)} includes that go up")
    assert objects > 100, "the build has no dependencies to look at"
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
