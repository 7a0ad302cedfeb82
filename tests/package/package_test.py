"""What cmake --install and cpack make is whole: it is put into an empty directory and used there.

BUILD is the directory of a build in which everything is compiled."""

import os
import pathlib
import re
import shlex
import subprocess
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["BUILD"])
CONSUMER = SOURCE / "tests" / "app" / "pipeline" / "consumer.cpp"
HAS_PYTHON = "MERL_SCAN_PYTHON:BOOL=ON" in (BUILD / "CMakeCache.txt").read_text(encoding="utf-8")

# Directories of two grids, so small that everything takes no time, are made by the program.
DATABASE = ["database", "write", "--materials", "chrome,gold-paint", "--grid", "6x5x8"]


def run(*command, **options):
    """Runs a command that must succeed; returns what it says."""
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True,
                            check=False, **options)
    if result.returncode != 0:
        raise AssertionError(f"{command}: status {result.returncode}\n{result.stdout[-3000:]}"
                             f"\n{result.stderr[-3000:]}")
    return result.stdout


def without_python(**environment):
    """The environment, in which Python looks for packages where it does by itself."""
    return {**{name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}, **environment}


class Package(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.work = pathlib.Path(scratch.name)

    def assert_works(self, root):
        """The program in `root`/bin runs, and its documents are there."""
        program = root / "bin" / "merl-scan"
        version = re.search(r"project\(merl-scan VERSION (\S+)",
                            (SOURCE / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
        self.assertEqual(run(program, "--version"), f"{version}\n")
        run(program, *DATABASE, self.work / "db", "--quiet")
        share = root / "share"
        for file in ("man/man1/merl-scan.1", "man/man1/merl-scan-scan.1",
                     "bash-completion/completions/merl-scan", "zsh/vendor-completions/_merl-scan",
                     "fish/vendor_completions.d/merl-scan.fish", "doc/merl-scan/LICENSE",
                     "doc/merl-scan/CITATION.cff", "doc/merl-scan/licences.md"):
            self.assertGreater((share / file).stat().st_size, 100, file)
        return program

    def distance(self, program):
        """That of the two materials of the database, as the program has it."""
        run(program, "compare", "--database", "db", "--metrics", "pawcielab,rmse", "--device", "host", "--out",
            "out", "--quiet", cwd=self.work)
        lines = (self.work / "out" / "distances.csv").read_text(encoding="utf-8").splitlines()
        return float(dict(zip(lines[0].split(","), lines[1].split(",")))["pawcielab"])

    def assert_python_has_it(self, folder, distance, environment):
        """Debian's Python finds the module in `folder`, whole, and it computes the same bits."""
        said = run("/usr/bin/python3", "-B", "-c", "import merl_scan as ms; print(ms.__file__, ms.__version__, "
                   "*ms.distances(ms.open('db'), 'pawcielab', device='host')['pawcielab'].tolist(), sep='\\n')",
                   cwd=self.work, env=environment)
        file, version, found = said.splitlines()
        self.assertEqual(pathlib.Path(file).parents[1], folder)
        self.assertEqual(version, run(BUILD / "merl-scan", "--version").strip())
        self.assertEqual(float(found), distance)
        self.assertEqual({f.name for f in (folder / "merl_scan").iterdir() if f.suffix != ".so"},
                         {f.name for f in (SOURCE / "app" / "python" / "merl_scan").iterdir() if f.is_file()})

    def test_install(self):
        root = self.work / "installed"
        run("cmake", "--install", BUILD, "--prefix", root)
        distance = self.distance(self.assert_works(root))
        moved = self.work / "moved"  # nothing may know where it was
        root.rename(moved)
        if HAS_PYTHON:  # as below ~/.local
            environment = without_python(PYTHONUSERBASE=str(moved))
            site = run("/usr/bin/python3", "-c", "import site; print(site.getusersitepackages())", env=environment)
            self.assert_python_has_it(pathlib.Path(site.strip()), distance, environment)

        run("cmake", "-S", SOURCE / "tests" / "package", "-B", self.work / "cmake",
            f"-DCMAKE_PREFIX_PATH={moved}", "-DCMAKE_BUILD_TYPE=Release")
        run("cmake", "--build", self.work / "cmake")
        environment = {**os.environ, "PKG_CONFIG_PATH": str(moved / "lib" / "pkgconfig") + ":" +
                       ":".join(map(str, moved.glob("lib/*/pkgconfig")))}
        flags = shlex.split(run("pkg-config", "--cflags", "--libs", "merl_scan", env=environment))
        run("g++", "-std=c++20", CONSUMER, "-o", self.work / "by_pkg_config", *flags)

        for consumer in (self.work / "cmake" / "consumer", self.work / "by_pkg_config"):
            names, value = run(consumer, "db", cwd=self.work).split(": ")
            self.assertEqual(names, "chrome, gold-paint")
            self.assertAlmostEqual(float(value), distance, delta=1e-5)

    @unittest.skipUnless(HAS_PYTHON, "built without the Python module")
    def test_pip_install(self):
        """Without the network, from what is compiled already; then imported from elsewhere."""
        environment = without_python(MERL_SCAN_BUILD=str(BUILD.resolve()))
        run("/usr/bin/python3", "-m", "venv", "--system-site-packages", self.work / "venv", env=environment)
        run(self.work / "venv" / "bin" / "pip", "install", "--no-build-isolation", "--no-index", SOURCE, env=environment)
        said = run(self.work / "venv" / "bin" / "python", "-c", "import merl_scan as ms; db = ms.open(); "
                   "print(ms.__file__, ms.__version__, "
                   "ms.distance('cwcbrt', db['alum-bronze'], db['gold-paint']), sep='\\n')",
                   cwd=self.work, env=environment)
        file, version, distance = said.splitlines()
        self.assertTrue(pathlib.Path(file).is_relative_to(self.work / "venv"), file)
        self.assertEqual(version, run(BUILD / "merl-scan", "--version").strip())
        self.assertAlmostEqual(float(distance), 1.482272854986468, delta=1e-12)  # as the first scan finds it

    def test_public_headers_compile_alone(self):
        root = self.work / "installed"
        run("cmake", "--install", BUILD, "--prefix", root, "--component", "development")
        headers = sorted((root / "include" / "merl_scan" / "app" / "pipeline").glob("*.h"))
        self.assertIn("version.h", [header.name for header in headers])
        text = "".join(f'#include "app/pipeline/{header.name}"\n' for header in headers)
        run("g++", "-std=c++20", "-fsyntax-only", f"-I{root}/include/merl_scan", "-x", "c++", "-",
            input=text)

    def test_debian(self):
        run("cpack", "-G", "DEB", "--config", BUILD / "CPackConfig.cmake", "-B", self.work / "packages")
        packages = {file.name.split("_")[0]: file for file in (self.work / "packages").glob("*.deb")}
        module = ["python3-merl-scan"] if HAS_PYTHON else []
        self.assertEqual(sorted(packages), ["libmerl-scan-dev", "merl-scan", *module])
        fields = run("dpkg-deb", "--field", packages["merl-scan"])
        for word in ("Package: merl-scan\n", "Recommends: ", "mesa-vulkan-drivers"):
            self.assertIn(word, fields)
        depends = re.search(r"^Depends: (.*)$", fields, re.MULTILINE)[1]
        for library in ("libc6", "libfmt", "libopenexr", "libtbb"):
            self.assertIn(library, depends)
        self.assertIn("libfmt-dev", run("dpkg-deb", "--field", packages["libmerl-scan-dev"], "Depends"))
        for package in packages.values():
            run("dpkg-deb", "--extract", package, self.work / "root")
        program = self.assert_works(self.work / "root" / "usr")
        self.assertTrue(list(self.work.glob("root/usr/lib/**/libmerl_scan_pipeline.a")))
        if HAS_PYTHON:
            depends = run("dpkg-deb", "--field", packages["python3-merl-scan"], "Depends")
            for word in ("libc6", "libfmt", "libtbb", "python3 (>= 3.", "python3 (<< 3.", "python3-numpy"):
                self.assertIn(word, depends)
            folder = self.work / "root" / "usr" / "lib" / "python3" / "dist-packages"
            self.assert_python_has_it(folder, self.distance(program), without_python(PYTHONPATH=str(folder)))


if __name__ == "__main__":
    unittest.main()
