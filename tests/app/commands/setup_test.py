"""scripts/setup.sh where it cannot install anything: a line says what is to be done."""

import os
import pathlib
import shutil
import subprocess

import support
from support import Case

SETUP = pathlib.Path(__file__).parents[3] / "scripts" / "setup.sh"


class Setup(Case):
    def refused(self, which, **programs):
        """The line it ends with where there are only these programs, with these texts."""
        there = self.work / "bin"
        shutil.rmtree(there, ignore_errors=True)
        there.mkdir()
        for name in "bash", "env", "dirname", "grep":
            (there / name).symlink_to(shutil.which(name))
        for name, text in programs.items():
            program = there / name.replace("_", "-")
            program.write_text(f"#!/usr/bin/env bash\n{text}\n")
            program.chmod(0o755)
        result = subprocess.run([there / "bash", SETUP, which], env={"PATH": os.fspath(there)},
                                capture_output=True, text=True, check=False)
        self.assertEqual((result.returncode, result.stdout), (1, ""))
        return self.only_line(result.stderr)

    def test_without_sudo(self):
        line = self.refused("tests", dpkg_query="exit 1", apt_get="exit 1", id="echo 1000")
        for word in "sudo", "root", "apt-get install", "glslang-dev", "chromium", "firefox-esr", "libfmt-dev":
            self.assertIn(word, line)

    def test_the_program_needs_no_tests(self):
        line = self.refused("program", dpkg_query="exit 1", apt_get="exit 1", id="echo 1000")
        for word in "chromium", "firefox", "clang", "gtest", "benchmark", "python3":
            self.assertNotIn(word, line)
        self.assertIn("libvulkan-dev", line)

    def test_without_apt(self):
        line = self.refused("tests", id="echo 0")
        for word in "no Debian", "libvulkan-dev", "cmake --preset release":
            self.assertIn(word, line)


if __name__ == "__main__":
    support.main()
