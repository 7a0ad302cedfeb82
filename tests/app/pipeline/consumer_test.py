"""A program that links the pipeline computes what merl-scan computes."""

import os
import subprocess

import support
from support import Case, read_csv, write_database


class Consumer(Case):
    def run_consumer(self, *arguments):
        return subprocess.run([os.environ["CONSUMER"], *arguments], cwd=self.work, text=True,
                              capture_output=True, check=False)

    def test_a_distance(self):
        write_database(self.work / "db", 4)
        self.assert_success("compare", "--database", "db", "--metrics", "cwcbrt,pawcielab", "--out",
                            "out")
        header, rows = read_csv(self.work / "out" / "distances.csv")
        result = self.run_consumer("db")
        self.assertEqual(result.stderr, "")
        names, value = result.stdout.split(": ")
        first = rows[0]
        self.assertEqual(names, f"{first[0]}, {first[1]}")
        self.assertEqual(float(value), float(first[header.index("pawcielab")]))

    def test_a_database_that_is_missing(self):
        result = self.run_consumer("nowhere")
        self.assertEqual((result.returncode, result.stdout), (1, ""))
        self.assertIn("nowhere", self.only_line(result.stderr))


if __name__ == "__main__":
    support.main()
