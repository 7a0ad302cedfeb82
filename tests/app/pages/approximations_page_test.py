"""approximations.html in a real browser, opened as a file: its numbers, its spheres, and no surprise."""

import itertools
import random
import unittest

from browser import CHROMIUM, Browser
from support import SUCCESS, USAGE, Case, read_csv, read_json, samples, write_database
from tables import write_rows

HOSTILE = ["<script>document.title='hit'<\u2215script>", "<img src=x onerror=alert(1)>", '"><b>bold<\u2215b>', "a&amp;b",
           "\u202eleft\u2028", "%DATA%"]


class Page(Case):
    @classmethod
    def setUpClass(cls):
        if CHROMIUM is None:
            raise AssertionError("there is no chromium; scripts/setup.sh installs it")
        cls.browser = cls.enterClassContext(Browser())

    def write_table(self, originals, labels, metrics=("x", "y", "z"), value=None):
        """A table of distances of org/NAME from LABEL/NAME."""
        numbers = random.Random(3)
        value = value or (lambda *_: numbers.lognormvariate(0, 1))
        rows = [[f"org/{name}", f"{label}/{name}", *(value(name, label, m) for m in metrics)]
                for name in originals for label in labels]
        write_rows(self.work / "t.csv", ["material_1", "material_2", *metrics], rows)
        return "--distances", "t.csv", "--reference", "org"

    def show(self, *options, **window):
        result = self.run_program("scan", "--out", "out", "--force", *options)
        self.assertEqual(result.returncode, SUCCESS, result.stderr)
        self.page = self.work / "out" / "approximations.html"
        self.browser.open(self.page, **window)
        return result

    def assert_calm(self):
        self.assertEqual(self.browser.complaints(), [])
        requests = [address for address in self.browser.requests() if not address.startswith("data:image/png;")]
        self.assertEqual(requests, [self.page.resolve().as_uri()])

    def select(self, which, value):
        self.browser.run(f"(s => {{ s.value = {value}; s.dispatchEvent(new Event('change')); }})"
                         f"(document.getElementById('{which}'))")

    def cells(self, table):
        return self.browser.run(f"[...document.querySelectorAll('#{table} tbody tr')].map(r => "
                                "[...r.children].map(c => [...c.children].map(s => s.textContent)))")

    def rows(self):
        header, rows = read_csv(self.work / "out" / "approximations.csv")
        return [dict(zip(header, row)) for row in rows]

    def test_numbers(self):
        self.show(*self.write_table("abcdef", ["one", "three", "two"]))
        labels = ["one", "three", "two"]
        summary = read_json(self.work / "out" / "summary.json")
        best = self.browser.run("[...document.querySelectorAll('#best tbody tr')].map(r => "
                                "[...r.querySelectorAll('td')].map(d => [...d.children].map(s => s.textContent)))")
        for figures, row in zip(summary["ranks"], best):
            for label, (times, mean) in zip(labels, row):
                self.assertEqual((times, mean), (str(figures["labels"][label]["best"]),
                                                 f"{figures['labels'][label]['mean_rank']:.2f}"))
        different = self.browser.run("[...document.querySelectorAll('#different tbody tr')].map(r => "
                                     "[...r.querySelectorAll('td')].map(d => [...d.children].map(s => s.textContent)))")
        for comparison, (i, j) in zip(summary["comparisons"], itertools.combinations(range(3), 2)):
            for row, column in (i, j), (j, i):
                self.assertEqual(different[row][column][:2],
                                 [str(comparison["different_best"]), f"{100 * comparison['rate']:.1f} %"])
        for first, second in (0, 1), (2, 0):
            self.select("first", first)
            self.select("second", second)
            metric = "xyz"[first]
            names = self.browser.run("[...document.querySelectorAll('#originals tbody th span')].map(s => s.textContent)")
            self.assertEqual(sorted(names), list("abcdef"))
            by_name = {(r["original"], r["label"]): r for r in self.rows()}
            ranks = self.browser.run("[...document.querySelectorAll('#originals tbody tr')].map(r => "
                                     "[...r.querySelectorAll('td .rank')].map(s => s.textContent))")
            for name, row in zip(names, ranks):
                self.assertEqual([float(r) for r in row],
                                 [float(by_name[f"org/{name}", label][f"{metric}_rank"]) for label in labels])
        # The strongest disagreement of the first two metrics comes first.
        self.select("first", 0)
        self.select("second", 1)
        _, disagreements = read_csv(self.work / "out" / "disagreements.csv")
        self.assertEqual("org/" + self.browser.text("#originals tbody th span"), disagreements[0][0])
        self.assertIn(f"agreement {float(disagreements[0][-1]):.3g}", self.browser.text("#originals tbody th small"))
        self.assertIn("distances were read from a table", self.browser.text("#note"))
        self.assert_calm()

    def test_spheres(self):
        materials = {f"m{i}": samples(i) for i in range(5)}
        for label, scale in ("org", 1), ("fit", 1.5), ("other", 0.4):
            write_database(self.work / label, {name: [scale * x for x in numbers] for name, numbers in materials.items()})
        databases = [x for label in ("org", "fit", "other") for x in ("--database", label)]
        self.show(*databases, "--reference", "org", "--spheres", "2", "--metrics", "rmse,cwcbrt")
        images = self.browser.run("[...document.querySelectorAll('#originals tr')].map(r => "
                                  "[...r.querySelectorAll('img')].map(i => [i.alt, i.naturalWidth]))")
        shown = [row for row in images if row]
        self.assertEqual(len(shown), 2)
        for row in shown:
            name = row[0][0]
            self.assertEqual(row, [[name, 96], [f"{name} by fit", 96], [f"{name} by other", 96]])
        self.assertIn("Spheres are those of the 2 originals", self.browser.text("#note"))
        self.assert_calm()
        # Without a device, or where none was asked for, the page says so and the scan is whole.
        for options, words in ((("--spheres", "0"), "--spheres 0"), (("--device", "host"), "--device host")):
            self.show(*databases, "--reference", "org", "--metrics", "rmse,cwcbrt", *options)
            self.assertIn(words, self.browser.text("#note"))
            self.assertEqual(self.browser.run("document.querySelectorAll('img').length"), 0)
            self.assertEqual(len(self.rows()), 10)
            self.assert_calm()
        nothing = {"VK_ICD_FILENAMES": "/nowhere.json", "VK_DRIVER_FILES": "/nowhere.json"}
        result = self.run_program("scan", "--out", "out", "--force", *databases, "--reference", "org", "--metrics",
                                  "rmse,cwcbrt", **nothing)
        self.assertEqual(result.returncode, SUCCESS, result.stderr)
        self.browser.open(self.page)
        self.assertIn("There are no spheres: ", self.browser.text("#note"))
        self.assertEqual(len(self.rows()), 10)
        self.assert_calm()
        self.assert_refused(USAGE, ["--spheres", "--reference"], "scan", *databases, "--spheres", "3")

    def test_names_are_text(self):
        self.show(*self.write_table(HOSTILE, ["<b>fit<\u2215b>", "x'y"], ["<i>m</i>", "</script><script>alert(1)</script>"]))
        self.assertEqual(self.browser.run("document.title"), "Originals and their approximations")
        self.assertEqual(self.browser.run("document.querySelectorAll('img, i, b').length"), 0)
        text = self.browser.run("document.body.innerText")
        self.assertIn("<img src=x onerror=alert(1)>", text)
        self.assertNotIn("\u202e", text)
        self.assert_calm()

    def test_gaps_and_ties(self):
        write_rows(self.work / "t.csv", ["material_1", "material_2", "x", "y"],
                           [["org/a", "one/a", 1, 2], ["org/a", "two/a", 1, 1], ["org/b", "one/b", 3, 3],
                            ["org/c", "two/c", 0, 0]])
        self.show("--distances", "t.csv", "--reference", "org")
        self.assertEqual(self.browser.text("#originals tbody tr:last-child th small"), "one approximation")
        text = self.browser.text("#originals")
        self.assertEqual(text.count("none"), 2)
        self.assertIn("1.5", text)
        self.assertIn("1 in part, by ties", self.browser.text("#different"))
        self.assert_calm()

    def test_agreement_of_extremes(self):
        """Ties at 0, and products that float64 cannot hold: the order and the agreements of disagreements.csv."""
        values = {"zero-x": [(0, 1), (0, 4)], "zero-y": [(3, 0), (9, 0)], "none": [(0, 0), (0, 3)], "half": [(0, 2), (1, 1)],
                  "tiny": [(1e-200, 3e-200), (2e-200, 1e-200)], "huge": [(1e300, 2e300), (7e300, 1e300)],
                  "plain": [(1, 3), (2, 2)], "least": [(5e-324, 1e-323), (1e-323, 5e-324)], "most": [(1.7e308, 1), (1.6e308, 2)]}
        rows = [[f"org/{name}", f"{label}/{name}", *pair] for name, pairs in values.items()
                for label, pair in zip(("one", "two"), pairs)]
        write_rows(self.work / "t.csv", ["material_1", "material_2", "x", "y"], rows)
        self.show("--distances", "t.csv", "--reference", "org")
        _, disagreements = read_csv(self.work / "out" / "disagreements.csv")
        self.assertEqual(len(disagreements), len(values))
        shown = self.browser.run("[...document.querySelectorAll('#originals tbody th')].map(h => "
                                 "[h.querySelector('span').textContent, h.querySelector('small').textContent])")
        self.assertEqual(["org/" + name for name, _ in shown], [row[0] for row in disagreements])
        for (_, text), row in zip(shown, disagreements):
            self.assertEqual(float(text.split("agreement ")[1]), float(f"{float(row[-1]):.3g}"))
        self.assert_calm()

    def test_one_approximation(self):
        self.show(*self.write_table("ab", ["one"]))
        self.assertIn("nothing to disagree about", self.browser.text("#different-lead"))
        self.assertEqual(len(self.cells("originals")), 2)
        self.assert_calm()

    def test_windows(self):
        self.show(*self.write_table([f"a-rather-long-name-of-a-material-{i}" for i in range(12)],
                                    [f"approximation-{i}" for i in range(12)],
                                    [f"./my-metric.glsl:haze={i}:saturation=0.9313:gloss=0.1966" for i in range(5)]))
        for width in 1400, 1024, 390:
            self.browser.open(self.page, width=width, height=800)
            self.assertLessEqual(self.browser.run("document.documentElement.scrollWidth"), width)
        unnamed = self.browser.run("[...document.querySelectorAll('select')].filter(s => !s.labels.length).length")
        self.assertEqual(unnamed, 0)
        self.assert_calm()

    def test_many_originals(self):
        self.show(*self.write_table([f"m{i:04}" for i in range(1200)], ["one", "two", "three"]))
        self.assertEqual(self.browser.run("document.querySelectorAll('#originals tbody tr').length"), 500)
        self.assertIn("of 1,200 those with the strongest disagreements of x and y", self.browser.text("#note"))
        self.assert_calm()


if __name__ == "__main__":
    unittest.main(verbosity=2)
