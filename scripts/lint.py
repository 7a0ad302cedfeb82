"""clang-tidy over what the build compiles of app, engine and scan, several files at once.

usage: lint.py BUILD_DIRECTORY

Needs the build: files that it generates are included. Headers such as Vulkan's cost seconds however
little of them is used, so files that are compiled in the same way go through clang-tidy as one, one
after the other in a file (not included, because some checks look at the main file alone). Only what
is wrong in a unit is found that way: each of its files is then checked alone, and that counts."""

import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

import units

SOURCE = pathlib.Path(__file__).resolve().parents[1]
FOLDERS = ("app", "engine", "scan")
FILES_OF_A_UNIT = 12
UNIT = re.compile(r"unity_\w+_cxx\.cxx")
INCLUDED = re.compile(r'^#include "([^"]+)"', re.MULTILINE)


def flags_of(command):
    """The flags of a compile command, without compiler, launcher, file and output."""
    words = shlex.split(command)
    flags = []
    for previous, word in zip(words, words[1:words.index("-o")]):
        if word.startswith("-") or previous == "-isystem":
            flags.append(word)
    return tuple(flags)


def files_of(entry):
    """What a compile command compiles: a file, or those of a unit of the build (MERL_SCAN_UNITY)."""
    file = pathlib.Path(entry["file"]).resolve()
    if not UNIT.fullmatch(file.name):
        return [file]
    return [pathlib.Path(name).resolve() for name in INCLUDED.findall(file.read_text(encoding="utf-8"))]


def sources(build):
    """{flags: files} of what is compiled; generated files are not ours to check."""
    found = {}
    for entry in json.loads((build / "compile_commands.json").read_text(encoding="utf-8")):
        for file in files_of(entry):
            if any(file.is_relative_to(SOURCE / folder) for folder in FOLDERS):
                found.setdefault(flags_of(entry["command"]), []).append(str(file))
    return found


def tidy(file, flags, build):
    """What clang-tidy says of a file, or "" when it is clean. No flags: those that it guesses."""
    how = ["-p", str(build), file] if flags is None else [file, "--", *flags]
    done = subprocess.run(["clang-tidy", "--quiet", f"--config-file={SOURCE}/.clang-tidy",
                           # The build's compiler may know warnings that clang does not.
                           "--extra-arg=-Wno-unknown-warning-option", *how],
                          capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return done.stdout
    return done.stdout or done.stderr or f"{file}: clang-tidy ended with {done.returncode}\n"


def clean(files, flags, folder):
    """Whether clang-tidy has nothing to say of files as one."""
    with tempfile.NamedTemporaryFile("w", dir=folder, suffix=".cpp", encoding="utf-8") as unit:
        for file in files:
            # A macro makes the check for headers that come twice begin again.
            unit.write(f'#undef NEXT_FILE\n#line 1 "{file}"\n{pathlib.Path(file).read_text(encoding="utf-8")}\n')
        unit.flush()
        # A constant of one file is not shadowed by a variable of the next; the compiler of the build looks.
        return not tidy(unit.name, (*flags, "-Wno-shadow"), folder)


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    found = sources(build)
    compiled = {file for files in found.values() for file in files}
    on_disk = {str(file) for folder in FOLDERS for file in (SOURCE / folder).rglob("*.cpp")}
    if not compiled:
        print(f"{sys.argv[1]}/compile_commands.json has no file of {', '.join(FOLDERS)}; expected those of this "
              "tree: configure and build it", file=sys.stderr)
        return 1
    work = [(unit, flags) for flags, files in found.items() for unit in units.units(files, FILES_OF_A_UNIT)]
    work.sort(key=lambda unit: -len(unit[0]))  # what takes long begins first
    wrong = 0
    with tempfile.TemporaryDirectory(dir=build) as folder, \
            concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as threads:
        results = threads.map(lambda unit: len(unit[0]) > 1 and clean(*unit, folder), work)
        again = [(file, flags) for (files, flags), is_clean in zip(work, results) if not is_clean for file in files]
        # What an option of the build leaves out gets the flags of the file that is most like it.
        again += [(file, None) for file in sorted(on_disk - compiled)]
        for said in threads.map(lambda one: tidy(*one, build), again):
            print(said, end="")
            wrong += bool(said)
    print(f"clang-tidy: {len(on_disk)} files in {len(work)} units, {len(again)} of them alone, {wrong} not clean")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
