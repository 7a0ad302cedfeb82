"""compare.html in a real browser, opened as a file: without a network, an error or a surprise."""

import os
import random
import unittest

import support
from browser import CHROMIUM, Browser
from support import Case, read_csv
from tables import write_table

HOSTILE = ["</script><script>document.title='hit'</script>", "<img src=x onerror=alert(1)>",
           "<!--<script>", '"><b>bold</b>', "a&amp;b", "\u202eleft\u2028", "%DATA%"]


class Page(Case):
    @classmethod
    def setUpClass(cls):
        if CHROMIUM is None:
            raise AssertionError("there is no chromium; scripts/setup.sh installs it")
        cls.browser = cls.enterClassContext(Browser())

    def show(self, *options, **window):
        self.assert_success("compare", "--out", "out", "--force", *options)
        self.page = self.work / "out" / "compare.html"
        self.browser.open(self.page, **window)

    def make_table(self, metrics, materials, value=None):
        numbers = random.Random(2)
        return write_table(self.work / "t.csv", metrics, materials,
                           value or (lambda _: numbers.lognormvariate(0, 1)))

    def assert_calm(self):
        self.assertEqual(self.browser.complaints(), [])
        self.assertEqual(self.browser.requests(), [self.page.resolve().as_uri()])

    def rows(self):
        """compare.csv as dictionaries."""
        header, rows = read_csv(self.work / "out" / "compare.csv")
        return [dict(zip(header, row)) for row in rows]

    def shown(self):
        """The names that stand at the axes."""
        return self.browser.run("[...document.querySelectorAll('#plot .axis')].map(t => t.textContent)")

    def test_the_matrix_has_the_numbers_of_the_table(self):
        self.make_table(["x", "y", "z"], "abcdefgh")
        self.show("--distances", "t.csv")
        cells = self.browser.run("[...document.querySelectorAll('#matrix tbody tr')].map("
                                 "r => [...r.querySelectorAll('td')].map(d => d.textContent))")
        names = ["x", "y", "z"]
        for row in self.rows():
            i, j = names.index(row["metric_1"]), names.index(row["metric_2"])
            self.assertEqual(cells[i][j], f"{100 * float(row['rate']):.1f} %")
            self.assertEqual(cells[j][i], f"{float(row['tau_b']):.3f}".replace("-", "−"))
        # It begins with the two that disagree most.
        most = max(self.rows(), key=lambda row: float(row["rate"]))
        self.assertEqual(self.shown(), [most["metric_1"], most["metric_2"]])
        first = self.browser.text("#strongest li")
        for name in most["left_1"], most["left_2"], most["right_1"], most["right_2"]:
            self.assertIn(name, first)
        self.assert_calm()

    def test_axes_can_be_chosen(self):
        self.make_table(["x", "y", "z"], "abcdefgh")
        self.show("--distances", "t.csv")

        def select(which, value):
            self.browser.run(f"(s => {{ s.value = {value}; s.dispatchEvent(new Event('change')); }})"
                             f"(document.getElementById('{which}'))")

        def picture():
            return self.browser.run("document.querySelector('#plot canvas').toDataURL()")

        select("first", 0)
        select("second", 1)
        self.assertEqual(self.shown(), ["x", "y"])
        before = picture()
        select("second", 2)
        self.assertEqual(self.shown(), ["x", "z"])
        self.assertNotEqual(picture(), before)
        row = next(r for r in self.rows() if (r["metric_1"], r["metric_2"]) == ("x", "z"))
        self.assertIn(row["disagreements"], self.browser.text("#numbers"))
        select("first", 2)  # both would be z: they change places
        self.assertEqual(self.shown(), ["z", "x"])
        self.assertIn(row["disagreements"], self.browser.text("#numbers"))
        self.assertEqual(self.browser.run("first.value + second.value"), "20")
        self.assert_calm()

    def test_the_left_pair_has_the_smaller_distance_across(self):
        self.make_table(["x", "y"], "abcdefgh")
        self.show("--distances", "t.csv")
        for turn in 0, 1:
            self.browser.run(f"choose({turn}, {1 - turn})")
            ends = self.browser.run("[...document.querySelectorAll('#plot g')].map(g => "
                                    "[...g.querySelectorAll('circle')].map(c => [+c.getAttribute('cx'), +c.getAttribute('cy')]))")
            self.assertEqual(len(ends), self.browser.run("document.querySelectorAll('#strongest li').length"))
            for left, right in ends:
                self.assertLess(left[0], right[0])
                self.assertLess(left[1], right[1])  # downwards

    def test_keyboard(self):
        self.make_table(["x", "y", "z"], "abcdefgh")
        self.show("--distances", "t.csv")
        self.browser.run("choose(0, 1)")
        stops = self.browser.run("[...document.querySelectorAll('#matrix button')]"
                                 ".filter(b => b.tabIndex === 0).map(b => b.getAttribute('aria-label'))")
        self.assertEqual(len(stops), 1)
        self.browser.run("cells[0][1].focus()")
        for key, label in ("ArrowRight", "x and z"), ("ArrowDown", "y and z"), \
                ("ArrowDown", "y and z"), ("ArrowLeft", "y and x"):
            self.browser.press(key)
            self.assertIn(label, self.browser.run("document.activeElement.getAttribute('aria-label')"))
        self.browser.press("Enter")
        self.assertEqual(self.shown(), ["y", "x"])
        self.browser.run("document.querySelectorAll('#strongest button')[1].focus()")
        self.assertEqual(self.browser.run("[...document.querySelectorAll('#strongest button')]"
                                          ".findIndex(b => b.getAttribute('aria-pressed') === 'true')"), 1)
        unnamed = self.browser.run("[...document.querySelectorAll('select')].filter(s => !s.labels.length).length")
        self.assertEqual(unnamed, 0)
        self.assert_calm()

    def test_names_are_text(self):
        self.make_table(["<i>m</i>", "</script><script>document.title='hit'</script>",
                         "\u202ereversed"], HOSTILE)
        self.show("--distances", "t.csv")
        self.assertEqual(self.browser.run("document.title"), "Reflectance metrics compared")
        self.assertEqual(self.browser.run("document.querySelectorAll('img, i, #strongest b b').length"), 0)
        self.assertEqual(self.browser.run("data.materials"),
                         [support.visible(name) for name in sorted(HOSTILE, key=str.encode)])
        self.assertEqual(self.browser.text("#matrix tbody th"), "<i>m</i>")
        self.assertIn(support.visible("\u202ereversed"),
                      self.browser.run("document.body.innerText"))
        self.assertNotIn("\u202e", self.browser.run("document.body.innerText"))
        self.assertIn("<img src=x onerror=alert(1)>", self.browser.run("document.body.innerText"))
        self.assert_calm()

    def test_nothing_can_be_sent_or_fetched(self):
        self.make_table(["x", "y"], "abc")
        self.show("--distances", "t.csv")
        refused = self.browser.run(
            "new Promise(done => { document.addEventListener('securitypolicyviolation', "
            "e => done(e.effectiveDirective)); fetch('https://example.org/').catch(() => {}); })")
        self.assertEqual(refused, "connect-src")
        self.assertNotEqual(self.browser.complaints(), [])  # and the other tests would see it

    def test_a_small_window(self):
        self.make_table([f"a-rather-long-metric-name-{i}" for i in range(12)], "abcdefgh")
        self.show("--distances", "t.csv", width=360, height=640)
        self.assertLessEqual(self.browser.run("document.documentElement.scrollWidth"), 360)
        self.assertGreater(self.browser.run("document.getElementById('plot').clientWidth"), 280)
        self.assert_calm()

    def test_marked_pairs_are_named_inside_the_plot(self):
        self.make_table(["x", "y"], [f"a-name-of-{'x' * (3 * i)}" for i in range(8)])
        for width in 1200, 390:
            self.show("--distances", "t.csv", width=width)
            for rank in range(self.browser.run("document.querySelectorAll('#strongest button').length")):
                self.browser.run(f"mark({rank})")
                outside = self.browser.run(
                    "(() => { const p = document.getElementById('plot').getBoundingClientRect();"
                    "return [...document.querySelectorAll('#plot .name')].map(t => t.getBoundingClientRect())"
                    ".filter(b => b.right > p.right || b.top < p.top || b.bottom > p.bottom).length; })()")
                self.assertEqual(outside, 0)
            self.assertEqual(self.browser.run("document.querySelectorAll('#plot .name').length"), 2)

    def test_the_worst_triple(self):
        (self.work / "t.csv").write_text("material_1,material_2,x,<i>y</i>\na,b,1,1\na,<b>c</b>,9,1\n"
                                         "b,<b>c</b>,4,1\n")
        self.show("--distances", "t.csv")
        cards = self.browser.run("[...document.querySelectorAll('#metrics article')].map(a => a.textContent)")
        self.assertIn("Triangle inequality: fails in 1 of 3 triples, most by a factor of 1.8: "
                      "<b>c</b> | a 9 > 4 + 1 through b", cards[0])
        self.assertIn("Triangle inequality: holds in all of 3 triples", cards[1])
        self.assert_calm()

    def test_many_pairs_are_drawn_by_lot(self):
        self.make_table(["x", "y"], [f"m{i:03}" for i in range(150)])
        self.show("--distances", "t.csv")
        self.assertIn("10,000 of 11,175 pairs are drawn", self.browser.text("#note"))
        self.assertEqual(self.browser.run("points.length"), 10000)
        self.assertEqual(self.browser.run("new Set(data.shown).size"), 10000)
        # A point is called by the names of its own pair.
        pair = self.browser.run("pairAt(data.shown[9999])")
        index = pair[0] * (2 * 150 - pair[0] - 1) // 2 + pair[1] - pair[0] - 1
        self.assertEqual(index, self.browser.run("data.shown[9999]"))
        _, rows = read_csv(self.work / "out" / "distances.csv")
        self.assertAlmostEqual(float(rows[index][2]), self.browser.run("data.values[0][9999]"), 4)
        self.assert_calm()

    def test_pointing_at_a_pair_names_it(self):
        self.make_table(["x", "y"], ["copper", "felt", "teflon"])
        self.show("--distances", "t.csv")
        x, y, pair = self.browser.run(
            "(() => { plot.scrollIntoView(); const b = plot.getBoundingClientRect(), p = points[0];"
            " return [b.x + p[0], b.y + p[1], pairName(pairAt(p[2]))]; })()")
        self.browser.point_at(x, y)
        self.browser.draw()
        self.assertFalse(self.browser.run("tip.hidden"))
        self.assertIn(pair, self.browser.text("#tip"))
        self.assert_calm()

    def test_zeros_ties_and_nothing_to_say(self):
        self.warns = True  # of a column that is zero
        self.make_table(["zero", "same", "one"], "abcd",
                        lambda metric: {"zero": 0, "same": 2.5, "one": 1e300}[metric])
        self.show("--distances", "t.csv")
        self.assertIn("6 pairs with a distance of 0", self.browser.text("#note"))
        self.assertIn("never disagree", self.browser.text("#strongest"))
        self.assertIn("tau-b undefined", self.browser.text("#numbers"))
        self.browser.run("choose(1, 2)")
        self.assertEqual(self.browser.text("#note"), "")
        self.assert_calm()
        ends = iter([5e-324, 1.7976931348623157e308, 1e-310, 1, 3.1, 3.2])
        self.make_table(["x", "y"], "abc", lambda _: next(ends))
        self.show("--distances", "t.csv")
        self.assertEqual(self.browser.run("points.length"), 3)
        self.assert_calm()
        self.make_table(["x", "y"], "ab")  # one pair
        self.show("--distances", "t.csv")
        self.assert_calm()

    def test_computed_metrics_are_explained(self):
        support.write_database(self.work / "db", 5)
        self.show("--database", "db", "--metrics", "cwcbrt,rmse")
        cards = self.browser.text("#metrics")
        for words in "Root mean square error", "Ryman 2018, equation 2.11", "theta_i", "Fores":
            self.assertIn(words, cards)
        self.assertIn("MERL directory", self.browser.text("#facts"))
        self.assertIn("Triangle inequality: holds, by proof.", cards)
        self.assert_calm()


if __name__ == "__main__":
    unittest.main(verbosity=2)
