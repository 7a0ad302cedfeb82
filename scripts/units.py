"""Which source files may be compiled as one: `units(files, most)`.

usage: units.py MOST FILE...

which prints the number of every file's unit, as a list of CMake's. Files that have the same name for
themselves alone (in an anonymous namespace, or static) never share a unit: it would not compile, or
an overload of the neighbour might be called. Nor does a file with macros of its own, one with a `using`
of a name that the other has, which would look used, or one with a type of its own whose name the other
has for another. Names are guessed from how the tree is formatted; where the guess is wrong the unit does
not compile."""

import functools
import pathlib
import re
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[1]

ANONYMOUS = re.compile(r"^namespace \{$(.*?)^\}  // namespace$", re.MULTILINE | re.DOTALL)
STATIC = re.compile(r"^static .*$", re.MULTILINE)
# What a line begins that is not indented: a function, a class, an alias, a constant.
NAMED = re.compile(r"^(?:\[\[\w+\]\] )?[A-Za-z][^(={;\n]*?\b(\w+)(?:\[\w*\])?(?: : [^{\n]*)? ?[(={;]", re.MULTILINE)
USING = re.compile(r"^using [\w:]+::(\w+);$", re.MULTILINE)
ELSEWHERE = re.compile(r"^using ::[\w:]+::(\w+);$", re.MULTILINE)
# What the rest of a unit would see too.
SPREADS = re.compile(r"^ *# *(?:define|undef) |^using namespace ", re.MULTILINE)


@functools.cache
def header_words():
    """Every word of the headers of the tree."""
    return {word for folder in ("app", "engine", "scan") for header in (SOURCE / folder).rglob("*.h")
            for word in re.findall(r"\w+", header.read_text(encoding="utf-8"))}


class Source:
    """A file with the names that it has for itself, those it takes from elsewhere, and every word."""

    def __init__(self, file):
        text = pathlib.Path(file).read_text(encoding="utf-8")
        self.file = file
        # A header of ours that comes later may mean its own by a name from elsewhere.
        self.spreads = bool(SPREADS.search(text)) or not header_words().isdisjoint(ELSEWHERE.findall(text))
        self.own = set(NAMED.findall("\n".join(ANONYMOUS.findall(text) + STATIC.findall(text))))
        # A type may be called as one of a header that only the other includes.
        self.types = {name for name in self.own if name[0].isupper()}
        self.taken = set(USING.findall(text))
        self.words = set(re.findall(r"\w+", text))

    def can_join(self, other):
        """Whether the two may be in one unit."""
        return not (self.spreads or other.spreads or self.own & other.own or
                    (self.taken | self.types) & other.words or (other.taken | other.types) & self.words)


def units(files, most):
    """Lists of at most `most` files; every file is in one of them."""
    found = []
    for source in map(Source, files):
        unit = next((unit for unit in found
                     if len(unit) < most and all(map(source.can_join, unit))), None)
        if unit is None:
            found.append(unit := [])
        unit.append(source)
    return [[source.file for source in unit] for unit in found]


def main():
    files = sys.argv[2:]
    number = {file: i for i, unit in enumerate(units(files, int(sys.argv[1]))) for file in unit}
    print(";".join(str(number[file]) for file in files), end="")


if __name__ == "__main__":
    main()
