"""pip install . builds the Python module with CMake; scripts/setup.sh says what that needs.

Everything else about the package is in app/python. In the environment, MERL_SCAN_CMAKE_ARGUMENTS are
further arguments of CMake, such as those of a compiler cache, and MERL_SCAN_BUILD is a directory that is
configured already, with the Python module for this Python: then nothing is compiled that is there."""

import os
import pathlib
import re
import shlex
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

SOURCE = pathlib.Path(__file__).resolve().parent


class CMakeBuild(build_ext):
    """Lets CMake build and install the package, and takes the compiled part of it."""

    def build_extension(self, ext):
        target = pathlib.Path(self.get_ext_fullpath(ext.name)).resolve()
        if "MERL_SCAN_BUILD" in os.environ:
            build = pathlib.Path(os.environ["MERL_SCAN_BUILD"]).resolve()
        else:
            build = SOURCE / "build" / sys.implementation.cache_tag  # kept: the next build has less to do
            subprocess.run(
                ["cmake", "-G", "Ninja", "-S", SOURCE, "-B", build, "-DCMAKE_BUILD_TYPE=Release",
                 "-DMERL_SCAN_UNITY=ON", "-DMERL_SCAN_TESTS=OFF", "-DMERL_SCAN_PYTHON=ON",
                 f"-DPython3_EXECUTABLE={sys.executable}",
                 *shlex.split(os.environ.get("MERL_SCAN_CMAKE_ARGUMENTS", ""))], check=True)
        subprocess.run(["cmake", "--build", build, "--target", "_core", "--parallel", str(os.cpu_count() or 1)],
                       check=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        self.copy_file(str(build / "python/merl_scan" / target.name), str(target))


setup(
    name="merl-scan",
    version=re.search(r"project\(merl-scan VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text())[1],
    description="The bench for reflectance metrics",
    python_requires=">=3.9",
    install_requires=["numpy"],
    packages=["merl_scan"],
    package_dir={"merl_scan": "app/python/merl_scan"},
    package_data={"merl_scan": ["*.pyi", "py.typed"]},
    ext_modules=[Extension("merl_scan._core", sources=[])],
    cmdclass={"build_ext": CMakeBuild},
)
