"""merl-scan itself: help, version, and options that are wrong."""

import unicodedata

import support
from support import USAGE, Case, write_database

COMMANDS = [], ["scan"], ["compare"], ["score"], ["tune"], ["devices"], ["metrics"], ["metrics", "show"], \
    ["models"], ["models", "show"], \
    ["database"], ["database", "info"], ["database", "write"], ["verify"], ["slices"], ["cite"], ["help"], ["man"], ["completion"]


class Help(Case):
    def test_every_command_has_examples(self):
        for command in COMMANDS:
            with self.subTest(command):
                output = self.assert_success(*command, "--help")
                self.assertIn("Usage: merl-scan", output)
                self.assertRegex(output, r"Examples:\n  merl-scan ")

    def test_help_of_scan_names_every_option(self):
        output = self.assert_success("scan", "--help")
        for option in (
            "--database", "--distances", "--out", "--metrics", "--select", "--per-material", "--device",
            "--disagreements", "--memory", "--threads", "--fast", "--force", "--quiet",
        ):
            self.assertIn(option, output)

    def test_help_of_compare_names_every_option(self):
        output = self.assert_success("compare", "--help")
        for option in ("--database", "--distances", "--out", "--metrics", "--device", "--memory",
                       "--threads", "--force", "--quiet"):
            self.assertIn(option, output)

    def test_version(self):
        self.assertRegex(self.assert_success("--version"), r"^\d+\.\d+\.\d+\n$")


class Usage(Case):
    def assert_usage(self, words, *arguments):
        self.assert_refused(USAGE, words, *arguments)

    def test_no_command(self):
        self.assert_usage(["subcommand"])
        self.assert_usage(["subcommand"], "database")

    def test_unknown_command_is_named(self):
        self.assert_usage(["scna"], "scna")
        self.assert_usage(["infos"], "database", "infos")
        self.assert_usage(["two\\x0alines", "\\x1b[31m"], "two\nlines\x1b[31m")

    def test_what_nobody_sees_becomes_visible(self):
        # unicodedata knows them by themselves: control and format characters, separators of lines.
        signs = set("\u0600\u0601\u0602\u0603\u0604\u0605\u06dd\u070f\u0890\u0891\u08e2\U000110bd"
                    "\U000110cd") | set(map(chr, range(0x13430, 0x13440))) | \
            set(map(chr, range(0x1bca0, 0x1bca4)))  # have a shape of their own
        hidden = [c for c in map(chr, range(1, 0x110000)) if c not in signs and
                  unicodedata.category(c) in ("Cc", "Cf", "Zl", "Zp")]
        self.assertGreater(len(hidden), 150)
        self.assert_usage(["".join(f"\\x{byte:02x}" for byte in "".join(hidden).encode())],
                          "".join(hidden))
        shown = "ä日本語 \u05d0\u0627\U0001f9ea\ufe0f¡ÿ\u0301\u0600"
        self.assert_usage([shown], shown)

    def test_unknown_option(self):
        for command in (["scan"], ["compare"], ["devices"], ["database", "info"], ["database", "write", "x"],
                        ["verify"], ["slices", "--out", "x"]):
            with self.subTest(command):
                self.assert_usage(["--colour"], *command, "--colour")
        self.assert_usage(["stray"], "scan", "stray")

    def test_missing_value(self):
        self.assert_usage(["--out"], "slices")
        self.assert_usage(["directory"], "database", "write")
        self.assert_usage(["--select"], "scan", "--select")


class ScanOptions(Case):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 2)

    def assert_usage(self, words, *options):
        with self.subTest(options):
            self.assert_refused(USAGE, words, "scan", "--database", "db", "--out", "out", *options)

    def test_metrics(self):
        self.assert_usage(["--metrics", "found 1", "2 metrics"], "--metrics", "rmse")
        self.assert_usage(["--metrics", "found 3", "2 metrics"],
                          "--metrics", "rmse,cwcbrt,pawcielab")
        self.assert_usage(["--metrics", "rmse", "twice"], "--metrics", "rmse,rmse")
        for gap in "rmse,", ",rmse", "rmse,,cwcbrt", "":
            self.assert_usage(["--metrics", "empty"], "--metrics", gap)
        known = "nbrdf-loss, ngan, nielsen-log, paw-ciede2000, pawcielab, rmse, sun-log2"
        self.assert_usage(["rmsee", known], "--metrics", "rmsee,rmse")
        self.assert_usage(["RMSE"], "--metrics", "cwcbrt,RMSE")

    def test_a_table_or_a_database(self):
        for other in ["--database", "db"], ["--device", "0"], ["--memory", "1G"], ["--fast"]:
            with self.subTest(other):
                self.assert_refused(USAGE, ["--distances", other[0]], "scan", "--out", "out",
                                    "--distances", "t.csv", *other)

    def test_numbers(self):
        for option in "--select", "--per-material", "--disagreements", "--threads":
            for value in "many", "1.5", "1e3", "0x10", "+1", " 1", "1 ", "1_000", "1'000":
                self.assert_usage([option, value], option, value)
        for option in "--select", "--per-material", "--threads":
            for value in "-1", "99999999999999999999":
                self.assert_usage([option, value], option, value)
        self.assert_usage(["--threads", "0"], "--threads", "0")

    def test_memory(self):
        for value in ("lots", "1X", "", "1.5.5M", "20E", "0x100000", "1.5G", "M", "1MM", "1 M",
                      "-1G", "16E", "18014398509481984K"):
            self.assert_usage(["--memory"], "--memory", value)
        # Two materials' blocks of 12 KiB under two metrics are 48K already.
        for value in "0", "1K", "1", "47K":
            self.assert_usage(["--memory", "too small", "at least"], "--memory", value)

    def test_negative_64_bit_numbers(self):
        self.assert_usage(["--disagreements", "-1"], "--disagreements", "-1")
        self.assert_usage(["--memory", "-1"], "--memory", "-1")

    def test_empty_numbers(self):
        for option in "--select", "--per-material", "--disagreements", "--threads":
            self.assert_usage([option], option, "")

    def test_numbers_with_leading_zeros_are_decimal(self):
        results = self.scan("--database", "db", "--select", "010", "--memory", "008M")
        options = support.read_json(results / "summary.json")["options"]
        self.assertEqual((options["select"], options["memory_bytes"]), (10, 8 << 20))

    def test_too_large_64_bit_numbers(self):
        for option in "--disagreements", "--memory":
            self.assert_usage([option], option, "99999999999999999999")

    # As "$RESULTS" is when the shell has no such variable.

    def test_empty_out(self):
        self.assert_refused(USAGE, ["--out"], "scan", "--database", "db", "--out", "")
        self.assert_refused(USAGE, ["--out"], "slices", "--out", "")
        self.assert_refused(USAGE, ["directory"], "database", "write", "")

    def test_empty_database(self):
        for command in ["scan"], ["slices", "--out", "out"]:
            self.assert_refused(USAGE, ["--database"], *command, "--database", "")
        self.assert_refused(USAGE, ["path"], "database", "info", "")


if __name__ == "__main__":
    support.main()
