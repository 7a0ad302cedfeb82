"""Which source files compile as one: `units(files, most)`, and for CMake

usage: units.py MOST FILE...

which prints a unit's number for every file, in their order. Files that name the same thing for
themselves alone (in an anonymous namespace, or static) never share a unit: it would not compile, or
an overload of the neighbour might be called. Nor does a file that defines macros share its unit."""

import pathlib
import re
import sys

ANONYMOUS = re.compile(r"^namespace \{$(.*?)^\}  // namespace$", re.MULTILINE | re.DOTALL)
# What is indented is inside of something with a name.
NAMED = re.compile(r"^(?:static )?[A-Za-z][^(={;\n]*?\b(\w+)(?:\[\w*\])?(?: : [^{\n]*)? ?[(={;]", re.MULTILINE)
STATIC = re.compile(r"^static .*$", re.MULTILINE)
# What the rest of a unit would see too.
SPREADS = re.compile(r"^ *# *(?:define|undef) |^using namespace ", re.MULTILINE)


def own_names(text):
    """The names that a source has for itself; `using` of the same thing may come twice."""
    own = "\n".join(ANONYMOUS.findall(text) + STATIC.findall(text))
    return set(NAMED.findall(re.sub(r"^using [\w:]+;$", "", own, flags=re.MULTILINE)))


def units(files, most):
    """Lists of files, each at most `most` long; every file is in one of them."""
    found = []  # [files, names]
    for file in files:
        text = pathlib.Path(file).read_text(encoding="utf-8")
        names = own_names(text)
        if SPREADS.search(text):
            found.append(([file], None))
            continue
        for unit in found:
            if unit[1] is not None and len(unit[0]) < most and not names & unit[1]:
                unit[0].append(file)
                unit[1].update(names)
                break
        else:
            found.append(([file], names))
    return [unit[0] for unit in found]


if __name__ == "__main__":
    numbers = {file: number for number, unit in enumerate(units(sys.argv[2:], int(sys.argv[1])))
               for file in unit}
    print(";".join(str(numbers[file]) for file in sys.argv[2:]))
