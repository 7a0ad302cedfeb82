"""The page of a kit in a real browser, opened as a file: a whole experiment, and nothing lost."""

import json
import pathlib
import random
import shutil
import subprocess
import tempfile
import time

import support
from browser import CHROMIUM, Browser
from support import PROGRAM, Case, read_csv, read_json, samples, write_database

HOSTILE = ["</script><script>document.title='hit'</script>".replace("/", "\u2215"),
           "=HYPERLINK(\"x\")", "<img src=x onerror=alert(1)>", "<!--<script>", "a,b\"c", "%DATA%",
           "line\nbreak", "å&amp;"]


class Page(Case):
    @classmethod
    def setUpClass(cls):
        if CHROMIUM is None:
            raise AssertionError("there is no chromium; scripts/setup.sh installs it")
        cls.kits = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        write_database(cls.kits / "db", {name: samples(i) for i, name in enumerate(HOSTILE)})
        cls.program("scan", "--database", "db", "--select", "5", "--out", "results", "--quiet")
        cls.make_kit("kit")

    @classmethod
    def program(cls, *arguments):
        subprocess.run([PROGRAM, *arguments], cwd=cls.kits, check=True)

    @classmethod
    def make_kit(cls, out, *options):
        cls.program("judge", "--selection", "results/selection.csv", "--database", "db", "--size",
                    "48", "--sentinels", "1", "--random", "2", "--repeats", "40", "--out", out,
                    "--quiet", *options)

    def setUp(self):
        super().setUp()
        self.browser = self.enterContext(Browser())  # with a storage of its own
        self.page = self.kits / "kit" / "index.html"
        self.browser.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(self.work))

    def show(self, kit="kit", **window):
        self.page = self.kits / kit / "index.html"
        self.kit = read_json(self.kits / kit / "kit.json")
        self.browser.open(self.page, **window)

    def until(self, expression, seconds=20):
        end = time.monotonic() + seconds
        while not (value := self.browser.run(expression)):
            self.assertLess(time.monotonic(), end, expression)
            time.sleep(0.02)
        return value

    def screen(self):
        return self.browser.run("[...document.querySelectorAll('main')].find(m => !m.hidden).id")

    def press(self, key):
        """Presses a key when a configuration can be seen."""
        self.until("turning !== null")
        self.browser.press(key)

    def begin(self, name="anna"):
        self.browser.run("document.querySelector('[data-language=en]').click()")
        self.browser.run("document.querySelector('#name').focus()")
        self.browser.call("Input.insertText", text=name)
        self.browser.press("Enter")
        self.press("3")
        self.assertEqual(self.screen(), "ready")
        self.assertIn("right side is smaller", self.browser.text("#readyText"))
        self.browser.press("Enter")
        self.assertEqual(self.screen(), "trial")

    def download(self, button, name):
        self.browser.run(f"document.querySelector('{button}').click()")
        path, end = self.work / name, time.monotonic() + 20
        while not path.exists():
            self.assertLess(time.monotonic(), end, list(self.work.iterdir()))
            time.sleep(0.05)
        time.sleep(0.1)
        header, rows = read_csv(path)
        path.rename(self.work / f"saved-{name}")  # the browser would number the next one
        return [dict(zip(header, row, strict=True)) for row in rows]

    def assert_calm(self):
        self.assertEqual(self.browser.complaints(), [])
        outside = [url for url in self.browser.requests() if not url.startswith(("data:", "blob:"))]
        self.assertEqual(outside, [self.page.resolve().as_uri()])
        self.assertEqual(self.browser.run("document.title"), "Which spheres change less?")

    def assert_rows_are_of_the_kit(self, rows):
        """Each row is a trial of kit.json, once, on the sides that `swapped` says."""
        trials = {(str(t["configuration"]), t["kind"]): t for t in self.kit["trials"]}
        self.assertEqual([row["trial"] for row in rows], [str(i + 1) for i in range(len(trials))])
        for row in rows:
            trial = trials.pop((row["configuration"], row["kind"]))
            sides = [trial["left"], trial["right"]]
            if row["swapped"] == "1":
                sides.reverse()
            shown = [[row["left_1"], row["left_2"]], [row["right_1"], row["right_2"]]]
            self.assertEqual([sorted(side) for side in shown], [sorted(side) for side in sides])
            self.assertEqual((row["seed"], row["kit_hash"]), ("1", self.kit["kit_hash"]))
        self.assertEqual(trials, {})

    def test_a_whole_experiment_by_keyboard(self):
        self.show()
        count = len(self.kit["trials"])
        self.assertIn(f"{count} configurations", self.browser.text("#start"))
        self.begin()
        numbers = random.Random(1)
        votes = [numbers.choice("123") for _ in range(count)]
        for place, vote in enumerate(votes[:count // 2]):
            self.assertEqual(self.browser.text("#place"), f"{place + 1} / {count}")
            self.press(vote)
        # In the middle the page is closed and opened again.
        before = self.browser.run("JSON.stringify(judge)")
        self.browser.open(self.page)
        self.assertEqual(self.screen(), "trial")
        self.assertEqual(self.browser.run("JSON.stringify(judge)"), before)
        for vote in votes[count // 2:]:
            self.assertEqual(self.screen(), "trial")
            self.press(vote)
        self.assertEqual(self.screen(), "survey")
        for question, answer in (("instructions_clear", "no"), ("keys_easy", "5")):
            self.browser.run(f"document.querySelector('[name={question}][value=\"{answer}\"]').click()")
        self.browser.run("document.querySelector('textarea').focus()")
        comment = "=cmd|' /C calc'!A0, \"quoted\" <script>alert(1)</script>"
        self.browser.call("Input.insertText", text=comment)
        self.browser.open(self.page)  # once more
        self.assertEqual(self.browser.run("document.querySelector('textarea').value"), comment)
        self.browser.run("document.querySelector('#questions button').click()")
        self.assertEqual(self.screen(), "done")
        rows = self.download("#saveVotes", "votes-anna.csv")
        self.assert_rows_are_of_the_kit(rows)
        self.assertEqual([row["vote"] for row in rows], votes)
        self.assertEqual({row["judge"] for row in rows}, {"anna"})
        for row in rows:
            self.assertLess(int(row["response_ms"]), 60000)
        survey = {row["question"]: row["answer"]
                  for row in self.download("#saveSurvey", "survey-anna.csv")}
        self.assertEqual(survey, {
            "instructions_clear": "no", "change_clear": "", "preferred_question": "", "frequency": "",
            "sphere_size": "", "keys_easy": "5", "vision_impairment": "", "comments": "'" + comment})
        self.assert_calm()
        # What the page saved is what `votes` reads.
        self.assert_success("votes", "saved-votes-anna.csv", "--selection",
                            self.kits / "results" / "selection.csv", "--kit",
                            self.page.parent / "kit.json", "--survey", "saved-survey-anna.csv",
                            "--out", "analysis")
        judge = read_json(self.work / "analysis" / "summary.json")["figures"]["judges"][0]
        self.assertEqual((judge["judge"], judge["missing"]), ("anna", 0))
        sides = [4 - int(row["vote"]) if row["swapped"] == "1" else int(row["vote"])
                 for row in rows if row["kind"] == "selection"]
        self.assertEqual(judge["votes"], [sides.count(side) for side in (1, 2, 3)])

    def test_votes_go_back_and_forth_and_download_at_any_time(self):
        self.show()
        self.begin()
        for key in "1", "ArrowDown", "2":  # the second is left out
            self.press(key)
        rows = self.download("#save", "votes-anna.csv")
        self.assert_rows_are_of_the_kit(rows)
        self.assertEqual([row["vote"] for row in rows[:4]], ["1", "", "2", ""])
        self.assertEqual(rows[1]["response_ms"], "")
        for _ in range(4):
            self.press("ArrowUp")  # no further than the first
        self.assertTrue(self.browser.text("#place").startswith("1 /"))
        self.assertEqual(self.browser.run("document.querySelector('[aria-pressed=true][data-vote]').dataset.vote"), "1")
        self.press("3")
        rows = self.download("#save", "votes-anna.csv")
        self.assertEqual([row["vote"] for row in rows[:4]], ["3", "", "2", ""])
        # At the end, what was left out comes before the questions.
        count = len(self.kit["trials"])
        self.press("ArrowDown")
        self.press("ArrowDown")
        for _ in range(count - 3):
            self.press("2")
        self.assertEqual(self.screen(), "trial")
        self.assertEqual(self.browser.text("#place"), f"2 / {count}")
        self.press("1")
        self.assertEqual(self.screen(), "survey")
        self.assert_calm()

    def test_alternation_shows_both_materials_of_each_side(self):
        self.show()
        self.begin()
        data = json.loads(self.browser.run("document.getElementById('data').textContent"))
        visible = ("JSON.stringify(['left', 'right'].map(id => [...document.querySelectorAll(`#${id} img`)]"
                   ".filter(i => getComputedStyle(i).visibility === 'visible').map(i => "
                   "images.findIndex(lights => i.src.endsWith(lights[0])))))")
        for _ in range(2):
            self.until("turning !== null")
            row = self.download("#save", "votes-anna.csv")[
                int(self.browser.text("#place").split()[0]) - 1]
            seen, start = [], time.monotonic()
            while time.monotonic() - start < 3.5:
                now = json.loads(self.browser.run(visible))
                self.assertEqual([len(side) for side in now], [1, 1])
                if not seen or seen[-1] != now:
                    seen.append(now)
                time.sleep(0.02)
            self.assertGreaterEqual(len(seen), 3)  # once a second
            self.assertLessEqual(len(seen), 5)
            names = [[data["materials"][side[0]] for side in pair] for pair in seen]
            shown = {json.dumps(pair) for pair in names}
            self.assertEqual(shown, {json.dumps([row["left_1"], row["right_1"]]),
                                     json.dumps([row["left_2"], row["right_2"]])})
            self.press("ArrowDown")
        # The images are those of different materials, and whole.
        self.assertTrue(self.until("[...document.querySelectorAll('.side img')].every(i => i.naturalWidth === 48)"))
        self.assert_calm()

    def test_every_judge_has_an_order_and_sides_of_their_own(self):
        self.show()
        orders = self.browser.run(
            "JSON.stringify(Array.from({length: 300}, (_, i) => orderFor('judge ' + i)))")
        orders = json.loads(orders)
        count = len(self.kit["trials"])
        for kind, values in (
            ("swapped", [o["swapped"] for order in orders for o in order]),
            ("turned", [t for order in orders for o in order for t in o["turned"]]),
        ):
            share = sum(values) / len(values)
            self.assertLess(abs(share - 0.5), 5 * 0.5 / len(values) ** 0.5, kind)
        first = [0] * count
        for order in orders:
            self.assertEqual(sorted(o["trial"] for o in order), list(range(count)))
            first[order[0]["trial"]] += 1
            places = {}
            for place, o in enumerate(order):
                trial = self.kit["trials"][o["trial"]]
                self.assertEqual(trial["kind"] == "repeat", trial["configuration"] in places)
                places[trial["configuration"]] = place
        for trial, times in zip(self.kit["trials"], first):
            self.assertEqual(trial["kind"] == "repeat", times == 0)
        self.assertEqual(json.loads(self.browser.run("JSON.stringify(orderFor('judge 0'))")), orders[0])

    def test_randomising_can_be_turned_off(self):
        self.make_kit("fixed", "--keep-order", "--keep-sides", "--keep-pairs")
        self.addCleanup(shutil.rmtree, self.kits / "fixed")
        self.show("fixed")
        self.begin()
        rows = self.download("#save", "votes-anna.csv")
        for row, trial in zip(rows, self.kit["trials"], strict=True):
            self.assertEqual((row["configuration"], row["kind"], row["swapped"]),
                             (str(trial["configuration"]), trial["kind"], "0"))
            self.assertEqual([row[c] for c in ("left_1", "left_2", "right_1", "right_2")],
                             trial["left"] + trial["right"])

    def test_judges_do_not_mix(self):
        self.show()
        self.begin()
        self.press("1")
        self.browser.run("document.querySelector('#nextJudge').click()")
        self.begin("  =bo\tb  ")
        self.press("2")
        rows = self.download("#save", "votes-bo_b.csv")
        self.assertEqual((rows[0]["judge"], rows[0]["vote"]), ("bo b", "2"))
        self.browser.run("document.querySelector('#nextJudge').click()")
        self.browser.call("Input.insertText", text="anna")
        self.assertIn("1 of", self.browser.text("#known"))
        self.browser.press("Enter")
        self.assertTrue(self.browser.text("#place").startswith("2 /"))
        rows = self.download("#save", "votes-anna.csv")
        self.assertEqual([rows[0]["vote"], rows[1]["vote"]], ["1", ""])
        self.assert_calm()

    def test_instructions_in_the_middle(self):
        self.show()
        self.begin()
        self.press("1")
        for way in "document.querySelector('#help').click()", None:
            if way:
                self.browser.run(way)
            else:
                self.press("?")
            self.assertEqual(self.screen(), "start")
            self.assertEqual(self.browser.run("document.querySelector('#name').value"), "anna")
            self.assertIn("1 of", self.browser.text("#known"))
            self.browser.press("3")  # is no vote here
            self.browser.press("Enter")
            self.assertTrue(self.browser.text("#place").startswith("2 /"))
        # Somebody else may begin; the first one goes on later.
        self.press("?")
        self.browser.run("document.querySelector('#name').value = ''")
        self.begin("bo")
        self.assertTrue(self.browser.text("#place").startswith("1 /"))
        self.press("?")
        self.browser.run("document.querySelector('#name').value = 'anna'")
        self.browser.press("Enter")
        self.assertEqual(self.browser.run("judge.votes.filter(v => v).length"), 1)
        self.assert_calm()

    def test_practice_says_what_was_to_be_seen(self):
        self.show()
        self.begin()
        self.assertIn("the answer was 1", self.browser.text("#practised"))
        self.browser.run("show('practice')")
        self.press("1")
        self.assertEqual(self.screen(), "ready")
        self.assertIn("So it was", self.browser.text("#practised"))
        practice = self.kit["practice"]
        self.assertEqual(practice["left"][0], practice["left"][1])

    def test_storage_that_is_full_or_broken(self):
        self.show()
        self.begin()
        self.press("1")
        self.browser.run("Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError') }")
        self.press("2")
        self.assertEqual(self.browser.run("document.getElementById('warning').hidden"), False)
        rows = self.download("#save", "votes-anna.csv")
        self.assertEqual([row["vote"] for row in rows[:3]], ["1", "2", ""])
        self.press("?")  # the instructions do not lose them either
        self.assertTrue(self.browser.run("document.querySelector('#name').readOnly"))
        self.browser.press("Enter")
        self.assertEqual(self.browser.run("judge.votes.filter(v => v).length"), 2)
        # What was stored before is there; what is no judge of this kit is not taken for one.
        self.browser.open(self.page)
        self.assertEqual(self.browser.run("judge.votes.filter(v => v).length"), 1)
        for broken in "{", "null", "[]", '{"name":"anna"}', '{"name":"anna","order":[],"votes":[]}':
            self.browser.run(f"localStorage.setItem(prefix + 'judge:anna', {json.dumps(broken)})")
            self.browser.open(self.page)
            self.assertEqual(self.screen(), "start")
        self.assert_calm()

    def test_touch_and_small_windows(self):
        for width, height in (320, 480), (568, 320), (1920, 1080):
            self.show(width=width, height=height)
            if self.screen() == "start":
                self.begin()
            self.until("turning !== null")
            inside = self.browser.run(
                "[...document.querySelectorAll('#trial button, .side div.now img')].every(e => {"
                "const b = e.getBoundingClientRect(); return b.left >= 0 && b.top >= 0 && b.width > 20 &&"
                "b.right <= innerWidth && b.bottom <= innerHeight; }) &&"
                "document.documentElement.scrollWidth <= innerWidth")
            self.assertTrue(inside, f"{width} x {height}")
        place = self.browser.text("#place")
        box = self.browser.run("(() => { const b = document.querySelector('[data-vote=\"2\"]')"
                               ".getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()")
        for kind, points in (("touchStart", [{"x": box[0], "y": box[1]}]), ("touchEnd", [])):
            self.browser.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        self.until(f"document.querySelector('#place').textContent !== {json.dumps(place)}")
        self.assertEqual(self.browser.run("judge.votes[0]"), 2)

    def test_spheres_of_several_lights_are_as_large_as_they_can_be(self):
        self.make_kit("two-lights", "--light", "1,1,1", "--light", "-1,1,1")
        for width, height, across in (390, 844, "1"), (1600, 500, "2"):
            self.show("two-lights", width=width, height=height)
            if self.screen() == "start":
                self.begin()
            self.until("turning !== null")
            self.assertEqual(self.browser.run("byId('left').style.getPropertyValue('--across')"), across)
        self.assert_calm()

    def test_swedish_says_everything(self):
        self.show()
        self.assertEqual(self.browser.run("Object.keys(texts.en).sort().join()"),
                         self.browser.run("Object.keys(texts.sv).sort().join()"))
        self.browser.run("document.querySelector('[data-language=sv]').click()")
        self.assertIn("Vilka sfärer", self.browser.text("#start h1"))
        self.browser.open(self.page)
        self.assertIn("Vilka sfärer", self.browser.text("#start h1"))
        self.assertEqual(self.browser.run("document.documentElement.lang"), "sv")


if __name__ == "__main__":
    support.main()
