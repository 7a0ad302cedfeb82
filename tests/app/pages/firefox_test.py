"""The pages in Firefox, with real keys, mouse and fingers: a whole study that is sent and saved, a kit without a study
file, the page of the votes."""

import math
import time

import support
from firefox import FIREFOX, Firefox
from judge_page_test import PageCase
from study_page_test import StudyCase, order_of, receiving
from support import SUCCESS, read_csv, read_json


class FirefoxCase(PageCase):
    @classmethod
    def setUpClass(cls):
        if FIREFOX is None:
            raise AssertionError("there is no firefox; scripts/setup.sh installs it")
        super().setUpClass()

    def start(self, speed=20):
        browser = self.enterContext(Firefox(self.work))
        browser.set_clock(speed)
        return browser

    def click(self, selector, point=None):
        """When it is not the second half of a double click any more; with the mouse, or `point`."""
        self.browser.draw()  # what was typed into scrolls into view by itself, in the next frame
        self.browser.run(f"document.querySelector(`{selector}`).scrollIntoView({{block: 'center'}})")
        self.until("performance.now() - changedAt > secondClick")
        (point or self.browser.click)(selector)

    def tap(self, selector):
        self.click(selector, self.browser.tap)

    def write(self, selector, text):
        self.click(selector)
        self.browser.type(text)

    def name(self, name):
        self.until_screen("start")
        self.write("#name", name)
        self.browser.press("Enter")

    def slide(self, slider, value):
        """Moves a slider with the arrow keys."""
        self.browser.run(f"byId('{slider}').focus()")
        steps = value - int(self.browser.run(f"byId('{slider}').value"))
        self.browser.press("ArrowRight" if steps > 0 else "ArrowLeft", times=abs(steps))
        self.assertEqual(self.browser.run(f"byId('{slider}').value"), str(value))

    def answer_by(self, way, digit):
        """Answers by 'keys', 'mouse' or 'touch', as soon as that can be done."""
        self.until("answerable")
        if way == "keys":
            self.step(lambda: self.browser.press(digit))
        else:
            self.step(lambda: (self.click if way == "mouse" else self.tap)(f"[data-vote='{digit}']"))

    def file(self, name):
        """A file that the page has saved, when it is whole."""
        path, end = self.work / name, time.monotonic() + 60
        while not path.exists() or path.stat().st_size == 0 or path.with_name(name + ".part").exists():
            self.assertLess(time.monotonic(), end, list(self.work.iterdir()))
            time.sleep(0.02)
        return path

    def assert_calm(self, *requested):
        self.assertEqual(self.browser.complaints(), [])
        outside = [url for url in self.browser.requests() if not url.startswith(("data:", "blob:", "file:"))]
        self.assertEqual(outside, list(requested))
        self.assertEqual(self.browser.run("document.title"), self.title)


class Study(FirefoxCase, StudyCase):
    @classmethod
    def make_kit(cls, out, *options):
        super().make_kit(out, "--study", "study.json", "--post", "http://127.0.0.1:1/answers")

    def test_a_whole_study(self):
        address = receiving(self, "kit")
        self.move("kit", "moved", address)
        self.show("moved", width=1100, height=800)
        self.click("[data-language=en]")
        self.name("anna")
        self.until_screen("consent")
        self.click("#agreeing button")
        self.assertEqual(self.screen(), "consent")  # not without the tick
        self.click("#tick")
        self.click("#agreeing button")
        self.until_screen("before")
        self.write("[name=age]", "17")
        self.click("#beforeQuestions button")
        self.assertEqual(self.screen(), "before")
        self.browser.press("Backspace", times=2)
        self.write("[name=age]", "44")
        self.tap("[name=screen][value=other]")
        self.click("#beforeQuestions button")
        self.until_screen("calibrate")
        self.slide("cardSize", 428)
        self.click("#cardTick")
        self.write("#distance", "60")
        self.click("[name=colour][value=normal]")
        self.write("#colourTest", "Ishihara")
        for _ in range(2):
            self.slide("grey", 186)
            self.click("#gammaTick")
            self.click("#calibration button")
        self.until_screen("trial")
        self.answer_by("keys", "1")
        self.answer_by("touch", "3")
        self.until_screen("ready")
        # Nothing is taken before everything is seen.
        self.browser.run("speed = 0")
        self.browser.press("Enter")
        self.until_screen("trial")
        side = 2 * 600 * math.tan(math.radians(0.5)) * 428 / 85.6 / 0.9
        width = self.until("document.querySelector('#left canvas')?.getBoundingClientRect().width")
        self.assertAlmostEqual(width, side, delta=0.1)
        self.browser.press("2")
        self.assertEqual(self.browser.run("[judge.votes[0], byId('hint').textContent === text('wait')]"), [0, True])
        self.browser.run("speed = 20")
        count = len(self.kit["trials"])
        votes = [str(place * 2 % 3 + 1) for place in range(count)]
        for place, (trial, swapped, _) in enumerate(order_of(self.kit, "anna")):
            if expected := self.kit["trials"][trial].get("expected"):  # a sentinel, whom nobody may fail
                votes[place] = str(4 - expected if swapped else expected)
        for place, digit in enumerate(votes):
            self.answer_by(("keys", "mouse", "touch")[place // 2 % 3], digit)
            if place == 2:
                self.press("ArrowUp")
                self.assertEqual(self.place(), 3)
                self.answer_by("touch", digit)
            if self.screen() == "pause":
                if place == 3:
                    self.browser.reload()
                    self.until("[...document.querySelectorAll('main')].some(m => !m.hidden)")
                    self.assertEqual(self.screen(), "pause")
                self.step(lambda: self.browser.press("Enter"))
        self.until_screen("survey")
        self.click("[name=sure][value='4']")
        self.click("#questions button")
        self.until_screen("done")
        self.until("byId('sent').textContent.startsWith('Your answers were sent')")
        self.assertIn("It was about metrics.", self.browser.text("#debrief"))
        self.click("#saveAll")
        found = read_json(self.file("judge-anna.json"))
        (received,) = (self.work / "received").iterdir()
        self.assertEqual(read_json(received), found)
        self.assertEqual([str(trial["vote"]) for trial in found["trials"]], votes)
        self.assertEqual(found["survey"],
                         {"age": "44", "screen": "other", "length": "", "constructor": "", "sure": "4"})
        self.assertEqual([answer["right"] for answer in found["practice"]["answers"]], [True, True])
        calibration = found["calibration"]
        self.assertTrue(calibration["passed"])
        self.assertAlmostEqual(calibration["gamma"], math.log(0.5) / math.log(186 / 255))
        self.assertEqual((calibration["distance_mm"], calibration["colour_vision_test"]), (600, "Ishihara"))
        self.assertEqual(len(found["sessions"]), 2)  # it was loaded again
        self.assertEqual(len(found["trials"][2]["changes"]), 2)
        for trial in found["trials"]:
            self.assertGreaterEqual(trial["shown_ms"], 1250)
            self.assertAlmostEqual(trial["image_css_px"], side, delta=0.1)
        self.assert_calm(address)
        # What was sent and what was saved is what `votes` reads.
        self.click("#saveVotes")
        header, rows = read_csv(self.file("votes-anna.csv"))
        self.assert_rows_are_of_the_kit([dict(zip(header, row, strict=True)) for row in rows])
        for number, file in enumerate(["judge-anna.json", received, "votes-anna.csv"]):
            result = self.run_program("votes", file, "--selection", self.kits / "results" / "selection.csv",
                                      "--kit", self.kits / "kit" / "kit.json", "--out", f"analysis-{number}")
            self.assertEqual(result.returncode, SUCCESS, result.stderr)
        for number in 0, 1:
            self.assertEqual((self.work / f"analysis-{number}" / "judgements.csv").read_bytes(),
                             (self.work / "analysis-2" / "judgements.csv").read_bytes())
        # Withdrawing erases here and there.
        self.click("#withdrawButton")
        self.click("#withdrawYes")
        self.until_screen("withdrawn")
        self.until("byId('withdrawnText').textContent.includes('is erased there')")
        self.assertEqual([path.suffix for path in (self.work / "received").iterdir()], [".withdrawn"])
        self.assertEqual([key for key in self.stored_keys() if not key.startswith("language")], [])


class Plain(FirefoxCase):
    """Without a study file."""

    @classmethod
    def select(cls):
        support.write_database(cls.kits / "db", {f"m{i}": support.samples(i) for i in range(8)})
        cls.program("scan", "--database", "db", "--select", "5", "--out", "results", "--quiet")

    def test_votes_are_saved_and_analysed(self):
        self.show(width=390, height=700)
        self.click("[data-language=en]")
        self.name("bo")
        self.until_screen("trial")
        self.answer_by("touch", "1")
        self.until_screen("ready")
        self.click("#begin")
        self.until_screen("trial")
        count = len(self.kit["trials"])
        votes = [str(place % 3 + 1) for place in range(count)]
        for digit in votes:
            self.answer_by("keys", digit)
        self.until_screen("survey")
        self.tap("[name=keys_easy][value='5']")
        self.write("textarea", "=1+1 and more")
        self.click("#questions button")
        self.until_screen("done")
        self.click("#saveVotes")
        header, rows = read_csv(self.file("votes-bo.csv"))
        self.assertEqual([row[header.index("vote")] for row in rows], votes)
        self.click("#saveSurvey")
        header, rows = read_csv(self.file("survey-bo.csv"))
        answers = {question: answer for _, question, answer in rows}
        self.assertEqual((answers["keys_easy"], answers["comments"]), ("5", "'=1+1 and more"))
        self.assert_calm()
        self.run_program("votes", "votes-bo.csv", "--selection", self.kits / "results" / "selection.csv",
                         "--kit", self.kits / "kit" / "kit.json", "--survey", "survey-bo.csv", "--out", "analysis")
        # The page of the votes, and a picture that it saves.
        for width in 1200, 390:
            self.browser.open(self.work / "analysis" / "votes.html", width=width)
            self.assertEqual((self.browser.complaints(), self.browser.run("document.title")), ([], "What the judges say"))
            self.assertEqual(self.browser.run("document.querySelectorAll('#rows li').length"), 7)  # 5, and 2 by lot
            self.assertLessEqual(self.browser.run("document.documentElement.scrollWidth"), width)
        buttons = "document.querySelectorAll('figure')[0].querySelectorAll('button')"
        for number, (kind, begins) in enumerate((("svg", b"<svg"), ("png", b"\x89PNG\r\n\x1a\n"))):
            self.browser.run(f"(b => {{ b.id = 'save{kind}'; b.scrollIntoView({{block: 'center'}}); }})({buttons}[{number}])")
            self.browser.click(f"#save{kind}")
            self.assertIn(begins, self.file(f"judgement-summary.{kind}").read_bytes()[:200])
        self.assertEqual(self.browser.complaints(), [])


if __name__ == "__main__":
    support.main()
