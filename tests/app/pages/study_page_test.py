"""The page of a kit with a study file, in a real browser: consent, calibration, what is recorded, sending, withdrawing."""

import http.client
import json
import math
import pathlib
import subprocess
import sys

import support
from judge_page_test import PageCase
from support import PROGRAM, read_csv, read_json, samples, write_database

RECEIVER = pathlib.Path(__file__).parents[3] / "examples" / "receiver.py"

STUDY = """{
  // A study with everything in it.
  "title": {"en": "A study of spheres", "de": "Eine Studie mit Kugeln"},
  "languages": ["en", "de"],
  "consent": {"en": "You may take part.\\n\\nOr not {GDPR}.", "de": "Sie dürfen teilnehmen."},
  "debrief": "It was about metrics. </script><script>document.title = 'hit'</script>",
  "surround": "grey",
  "before": [
    {"name": "age", "kind": "number", "text": "How old are you?", "required": true, "least": 18, "most": 120},
    {"name": "screen", "kind": "choice", "text": "Which screen?", "choices": ["phone", {"answer": "other", "text": "another one"}]}
  ],
  "after": [{"name": "sure", "kind": "scale", "text": "How sure were you?", "low": "not at all", "high": "very"},
    {"name": "length", "kind": "text", "text": "Was it long?"}, {"name": "constructor", "kind": "text", "text": "Whose is it?"}],
  "timing": {"break_every": 2, "between": "mask", "between_ms": 300},
  "practice": {"trials": 2, "pass": 2},
  "calibration": {"card": true, "gamma": true, "colour_vision": true, "window_width": 600},
  "spheres": {"unit": "degrees", "diameter": 1},
  "exclusion": {"sentinels_failed": 1, "calibration_failed": true},
  "record": {"browser": false},
  /* and the texts of a language that the page does not know */
  "texts": {"de": %s}
}"""


class StudyCase(PageCase):
    title = "A study of spheres"

    @classmethod
    def select(cls):
        write_database(cls.kits / "db", {f"m{i}": samples(i) for i in range(8)})
        cls.program("scan", "--database", "db", "--select", "5", "--out", "results", "--quiet")
        template = subprocess.run([PROGRAM, "judge", "--study-template"], stdout=subprocess.PIPE, check=True,
                                  encoding="utf-8").stdout
        # Every text, as the template lists them.
        listed = [line[5:] for line in template.splitlines() if line.startswith('//   "')]
        texts = {}
        for line in listed:
            key, value = next(iter(json.loads("{" + line + "}").items()))
            texts.setdefault(key, "d: " + value)
        (cls.kits / "study.json").write_text(STUDY % json.dumps(texts), encoding="utf-8")

    @classmethod
    def make_kit(cls, out, *options):
        super().make_kit(out, *(options or ("--study", "study.json")))

    def click(self, selector):
        """With the mouse, when that is not the second half of a double click any more."""
        self.browser.run(f"document.querySelector('{selector}').scrollIntoView({{block: 'center'}})")
        self.until("performance.now() - changedAt > secondClick")
        self.browser.click(selector)

    def consent(self, name="anna"):
        self.name(name)
        self.until_screen("consent")
        self.click("#tick")
        self.browser.run("document.querySelector('#agreeing button').click()")
        self.until_screen("before")

    def move(self, kit, to, address):
        """Copies a kit whose page sends to 127.0.0.1:1, where nobody listens, to one that sends to an address."""
        page = (self.kits / kit / "index.html").read_text(encoding="utf-8")
        moved = self.kits / to
        moved.mkdir(exist_ok=True)
        (moved / "index.html").write_text(page.replace("http://127.0.0.1:1\"", address.rstrip("/") + "\"")
                                          .replace("http://127.0.0.1:1/answers", address), encoding="utf-8")
        (moved / "kit.json").write_bytes((self.kits / kit / "kit.json").read_bytes())

    def stored_keys(self):
        return self.browser.run("openDatabase().then(d => new Promise(done => { const r = d.transaction('kept').objectStore('kept')"
                                ".getAllKeys(); r.onsuccess = () => done(r.result); }))")

    def set_slider(self, slider, value):
        self.browser.run(f"byId('{slider}').value = {value}; byId('{slider}').dispatchEvent(new Event('input'))")

    def calibrate(self, grey=186):
        self.until_screen("calibrate")
        self.set_slider("cardSize", 428)  # five pixels a millimetre
        self.click("#cardTick")
        self.browser.run("byId('distance').value = '60'")
        self.browser.run("document.querySelector('[name=colour][value=normal]').click(); byId('colourTest').value = 'Ishihara'")
        for _ in range(2):
            self.set_slider("grey", grey)
            self.browser.run("byId('gammaTick').checked = true")
            self.browser.run("document.querySelector('#calibration button').click()")
        self.until_screen("trial")

    def to_the_trials(self, name="anna"):
        self.consent(name)
        self.browser.run("document.querySelector('[name=age]').value = '30'")
        self.browser.run("document.querySelector('[name=age]').dispatchEvent(new Event('input', {bubbles: true}))")
        self.browser.run("document.querySelector('#beforeQuestions button').click()")
        self.calibrate()
        for right in "1", "3":  # the sides that do not change
            self.answer(right)
        self.until_screen("ready")
        self.step(lambda: self.browser.press("Enter"))

    def answer_all(self, digit="2"):
        while self.screen() != "survey":
            if self.screen() == "pause":
                self.step(lambda: self.browser.run("byId('resume').click()"))
            self.answer(digit)


def receiving(case, kit):
    """Starts examples/receiver.py for a kit, until the test ends; returns its address."""
    process = subprocess.Popen(
        [sys.executable, RECEIVER, "--kit", case.kits / kit / "kit.json", "--out", case.work / "received", "--port", "0", "--quiet"],
        stdout=subprocess.PIPE, encoding="utf-8")
    case.addCleanup(process.stdout.close)
    case.addCleanup(process.wait)
    case.addCleanup(process.kill)
    return process.stdout.readline().split()[2]


class Study(StudyCase):
    def test_a_whole_study(self):
        self.show(width=1100, height=800)
        self.assertEqual(self.browser.text("h1"), self.title)
        self.name("anna")
        self.until_screen("consent")
        # Nothing is stored of who has not agreed.
        self.assertEqual([key for key in self.stored_keys() if key.startswith("judge:")], [])
        self.assertIsNone(self.browser.run("history.state"))
        words = self.browser.run("document.getElementById('consent').innerText")
        for said in "You may take part.", "Or not {GDPR}.", "your time zone", "whether your system forces colours", "date and time":
            self.assertIn(said, words)
        self.assertNotIn("which browser", words)  # the study does not record it
        # Without the tick there is no way on.
        self.browser.run("document.querySelector('#agreeing button').click()")
        self.assertEqual(self.screen(), "consent")
        self.browser.run("byId('decline').click()")
        self.assertEqual(self.screen(), "start")
        self.consent()
        # A question that must be answered, and within its limits.
        for age in "", "17", "121":
            self.browser.run(f"document.querySelector('[name=age]').value = '{age}'")
            self.browser.run("document.querySelector('#beforeQuestions button').click()")
            self.assertEqual(self.screen(), "before", age)
        self.browser.run("document.querySelector('[name=age]').focus()")
        self.browser.run("document.querySelector('[name=age]').value = ''")
        self.browser.call("Input.insertText", text="44")
        self.browser.run("document.querySelector('#beforeQuestions button').click()")
        # The card fits a phone, and stripes are two pixels of the device however the page is magnified.
        self.until_screen("calibrate")
        for width, scale in (390, 3), (1000, 2), (1100, 1):
            self.browser.call("Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=scale, mobile=False)
            self.browser.draw()
            self.assertEqual(self.browser.run("[byId('card').offsetHeight > byId('card').offsetWidth, byId('stripes').width]"),
                             [width == 390, 280 * scale])
        self.calibrate()
        # The practice counts only when both are right.
        for vote in "1", "1":
            self.answer(vote)
        self.until_screen("ready")
        self.assertIn("1 of 2", self.browser.text("#practised"))
        self.assertTrue(self.browser.run("byId('begin').hidden"))
        self.step(lambda: self.browser.run("byId('again').click()"))
        for vote in "1", "3":
            self.answer(vote)
        self.until_screen("ready")
        self.step(lambda: self.browser.run("byId('begin').click()"))
        # A sphere of one degree at 600 mm, with five pixels a millimetre, is nine tenths of its image.
        side = 2 * 600 * math.tan(math.radians(0.5)) * 428 / 85.6 / 0.9
        width = self.browser.run("document.querySelector('#left canvas').getBoundingClientRect().width")
        self.assertAlmostEqual(width, side, delta=0.1)
        # It is as large for the eye where the page is magnified afterwards.
        for magnified in 2, 1:
            self.browser.call("Emulation.setDeviceMetricsOverride", width=1100 // magnified, height=800 // magnified,
                              deviceScaleFactor=magnified, mobile=False)
            self.until(f"Math.abs(document.querySelector('#left canvas').getBoundingClientRect().width - {side / magnified}) < 0.1")
        self.answer("1")
        self.press("ArrowUp")
        self.answer("2")  # another answer to the first
        self.answer("2")
        self.assertEqual(self.screen(), "pause")
        self.reload()
        self.assertEqual(self.screen(), "pause")
        self.step(lambda: self.browser.run("byId('resume').click()"))
        self.answer_all("3")
        self.browser.run("document.querySelector('[name=sure][value=\"4\"]').click()")
        self.until("desk.loose.size === 0 || judge.survey.sure === '4'")
        self.browser.run("document.querySelector('#questions button').click()")
        self.until_screen("done")
        self.assertIn("It was about metrics.", self.browser.text("#debrief"))
        found = read_json(self.saved("#saveAll", "judge-anna.json"))
        self.assertIn("saved", self.browser.text("#saveAll"))
        self.assertEqual((found["format"], found["version"], found["judge"], found["complete"]),
                         ("merl-scan judge", 1, "anna", True))
        self.assertEqual((found["kit_hash"], found["study_hash"]), (self.kit["kit_hash"], self.kit["study_hash"]))
        self.assertEqual(found["survey"], {"age": "44", "screen": "", "sure": "4", "length": "", "constructor": ""})
        self.assertEqual(set(found["consent"]), {"language", "given"})
        self.assertEqual(len(found["sessions"]), 2)  # it was loaded again
        self.assertEqual(set(found["sessions"][0]), {"begun", "languages", "screen", "time_zone", "forced_colors",
                                                     "prefers_color_scheme"})
        calibration = found["calibration"]
        self.assertTrue(calibration["passed"])
        self.assertAlmostEqual(calibration["gamma"], math.log(0.5) / math.log(186 / 255))
        self.assertEqual((calibration["distance_mm"], calibration["colour_vision"], calibration["colour_vision_test"]),
                         (600, "normal", "Ishihara"))
        self.assertEqual([a["right"] for a in found["practice"]["answers"]], [True, False, True, True])
        self.assertEqual((found["practice"]["attempts"], found["practice"]["passed"]), (2, True))
        first = found["trials"][0]
        self.assertEqual([change["vote"] for change in first["changes"]], [1, 2])
        self.assertEqual((first["looks"], first["timeouts"], first["full_screen"]), (2, 0, False))
        self.assertGreaterEqual(first["shown_ms"], 2 * 1250)
        self.assertGreaterEqual(first["alternations"], 2)
        self.assertAlmostEqual(first["image_css_px"], side, delta=0.1)
        # The same votes are in the CSV file.
        rows = self.download("#saveVotes", "votes-anna.csv")
        self.assert_rows_are_of_the_kit(rows)
        self.assertEqual([int(row["vote"]) for row in rows], [trial["vote"] for trial in found["trials"]])
        self.assertEqual([[row["left_1"], row["left_2"], row["right_1"], row["right_2"], row["swapped"], row["response_ms"]] for row in rows],
                         [[*t["left"], *t["right"], str(t["swapped"]), str(t["response_ms"])] for t in found["trials"]])
        survey = self.download("#saveSurvey", "survey-anna.csv")
        self.assertEqual([row["question"] for row in survey], ["age", "screen", "sure", "length", "constructor"])
        self.assert_calm()
        # What counts as invalid is the researcher's to know.
        self.assertEqual(self.kit["exclusion"], {"sentinels_failed": 1, "calibration_failed": True})
        self.assertNotIn("exclusion", self.browser.run("JSON.stringify(kit)"))

    def test_withdrawing_erases(self):
        self.show(width=1100, height=800)
        self.to_the_trials()
        self.assert_everything_is_in_the_window([(320, 480), (390, 844), (512, 350), (1100, 800)])
        self.until("answerable")
        self.answer("1")
        self.until("desk.loose.size === 0")
        self.assertIn("judge:anna", self.stored_keys())
        # A change of mind, and back to where it was.
        self.browser.run("byId('withdrawInTrial').click()")
        self.assertEqual(self.screen(), "withdrawing")
        self.step(lambda: self.browser.run("byId('withdrawNo').click()"))
        self.assertEqual(self.place(), 2)
        self.browser.run("byId('withdrawInTrial').click()")
        self.browser.run("byId('withdrawYes').click()")
        self.until_screen("withdrawn")
        self.assertNotIn("judge:anna", self.stored_keys())
        self.assertEqual(self.browser.run("[desks.size, judge, history.state]"), [0, None, None])
        self.reload()
        self.assertEqual(self.screen(), "start")
        # Whoever comes back begins anew.
        self.name("anna")
        self.until_screen("consent")
        self.assertEqual(self.browser.run("judge.votes.some(vote => vote > 0)"), False)
        self.assert_calm()

    def test_withdrawing_reaches_other_tabs(self):
        self.show(width=1100, height=800)
        self.to_the_trials()
        self.answer("1")
        self.until("desk.loose.size === 0")
        first = self.browser.session
        self.show_again(width=1100, height=800)
        self.name("anna")
        self.until_screen("elsewhere")
        self.click("#takeOver")
        self.until_screen("trial")
        # While the page is in its turn it has a way to withdraw on the instructions, too.
        self.browser.run("instruct()")
        self.assertFalse(self.browser.run("byId('withdrawHere').hidden"))
        self.browser.run("byId('withdrawButton').click()")
        self.browser.run("byId('withdrawYes').click()")
        self.until_screen("withdrawn")
        # The first tab remembered everything.
        self.browser.use(first)
        self.until_screen("start")
        self.assertEqual(self.browser.run("[desks.size, judge, history.state]"), [0, None, None])
        self.assertNotIn("judge:anna", self.stored_keys())
        self.assert_calm()

    def test_a_language_that_the_page_does_not_know_says_everything(self):
        self.show(width=1100, height=800)
        self.browser.run("document.querySelector('[data-language=de]').click()")
        self.assertEqual(self.browser.text("h1"), "Eine Studie mit Kugeln")
        self.assertEqual(self.browser.run("document.documentElement.lang"), "de")
        said = self.browser.run("[...document.querySelectorAll('[data-text]')].map(e => [e.dataset.text, e.textContent])")
        for key, words in said:
            if key not in ("title", "question"):
                self.assertTrue(words.startswith("d: ") or "d: " in words, (key, words))
        self.assertEqual(self.browser.run("Object.keys(texts.en).filter(k => !(k in texts.de)).join()"), "")

    def test_a_name_from_the_address_and_a_window_that_is_too_small(self):
        self.page = self.kits / "kit" / "index.html"
        self.browser.call("Emulation.setDeviceMetricsOverride", width=500, height=800, deviceScaleFactor=1, mobile=False)
        for query, name in ("?judge=Carl%20A", "Carl A"), ("?PROLIFIC_PID=5f&STUDY_ID=s", "5f"):
            self.browser.events.clear()
            self.browser.call("Page.navigate", url=self.page.resolve().as_uri() + query)
            self.browser.event("Page.loadEventFired")
            self.until("!byId('start').hidden")
            self.assertEqual(self.browser.run("[byId('name').value, byId('name').readOnly]"), [name, True])
        self.assertIn("500 × 800", self.browser.text("#windowSmall"))
        self.browser.run("document.querySelector('#who button').click()")
        self.assertEqual(self.screen(), "start")
        self.browser.call("Emulation.setDeviceMetricsOverride", width=1000, height=800, deviceScaleFactor=1, mobile=False)
        self.until("byId('windowSmall').hidden")
        self.browser.run("document.querySelector('#who button').click()")
        self.until_screen("consent")
        self.browser.run("byId('tick').click(); document.querySelector('#agreeing button').click()")
        self.until_screen("before")
        self.assertEqual(self.browser.run("judge.panel"), {"PROLIFIC_PID": "5f", "STUDY_ID": "s"})

    def test_every_screen_can_be_read(self):
        """Contrast of all words against what is behind them, as WCAG 2 has it: 4.5, or 3 where they are large."""
        contrast = """(() => {
          const parse = c => (c.match(/[\\d.]+/g) || []).map(Number);
          const light = ([r, g, b]) => [r, g, b].map(v => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
            .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
          const bad = [];
          for (const e of document.querySelectorAll('main:not([hidden]) *, #withdrawHere:not([hidden]) *')) {
            if (![...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim()) || !e.getClientRects().length || e.closest('[aria-disabled=true], :disabled')) continue;
            let at = e;
            while (at && (parse(getComputedStyle(at).backgroundColor)[3] ?? 1) === 0) at = at.parentElement;
            const back = light(parse(at ? getComputedStyle(at).backgroundColor : 'rgb(255,255,255)'));
            const ink = light(parse(getComputedStyle(e).color));
            const ratio = (Math.max(back, ink) + 0.05) / (Math.min(back, ink) + 0.05);
            if (ratio < 4.5) bad.push([e.tagName, e.id, e.textContent.slice(0, 30), ratio]);
          }
          if (document.documentElement.scrollWidth > innerWidth) bad.push(['wide', document.documentElement.scrollWidth]);
          return bad;
        })()"""
        self.make_kit("light", "--study", "study.json", "--background", "0.2")
        for kit in "kit", "light":
            self.show(kit, width=640, height=900)
            if self.screen() == "start":
                self.assertEqual(self.browser.run(contrast), [])
                self.consent("judge of " + kit)
            for screen in "consent", "before", "calibrate", "practice", "ready", "pause", "survey", "done", "withdrawing", "withdrawn", "refused":
                # A phone, and a window that is magnified twice.
                for width, scale in (390, 3), (640, 2), (1400, 1):
                    self.browser.call("Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=scale, mobile=False)
                    self.browser.run("judge.calibration = {css_px_per_mm: 4, distance_mm: 600}; judge.screen = '%s' === 'practice' ? 'practice' : 'done'; show('%s')" % (screen, screen))
                    self.browser.draw()
                    self.assertEqual(self.browser.run(contrast), [], (kit, screen, width))


class Timing(StudyCase):
    """A study without consent, where time runs out and the practice has to be passed."""

    title = "Which spheres change less?"

    @classmethod
    def select(cls):
        super().select()
        (cls.kits / "study.json").write_text(json.dumps({
            "timing": {"latest_ms": 60000, "between": "blank", "between_ms": 200}, "practice": {"pass": 1, "attempts": 2},
            "spheres": {"unit": "pixels", "diameter": 90}, "after": []}))

    def pass_practice(self, name):
        self.browser.run("document.querySelector('[data-language=en]').click()")
        self.name(name)
        self.answer("1")
        self.until_screen("ready")
        self.step(lambda: self.browser.press("Enter"))

    def test_whoever_does_not_pass_takes_no_part(self):
        self.show()
        self.browser.run("document.querySelector('[data-language=en]').click()")
        self.name("anna")
        self.answer("2")
        self.until_screen("ready")
        self.assertEqual(self.browser.run("[byId('begin').hidden, document.activeElement.id]"), [True, "again"])
        self.step(lambda: self.browser.press("Enter"))
        self.answer("3")
        self.until_screen("refused")
        self.reload()
        self.assertEqual(self.screen(), "refused")
        self.assertTrue(self.browser.run("byId('withdrawHere').hidden"))  # nobody was asked for consent
        self.assert_calm()

    def test_time_that_runs_out(self):
        self.show()
        self.pass_practice("bo")
        count = len(self.kit["trials"])
        self.until("judge.marks[0]?.timeouts === 1 && answerable")
        self.assertEqual(self.place(), 2)
        for _ in range(count - 1):
            self.answer("2")
        # What was lost comes again, before anything else follows.
        self.assertEqual((self.screen(), self.place()), ("trial", 1))
        self.until("judge.marks[0].timeouts === 2")
        self.until("judge.marks[0].looks >= 3")
        self.assertEqual(self.place(), 1)
        self.answer("1")
        self.until_screen("done")  # nothing is asked
        self.assertTrue(self.browser.run("byId('saveSurvey').hidden && byId('toSurvey').hidden"))
        found = read_json(self.saved("#saveAll", "judge-bo.json"))
        self.assertEqual([trial["vote"] for trial in found["trials"]], [1] + [2] * (count - 1))
        self.assertEqual([trial["timeouts"] for trial in found["trials"]], [2] + [0] * (count - 1))
        self.assertEqual((found["consent"], found["sessions"], found["panel"]), (None, [], {}))
        # Ninety pixels of a sphere are a hundred of its image.
        self.assertEqual({trial["image_css_px"] for trial in found["trials"]}, {100})
        # Nothing is on the screen before a configuration.
        self.browser.run("speed = 0; judge.screen = 'trial'; show('trial')")
        self.until("frame > 0 && document.querySelector('#left canvas')")
        self.browser.draw()
        self.assertEqual(self.browser.run("document.querySelectorAll('.side .now').length"), 0)
        self.browser.run("speed = 20")
        self.until("document.querySelectorAll('.side .now').length === 2")
        self.assert_calm()


def lots_of(text):
    """What the page draws by lot for a judge, from docs/experiment.md: xmur3 seeds sfc32."""
    mask = 0xFFFFFFFF
    state = 1779033703 ^ len(text)
    for character in text:
        state = (state ^ ord(character)) * 3432918353 & mask
        state = (state << 13 | state >> 19) & mask

    def seed():
        nonlocal state
        state = (state ^ state >> 16) * 2246822507 & mask
        state = (state ^ state >> 13) * 3266489909 & mask
        state ^= state >> 16
        return state

    a, b, c, d = (seed() for _ in range(4))

    def draw():
        nonlocal a, b, c, d
        t = (a + b + d) & mask
        d = (d + 1) & mask
        a = b ^ b >> 9
        b = (c + (c << 3)) & mask
        c = (c << 21 | c >> 11) & mask
        c = (c + t) & mask
        return t / 2**32

    for _ in range(20):
        draw()
    return draw


def order_of(kit, name):
    """(trial, swapped, turned) as the page shows them to a judge, from kit.json and the name alone."""
    draw = lots_of(f"{kit['seed']}\n{name}")
    trials = kit["trials"]
    order = [i for i, trial in enumerate(trials) if trial["kind"] != "repeat"]
    for left in range(len(order), 1, -1):
        other = int(draw() * left)
        order[left - 1], order[other] = order[other], order[left - 1]
    for i, trial in enumerate(trials):
        if trial["kind"] == "repeat":
            first = next(place for place, t in enumerate(order) if trials[t]["configuration"] == trial["configuration"])
            earliest = min(first + 11, len(order))
            order.insert(earliest + int(draw() * (len(order) - earliest + 1)), i)
    return [[trial, draw() < 0.5, [draw() < 0.5, draw() < 0.5]] for trial in order]


def most_chi_squared(freedom, z):
    """The quantile of chi squared where a standard normal variable has z (Wilson and Hilferty 1931)."""
    return freedom * (1 - 2 / (9 * freedom) + z * math.sqrt(2 / (9 * freedom))) ** 3


class Randomisation(StudyCase):
    @classmethod
    def make_kit(cls, out, *options):
        super().make_kit(out, "--seed", "7")

    def test_a_thousand_judges(self):
        """Sides, turns and places are balanced, and each judge's are known from kit.json and the name."""
        self.show()
        judges = 1000
        orders = self.browser.run(f"Array.from({{length: {judges}}}, (_, i) => orderFor('judge' + i).map(o => [o.trial, o.swapped, o.turned]))")
        self.assertEqual(orders, [order_of(self.kit, f"judge{i}") for i in range(judges)])
        trials = self.kit["trials"]
        firsts = [i for i, trial in enumerate(trials) if trial["kind"] != "repeat"]
        places = {trial: [0] * len(firsts) for trial in firsts}
        chosen = {}
        for order in orders:
            for place, trial in enumerate(trial for trial, *_ in order if trial in places):
                places[trial][place] += 1
            for trial, swapped, turned in order:
                for which, drawn in enumerate([swapped, *turned]):
                    chosen[trial, which] = chosen.get((trial, which), 0) + drawn
        # Pearson's chi squared at 0.001 (z = 3.09): every trial at every place alike; every coin of every trial fair.
        expected = judges / len(firsts)
        found = sum((count - expected) ** 2 / expected for counts in places.values() for count in counts)
        self.assertLess(found, most_chi_squared((len(firsts) - 1) ** 2, 3.09))
        coins = sum((count - judges / 2) ** 2 / (judges / 4) for count in chosen.values())
        self.assertEqual(len(chosen), 3 * len(trials))
        self.assertLess(coins, most_chi_squared(len(chosen), 3.09))
        self.assertGreater(coins, most_chi_squared(len(chosen), -3.09))  # nor too even for lots


class Posting(StudyCase):
    @classmethod
    def make_kit(cls, out, *options):
        super().make_kit(out, "--study", "study.json", "--post", "http://127.0.0.1:1/answers")

    def received(self):
        folder = self.work / "received"
        return [read_json(path) for path in folder.glob("*.json")] if folder.exists() else []

    def test_sending_failing_retrying_and_withdrawing(self):
        """The page is of an address where nobody listens, until it is moved to one where somebody does."""
        page = (self.kits / "kit" / "index.html").read_text(encoding="utf-8")
        self.assertIn("connect-src http://127.0.0.1:1\"", page)
        address = receiving(self, "kit")
        self.move("kit", "moved", address)
        self.show("kit", width=1100, height=800)
        self.to_the_trials()
        self.assertIn("are sent to http://127.0.0.1:1", self.browser.text("#recordsWhere"))
        self.answer_all()
        self.browser.run("document.querySelector('#questions button').click()")
        self.until("byId('sent').classList.contains('bad')")
        self.assertIn("could not be sent", self.browser.text("#sent"))
        self.assertEqual(read_json(self.saved("#saveAll", "judge-anna.json"))["judge"], "anna")
        (self.work / "judge-anna.json").unlink()
        # The same kit, at the same place of the browser, with a receiver.
        self.show("moved", width=1100, height=800)
        if self.screen() == "start":
            self.name("anna")
        self.until_screen("done")
        self.until("byId('sent').textContent.startsWith('Your answers were sent')")
        (stored,) = self.received()
        self.assertEqual(stored, read_json(self.saved("#saveAll", "judge-anna.json")))
        self.assertEqual(stored["kit_hash"], self.kit["kit_hash"])
        # No other origin may be asked.
        self.assertEqual(self.browser.run("fetch('http://127.0.0.1:9/').then(() => 'there', e => e.name)"), "TypeError")
        self.browser.run("byId('withdrawButton').click()")
        self.browser.run("byId('withdrawYes').click()")
        self.until_screen("withdrawn")
        self.until("byId('withdrawnText').textContent.includes('is erased there')")
        self.assertEqual(self.received(), [])
        self.assertEqual([key for key in self.stored_keys() if not key.startswith("language")], [])


if __name__ == "__main__":
    support.main()
