"""What the program says of itself: help, manual pages, completions, and the line to cite."""

import json
import re
import shutil
import subprocess

import support
from support import INPUT, OUTPUT, USAGE, Case, read_json, write_database
from tables import write_table

COLUMNS = 100


class Documents(Case):
    def commands(self, *above):
        """The commands below one, as its help lists them, each as words."""
        text = self.assert_success(*above, "--help").split("\nSubcommands:\n")
        if len(text) == 1:
            return []
        listed = text[1].split("\n\n")[0]
        return [[*above, name] for name in re.findall(r"^  ([a-z]\S*)", listed, re.MULTILINE)]

    def all_commands(self):
        first = self.commands()
        self.assertGreater(len(first), 15)
        return [[], *first, *(below for one in first for below in self.commands(*one))]

    def options(self, *command):
        """The options of a command, as its help has them."""
        text = self.assert_success(*command, "--help")
        found = []
        for line in re.findall(r"^  (-\S+)", text, re.MULTILINE):
            found += line.split(",")
        self.assertIn("--help", found)
        return found

    def written(self, name, text):
        path = self.work / name
        path.write_text(text, encoding="utf-8")
        return path

    def parsed(self, *command):
        """Runs a program that reads what was written; it may not complain."""
        result = subprocess.run([str(word) for word in command], capture_output=True, text=True,
                                check=False)
        self.assertEqual((result.returncode, result.stderr), (0, ""), command)
        return result.stdout

    def test_help_fits_the_terminal(self):
        for command in self.all_commands():
            text = self.assert_success(*command, "--help")
            self.assertNotIn("Excludes:", text)
            for line in text.splitlines():
                self.assertLessEqual(len(line), COLUMNS, f"{command}: {line}")

    def test_help_of_a_command(self):
        for command in self.all_commands():
            self.assertEqual(self.assert_success("help", *command),
                             self.assert_success(*command, "--help"))
        self.assert_refused(USAGE, ['"scam"', "scan"], "help", "scam")
        self.assert_refused(USAGE, ['"info"', "merl-scan scan", "none"], "help", "scan", "info")
        self.assert_refused(USAGE, ['"guarded"'], "help", "guarded")

    def test_version(self):
        self.assertEqual(self.assert_success("-V"), self.assert_success("--version"))

    def test_manual_pages(self):
        pages = self.work / "pages"
        pages.mkdir()
        self.assert_success("man", "--out", pages)
        first = self.commands()
        self.assertEqual({page.name for page in pages.iterdir()},
                         {"merl-scan.1", *(f"merl-scan-{name}.1" for [name] in first)})
        for command in [[], *first]:
            page = self.assert_success("man", *command)
            self.assertEqual(page, (pages / ("-".join(["merl-scan", *command]) + ".1")).read_text(encoding="utf-8"))
            described = page.replace("\\-", "-")
            for below in [command, *(self.commands(*command) if command else [])]:
                for option in self.options(*below):
                    self.assertRegex(described, rf"{re.escape(option)}\b")
            if shutil.which("groff"):
                self.parsed("groff", "-man", "-Kutf8", "-Tutf8", "-ww", "-Wbreak", "-z",
                            self.written("page.1", page))
        self.assert_refused(USAGE, ['"scam"'], "man", "scam")
        self.assert_refused(OUTPUT, ["nowhere"], "man", "--out", "nowhere")
        self.assert_refused(USAGE, ["--out"], "man", "scan", "--out", ".")
        self.assert_refused(USAGE, ["--out"], "man", "--out", "")

    def complete(self, *words):
        """What bash offers in the place of the last word."""
        script = self.written("completion.bash", self.assert_success("completion", "bash"))
        line = " ".join(f"'{word}'" for word in words)
        return self.parsed("bash", "--norc", "-c",
                           f"source {script}; COMP_WORDS=(merl-scan {line}); "
                           f"COMP_CWORD={len(words)}; _merl_scan; printf '%s\\n' \"${{COMPREPLY[@]}}\"").split()

    def test_bash(self):
        self.parsed("bash", "-n", self.written("c", self.assert_success("completion", "bash")))
        self.assertEqual(self.complete("sc"), ["scan", "score"])
        self.assertEqual(self.complete("database", "wr"), ["write"])
        self.assertEqual(self.complete("scan", "--out", ""), [])  # files
        for command in self.all_commands():
            offered = self.complete(*command, "-")
            self.assertEqual(sorted(offered), sorted(self.options(*command)), command)

    def test_zsh(self):
        text = self.assert_success("completion", "zsh")
        for command in self.all_commands():
            for option in self.options(*command):
                self.assertIn(f"'*{option}[", text)
        if shutil.which("zsh"):
            path = self.written("_merl-scan", text)
            self.parsed("zsh", "-f", "-n", path)
            self.parsed("zsh", "-f", "-c", f"autoload -U compinit; compinit -D -u; source {path}; "
                        "[ $_comps[merl-scan] = _merl_scan ]")

    def test_fish(self):
        text = self.assert_success("completion", "fish")
        path = self.written("merl-scan.fish", text)
        for option in self.options("scan"):
            name = option.lstrip("-")
            kind = "-l" if option.startswith("--") else "-s"
            self.assertRegex(text, rf"(?m)^complete .*'__fish_seen_subcommand_from scan'.* {kind} {name}\b")
        if shutil.which("fish"):
            self.parsed("fish", "--no-config", "-n", path)
            offered = self.parsed("fish", "--no-config", "-c", f"source {path}; complete -C 'merl-scan sc'")
            self.assertEqual([line.split("\t")[0] for line in offered.splitlines()], ["scan", "score"])
            offered = self.parsed("fish", "--no-config", "-c", f"source {path}; complete -C 'merl-scan scan --'")
            self.assertEqual({line.split("\t")[0] for line in offered.splitlines()},
                             {option for option in self.options("scan") if option.startswith("--")})

    def test_shells_that_are_none(self):
        self.assert_refused(USAGE, ["bash, zsh or fish", '"tcsh"'], "completion", "tcsh")
        self.assert_refused(USAGE, ["shell"], "completion")


class Cite(Case):
    def test_the_program(self):
        text = self.assert_success("cite")
        self.assertIn("merl-scan v" + self.assert_success("--version").strip(), text)
        self.assertIn("@software{", text)

    def test_results(self):
        write_database(self.work / "db", 4)
        out = self.scan("--database", "db", "--device", "host", "--metrics", "rmse,pawcielab")
        summary = read_json(out / "summary.json")
        line = self.only_line(self.assert_success("cite", out))
        self.assertEqual(line, summary["quote"])
        for word in ["merl-scan v" + summary["program"]["version"], "rmse", "pawcielab",
                     "float32 with a proven bound", "database db",
                     summary["database"]["content_hash"], "4 materials", "grid 6x5x8", "engine host"]:
            self.assertIn(word, line)
        self.assertEqual(self.only_line(self.assert_success("cite", out / "summary.json")), line)

    def test_parameters(self):
        self.assert_success("compare", "--database", "blends:3", "--grid", "45x45x90", "--device",
                            "host", "--metrics", "gloss-contrast:haze=0.5,rmse", "--out", "out")
        line = self.assert_success("cite", "out")
        self.assertRegex(line, r"gloss-contrast:[^,]*haze=0\.5\b[^,]*\(float64\)")
        page = (self.work / "out" / "compare.html").read_text(encoding="utf-8")
        self.assertIn(json.dumps(line.strip())[1:-1], page)

    def test_tables(self):
        write_table(self.work / "t.csv", ["one", "two"], ["a", "b", "c"], lambda i: 1)
        self.assert_success("compare", "--distances", "t.csv", "--out", "out")
        line = self.only_line(self.assert_success("cite", "out"))
        for word in ("one", "two", "distances t.csv", "taken as exact"):
            self.assertIn(word, line)

    def test_what_has_none(self):
        self.assert_refused(INPUT, ["nowhere"], "cite", "nowhere")
        self.assert_refused(USAGE, ["path"], "cite", "")
        for text, word in [("{}", "no summary"), ("[", "no summary"), ("", "empty"),
                           ('{"program": {}}', "quote"), ('{"program": {}, "quote": 3}', "quote"),
                           ('{"program": {}, "format": 99, "quote": ""}', "newer")]:
            (self.work / "s.json").write_text(text)
            self.assert_refused(INPUT, ["s.json", word], "cite", "s.json")
        (self.work / "s.json").write_text('{"program": {}, "quote": "a\\u001b[31m\\nb"}')
        self.assertEqual(self.assert_success("cite", "s.json"), "a\\x1b[31m\\x0ab\n")


if __name__ == "__main__":
    support.main()
