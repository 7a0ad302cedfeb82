"""Distances from elsewhere: merl-scan scan on a table instead of a database."""

import random

import reference
import support
from support import INPUT, USAGE, Case, read_csv, read_json, write_database
from tables import write_rows, write_table


class Tables(Case):
    def setUp(self):
        super().setUp()
        self.random = random.Random(4)

    def number(self, _):
        return self.random.lognormvariate(0, 1)

    def assert_decisions(self, results, pairs):
        ranked = reference.disagreements(pairs)
        rows = read_csv(results / "disagreements.csv")[1]
        self.assertEqual(
            [row[:4] + [float(x) for x in row[4:]] for row in rows],
            [[*l[:2], *r[:2], l[2], r[2], l[3], r[3], agreement] for l, r, agreement in ranked])
        chosen = reference.selection(ranked, 100, 10)
        self.assertEqual([row[1:5] for row in read_csv(results / "selection.csv")[1]],
                         [[*l[:2], *r[:2]] for l, r, _ in chosen])
        self.assertEqual(read_json(results / "summary.json")["disagreements"], len(ranked))

    def test_two_columns(self):
        names = ["chrome", "=1+1", 'a "quoted", name', "ä", "Z"]
        pairs = write_table(self.work / "t.csv", ["net", "image"], names, self.number)
        results = self.scan("--distances", "t.csv")
        self.assert_decisions(results, pairs)
        header, rows = read_csv(results / "pairs.csv")
        self.assertEqual(header, ["material_1", "material_2", "net", "image"])
        self.assertEqual([(*r[:2], float(r[2]), float(r[3])) for r in rows], pairs)
        summary = read_json(results / "summary.json")
        self.assertEqual(summary["distances"]["file"], "t.csv")
        self.assertRegex(summary["distances"]["content_hash"], "^[0-9a-f]{32}$")
        self.assertEqual((summary["exact"], summary["undecided_in_float32"]), (True, 0))
        for absent in "database", "device", "samples_per_material":
            self.assertNotIn(absent, summary)

    def test_named_columns(self):
        write_table(self.work / "t.csv", ["x", "y", "z"], "abcdef", self.number)
        _, rows = read_csv(self.work / "t.csv")
        results = self.scan("--distances", "t.csv", "--metrics", "z,x")
        pairs = sorted((*sorted(row[:2]), float(row[4]), float(row[2])) for row in rows)
        self.assert_decisions(results, pairs)
        self.assertEqual(read_json(results / "summary.json")["metrics"], ["z", "x"])

        def refuse(status, words, *options):
            self.assert_refused(status, words, "scan", "--distances", "t.csv", "--out", "new",
                                *options)

        refuse(USAGE, ["found 3", "2 metrics"])
        refuse(USAGE, ["found 3", "2 metrics"], "--metrics", "all")
        refuse(USAGE, ["found 1", "2 metrics"], "--metrics", "x")
        refuse(INPUT, ["t.csv", "\"w\"", "x, y, z"], "--metrics", "x,w")

    def test_ties(self):
        pairs = write_table(self.work / "t.csv", ["x", "y"], "abcdefgh",
                            lambda _: self.random.randrange(1, 5))
        self.assert_decisions(self.scan("--distances", "t.csv"), pairs)

    def test_the_pairs_of_a_scan_give_its_decisions(self):
        write_database(self.work / "db", 9)
        computed = self.scan("--database", "db", out="computed")
        read = self.scan("--distances", computed / "pairs.csv", out="read")
        for name in "disagreements.csv", "selection.csv":
            self.assertEqual((computed / name).read_bytes(), (read / name).read_bytes())

    def test_what_is_printed(self):
        write_table(self.work / "t.csv", ["x", "y"], "abcd", self.number)
        output = self.assert_success("scan", "--distances", "t.csv", "--out", "out")
        self.assertRegex(output, r"(?m)^distances +t\.csv")
        self.assertRegex(output, r"(?m)^materials +4$")
        self.assertNotRegex(output, r"(?m)^(device|database|refined)")

    def test_forms_of_the_same_table(self):
        """What spreadsheets and data frames make of a table is the table."""
        names = "abcde"
        pairs = write_table(self.work / "t.csv", ["x", "y"], names, self.number)
        expected = (self.scan("--distances", "t.csv") / "selection.csv").read_bytes()
        comma = lambda number: str(number).replace(".", ",")
        forms = {
            "german.csv": "\ufeffmaterial_1;material_2;x;y;;\r\n" + "".join(
                f"{b};{a};{comma(x)};{comma(y)};;\r\n;;;;;\r\n" for a, b, x, y in pairs),
            "pandas.csv": ",material_1,material_2,x,y\n" + "".join(
                f"{i},{a},{b},{x},{y}\n" for i, (a, b, x, y) in enumerate(pairs)),
            "both.csv": "material_a,material_b,x,y\n" + "".join(
                f"{a},{b},{x},{y}\n{b},{a},{x},{y}\n{a},{a},0,0.0\n" for a, b, x, y in pairs),
        }
        for name, text in forms.items():
            with self.subTest(name):
                (self.work / name).write_text(text, encoding="utf-8")
                results = self.scan("--distances", name, out=f"of-{name}")
                self.assertEqual((results / "selection.csv").read_bytes(), expected)
        # A matrix of one metric, which is called what its file is.
        x = {(a, b): x for a, b, x, _ in pairs}
        rows = [[a, *(x.get((a, b), x.get((b, a), 0)) for b in names)] for a in names]
        write_rows(self.work / "x.csv", ["", *names], rows)
        write_rows(self.work / "said.csv", ["reference", "a", "b", "votes_a", "votes_b"],
                   [["a", "b", "c", 3, 1], ["d", "e", "c", 2, 5], ["b", "e", "a", 1, 0]])
        scores = []
        for table in "t.csv", "x.csv":
            self.assert_success("score", "--judgements", "said.csv", "--distances", table,
                                "--metrics", "x", "--out", f"score-of-{table}")
            scores.append((self.work / f"score-of-{table}" / "score.csv").read_bytes())
        self.assertEqual(*scores)

    def test_tables_that_are_wrong(self):
        header = "material_1,material_2,x,y\n"
        for text, words in (
            ("", ["is empty"]),
            (header, ["line 1", "no pair"]),
            (header + "a,b,1,2\nb,c,1,2\n", ["missing", '"a" and "c"']),
            (header + "a,b,1,2\nb,a,1,3\n", ["line 3", "found 3", "2 in line 2"]),
            (header + "a,b,1,5,2\n", ["line 2", "5 fields", "decimal comma"]),
            (header.replace(",", ";") + "a;b;1,5;2.5\n", ["line 2", "one decimal mark"]),
            (header + "a,a,1,2\n", ["line 2", "itself"]),
            (header + "a,b,nan,2\n", ["line 2", "x", "nan"]),
            (header + "a,b,1,-2\n", ["line 2", "y", "-2"]),
            (header + "a,b,1\n", ["line 2", "3 fields"]),
            (header + "a,\x1b[31m,1\n", ["line 2"]),
            ("<html>\n", ["line 1", "material_1"]),
        ):
            with self.subTest(text):
                (self.work / "t.csv").write_text(text)
                self.assert_refused(INPUT, ["t.csv", *words], "scan", "--distances", "t.csv",
                                    "--out", "out")
        self.assert_refused(INPUT, ["absent.csv"], "scan", "--distances", "absent.csv",
                            "--out", "out")


if __name__ == "__main__":
    support.main()
