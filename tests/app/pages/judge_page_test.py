"""The page of a kit in a real browser, opened as a file: a whole experiment, and nothing lost."""

import base64
import json
import math
import pathlib
import random
import re
import shutil
import struct
import subprocess
import tempfile
import time
import zlib

import support
from browser import ALT, CHROMIUM, CONTROL, META, SHIFT, Browser
from png import pixel, read_png
from reference_selection import LABELS, REFERENCE, write_reference_selection
from support import PROGRAM, Case, read_csv, read_json, samples, write_database

HOSTILE = ["</script><script>document.title='hit'</script>".replace("/", "\u2215"),
           "=HYPERLINK(\"x\")", "<img src=x onerror=alert(1)>", "<!--<script>", "a,b\"c", "%DATA%",
           "line\nbreak", "å&amp;"]


def png(width, height, rows):
    """An image of grey levels; each row begins with a byte 0."""
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 0, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class PageCase(Case):
    """A kit and a browser, and what a judge does."""

    title = "Which spheres change less?"
    practised = "right side is smaller"  # in what stands after an answer 3

    @classmethod
    def setUpClass(cls):
        if CHROMIUM is None:
            raise AssertionError("there is no chromium; scripts/setup.sh installs it")
        cls.kits = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.select()
        cls.make_kit("kit")

    @classmethod
    def select(cls):
        """Writes results/selection.csv."""
        raise NotImplementedError

    @classmethod
    def program(cls, *arguments):
        subprocess.run([PROGRAM, *arguments], cwd=cls.kits, check=True)

    @classmethod
    def make_kit(cls, out, *options):
        cls.program("judge", "--selection", "results/selection.csv", "--size", "48",
                    "--sentinels", "1", "--random", "2", "--repeats", "40", "--out", out,
                    "--quiet", *options)

    def setUp(self):
        super().setUp()
        self.browser = self.start()

    def start(self, speed=20, **options):
        """A browser with a storage of its own, in which configurations are seen in a twentieth of
        the time: the page itself has no way to shorten it."""
        browser = self.enterContext(Browser(**options))
        browser.set_clock(speed)
        browser.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(self.work))
        return browser

    def show(self, kit="kit", **window):
        self.page = self.kits / kit / "index.html"
        self.kit = read_json(self.kits / kit / "kit.json")
        self.browser.open(self.page, **window)
        self.until("[...document.querySelectorAll('main')].some(m => !m.hidden)")

    def show_again(self, kit="kit", speed=20, **window):
        """Opens the page in another tab."""
        session = self.browser.new_page()
        self.browser.set_clock(speed)
        self.show(kit, **window)
        return session

    def reload(self):
        self.browser.reload()
        self.until("[...document.querySelectorAll('main')].some(m => !m.hidden)")

    def until(self, expression, seconds=60):
        end = time.monotonic() + seconds
        while not (value := self.browser.run(expression)):
            if time.monotonic() > end:
                self.fail(f"{expression}: {self.browser.run('document.body.innerText')}")
            time.sleep(0.01)
        return value

    def screen(self):
        return self.browser.run("[...document.querySelectorAll('main')].find(m => !m.hidden).id")

    def until_screen(self, screen):
        self.until(f"!byId('{screen}').hidden")

    def step(self, action):
        """Does something that brings another configuration on the screen, or another screen."""
        before = self.browser.run("shownAt")
        action()
        self.until(f"byId('trial').hidden || shownAt !== {before}")

    def answer(self, digit):
        """Answers by the keyboard as soon as that can be done."""
        self.until("answerable")
        self.step(lambda: self.browser.press(digit, f"Digit{digit}"))

    def press(self, key):
        self.step(lambda: self.browser.press(key))

    def place(self):
        return int(self.browser.text("#place").split()[0])

    def votes(self):
        return self.browser.run("judge.votes")

    def name(self, name):
        """Writes a name on the start screen, and enters."""
        self.until_screen("start")
        self.browser.run("document.querySelector('#name').value = ''")
        self.browser.run("document.querySelector('#name').focus()")
        self.browser.call("Input.insertText", text=name)
        self.browser.press("Enter")

    def begin(self, name="anna"):
        self.browser.run("document.querySelector('[data-language=en]').click()")
        self.name(name)
        self.until_screen("trial")
        self.answer("3")
        self.assertEqual(self.screen(), "ready")
        self.assertIn(self.practised, self.browser.text("#readyText"))
        self.step(lambda: self.browser.press("Enter"))
        self.assertEqual(self.screen(), "trial")
        # Votes are waited for, but where a judge is goes to the disk while the page goes on.
        self.until("exchange(keyOf(judge.name), () => undefined).then(r => !r || r.judge.screen === 'trial', () => true)")

    def saved(self, button, name):
        """The file of that name that a button saves."""
        self.browser.run(f"document.querySelector('{button}').click()")
        path, end = self.work / name, time.monotonic() + 60
        while not path.exists():
            self.assertLess(time.monotonic(), end, list(self.work.iterdir()))
            time.sleep(0.02)
        time.sleep(0.1)
        return path

    def download(self, button, name):
        path = self.saved(button, name)
        header, rows = read_csv(path)
        path.rename(self.work / f"saved-{name}")  # the browser would number the next one
        return [dict(zip(header, row, strict=True)) for row in rows]

    def assert_calm(self):
        self.assertEqual(self.browser.complaints(), [])
        outside = [url for url in self.browser.requests() if not url.startswith(("data:", "blob:"))]
        self.assertEqual(set(outside), {self.page.resolve().as_uri()})
        self.assertEqual(self.browser.run("document.title"), self.title)

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

    def assert_everything_is_in_the_window(self, sizes):
        """Nothing of a configuration is outside of the window, or covered by something."""
        for width, height in sizes:
            self.browser.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                              deviceScaleFactor=1, mobile=False)
            self.browser.draw()
            wrong = self.browser.run(
                "[...document.querySelectorAll('#trial button:not([hidden]), #hint, .side div.now canvas')].filter(e => {"
                "const b = e.getBoundingClientRect(); const at = document.elementFromPoint(b.x + b.width / 2, b.y + b.height / 2);"
                "return !(b.left >= 0 && b.top >= 0 && b.width > 20 && b.right <= innerWidth && b.bottom <= innerHeight &&"
                "(e.contains(at) || e.tagName === 'CANVAS')); }).map(e => e.outerHTML.slice(0, 60))"
                ".concat(document.documentElement.scrollWidth > innerWidth ? ['wide'] : [])")
            self.assertEqual(wrong, [], f"{width} x {height}")


class Page(PageCase):
    @classmethod
    def select(cls):
        write_database(cls.kits / "db", {name: samples(i) for i, name in enumerate(HOSTILE)})
        cls.program("scan", "--database", "db", "--select", "5", "--out", "results", "--quiet")

    def test_a_whole_experiment_by_keyboard(self):
        self.show()
        count = len(self.kit["trials"])
        self.assertIn(f"{count} configurations", self.browser.text("#start"))
        self.begin()
        numbers = random.Random(1)
        votes = [numbers.choice("123") for _ in range(count)]
        for place, vote in enumerate(votes[:count // 2]):
            self.assertEqual(self.browser.text("#place"), f"{place + 1} / {count}")
            self.answer(vote)
        # In the middle the page is loaded again.
        kept = "JSON.stringify({ ...judge, marks: judge.marks.map(seen => seen?.changes) })"
        self.until("judge.marks[judge.at]")
        before = self.browser.run(kept)
        self.reload()
        self.until("judge.marks[judge.at]")
        self.assertEqual(self.screen(), "trial")
        self.assertEqual(self.browser.run(kept), before)
        for vote in votes[count // 2:]:
            self.assertEqual(self.screen(), "trial")
            self.answer(vote)
        self.assertEqual(self.screen(), "survey")
        for question, answer in (("instructions_clear", "no"), ("keys_easy", "5")):
            self.browser.run(f"document.querySelector('[name={question}][value=\"{answer}\"]').click()")
        self.browser.run("document.querySelector('textarea').focus()")
        comment = "=cmd|' /C calc'!A0, \"quoted\" <script>alert(1)</script>"
        self.browser.call("Input.insertText", text=comment)
        self.until("desk.loose.size === 0")
        self.reload()  # once more
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
        self.answer("1")
        self.press("ArrowDown")  # the second is left out
        self.answer("2")
        rows = self.download("#save", "votes-anna.csv")
        self.assert_rows_are_of_the_kit(rows)
        self.assertEqual([row["vote"] for row in rows[:4]], ["1", "", "2", ""])
        self.assertEqual(rows[1]["response_ms"], "")
        for _ in range(3):
            self.press("ArrowUp")
        self.browser.press("ArrowUp")  # no further than the first
        self.assertEqual(self.place(), 1)
        self.assertEqual(self.browser.run("document.querySelector('[aria-pressed=true][data-vote]').dataset.vote"), "1")
        # What was answered is seen again before the answer can be changed.
        self.browser.run("speed = 0")
        self.press("ArrowDown")
        self.press("ArrowUp")
        self.browser.press("3", "Digit3")
        self.browser.draw()
        self.assertEqual(self.votes()[:3], [1, 0, 2])
        self.browser.run("speed = 20")
        self.answer("3")
        rows = self.download("#save", "votes-anna.csv")
        self.assertEqual([row["vote"] for row in rows[:4]], ["3", "", "2", ""])
        # At the end, what was left out comes before the questions.
        count = len(self.kit["trials"])
        for _ in range(3):
            self.press("ArrowDown")
        for _ in range(count - 4):
            self.answer("2")
        self.assertEqual(self.screen(), "trial")
        for place in 2, 4:  # and nothing between that is answered
            self.assertEqual(self.browser.text("#place"), f"{place} / {count}")
            self.answer("1")
        self.assertEqual(self.screen(), "survey")
        self.assert_calm()

    def test_alternation_shows_both_materials_of_each_side(self):
        self.show()
        self.begin()
        self.browser.run("speed = 1")
        data = json.loads(self.browser.run("document.getElementById('data').textContent"))
        visible = ("JSON.stringify(['left', 'right'].map(id => [...document.querySelectorAll(`#${id} canvas`)]"
                   ".filter(c => getComputedStyle(c).visibility === 'visible').map(c => "
                   "images.findIndex(lights => c.sphere.src.endsWith(lights[0])))))")
        for _ in range(2):
            self.press("ArrowDown")
            row = self.download("#save", "votes-anna.csv")[self.place() - 1]
            seen, before = [], time.monotonic()
            while len(seen) < 4:
                asked = time.monotonic()
                now = json.loads(self.browser.run(visible))
                self.assertEqual([len(side) for side in now], [1, 1])
                if not seen or seen[-1][0] != now:
                    seen.append((now, before, time.monotonic()))
                before = asked
                time.sleep(0.02)
            # Once a second; a machine that is busy may be late, but not early.
            self.assertGreater(seen[3][2] - seen[1][1], 1.9)
            names = [[data["materials"][side[0]] for side in pair] for pair, *_ in seen]
            shown = {json.dumps(pair) for pair in names}
            self.assertEqual(shown, {json.dumps([row["left_1"], row["right_1"]]),
                                     json.dumps([row["left_2"], row["right_2"]])})
        # What is drawn is the image, whole and pixel by pixel.
        same = self.browser.run("""[...document.querySelectorAll('.side canvas')].map(c => {
            const other = new OffscreenCanvas(48, 48).getContext('2d');
            other.drawImage(c.sphere, 0, 0);
            const bytes = context => context.getImageData(0, 0, 48, 48).data.join();
            return c.width === 48 && c.offsetWidth === 48 && bytes(other) === bytes(c.getContext('2d'));
        })""")
        self.assertEqual(same, [True] * 4)
        self.assert_calm()

    def test_no_answer_before_everything_is_seen(self):
        """At the true speed: whatever a hand does in a hurry, it answers what it has seen."""
        self.show(width=1024, height=700)
        self.begin()
        self.browser.run("speed = 1")
        self.press("ArrowDown")
        self.press("ArrowUp")
        for pause in 0.005, 0.1, 0.5:
            self.until("answerable")
            place, start = self.place(), time.monotonic()
            self.step(lambda: self.browser.press("1", "Digit1"))
            time.sleep(pause)
            self.browser.press("1", "Digit1")
            time.sleep(0.1)
            seen = self.browser.run("[byId('hint').textContent, byId('votes').children[0].getAttribute('aria-disabled'),"
                                    "byId('place').textContent]")
            if time.monotonic() - start < 1.2:  # or else this machine was too busy to be in a hurry
                self.assertIn("Both materials", seen[0])
                self.assertEqual(seen[1:], ["true", f"{place + 1} / {len(self.kit['trials'])}"], pause)
        self.until("answerable")
        self.assertEqual(self.browser.text("#hint"), "")
        self.assertGreaterEqual(min(t for t in self.browser.run("judge.times") if t is not None), 1200)
        # Hammering answers nothing, once it was too early; a pause does.
        self.step(lambda: self.browser.press("2", "Digit2"))
        place, pauses, last = self.place(), [], time.monotonic()
        while sum(pauses) < 2.5:
            self.browser.press("3", "Digit3")
            pauses.append(time.monotonic() - last)
            last += pauses[-1]
        if max(pauses) < 0.25:
            self.assertEqual(self.place(), place)
        self.until("answerable")
        place = self.place()
        # A key that is held down since the configuration before does not answer either.
        self.step(lambda: self.browser.hold("2", "Digit2"))
        end = time.monotonic() + 2.5
        while time.monotonic() < end:
            self.browser.hold("2", "Digit2", autoRepeat=True)
        self.assertEqual(self.place(), place + 1)
        # The mouse: the second half of a double click is too early.
        self.until("answerable")
        self.step(lambda: self.browser.click("[data-vote='3']", 2))
        time.sleep(0.1)
        self.assertEqual(self.place(), place + 2)
        self.assert_calm()

    def test_what_a_tab_does_not_show_is_not_seen(self):
        self.show()
        self.begin()
        self.browser.run("speed = 0")
        self.press("ArrowDown")
        shown = self.browser.run("shownAt")
        first = self.browser.session
        self.browser.new_page()
        self.browser.use(self.browser.session)
        self.browser.session = first
        self.until("document.hidden")
        self.browser.run("speed = 20")
        time.sleep(1)
        self.assertFalse(self.browser.run("answerable"))
        self.browser.use(first)
        # Its time begins again.
        self.until(f"shownAt !== {shown} && answerable")
        self.answer("2")
        self.assertLess(self.browser.run("judge.times[1]"), self.browser.run(f"performance.now() - {shown} - 900"))

    def test_double_clicks_do_not_reach_the_next_screen(self):
        self.show()
        self.name("anna")
        self.answer("3")
        self.until("performance.now() - changedAt > secondClick")
        self.step(lambda: self.browser.click("#begin", 2))
        self.assertEqual(self.votes().count(0), len(self.kit["trials"]))
        # The last answer, where a question comes under the pointer.
        count = len(self.kit["trials"])
        for _ in range(count - 1):
            self.answer("2")
        self.until("answerable")
        self.browser.run("document.addEventListener('mousedown', () => byId('questions').style.cssText = "
                         "'position: fixed; inset: 0; display: grid')")
        self.browser.run("byId('questions').querySelectorAll('label').forEach(l => l.style.cssText = "
                         "'position: fixed; inset: 0')")
        before = self.browser.run("changedAt")
        self.step(lambda: self.browser.click("[data-vote='2']"))
        self.assertEqual(self.screen(), "survey")
        self.assertGreater(self.browser.run("changedAt"), before)
        self.browser.run("changedAt = performance.now() + 60000")  # however long a busy machine takes
        self.browser.click("[name=vision_impairment]")
        self.assertEqual(self.browser.run("judge.survey"), {})
        self.browser.run("changedAt = 0")
        self.browser.click("[name=vision_impairment]")
        self.assertEqual(list(self.browser.run("judge.survey")), ["vision_impairment"])

    def test_keys_of_all_keyboards(self):
        self.show()
        self.begin()
        keys = [
            ("&", "Digit1", 1), ("é", "Digit2", 2), ('"', "Digit3", 3),  # AZERTY
            ("+", "Digit1", 1), ("ě", "Digit2", 2), ("š", "Digit3", 3),  # Czech
            ("١", "Digit1", 1), ("٢", "Digit2", 2), ("٣", "Digit3", 3),  # Arabic
            ("Dead", "Digit2", 2), ("Process", "Digit3", 3),
            ("1", "Numpad1", 1), ("2", "Numpad2", 2), ("3", "Numpad3", 3),
            ("End", "Numpad1", 1), ("ArrowDown", "Numpad2", 2), ("PageDown", "Numpad3", 3),  # NumLock off
            ("1", "", 1), ("٢", "", 2), ("۳", "", 3),  # keyboards on the screen, remote desktops
        ]
        for key, code, vote in keys:
            self.until("answerable")
            location = {"location": 3} if code.startswith("Numpad") else {}
            place = self.place()
            self.step(lambda: self.browser.press(key, code, **location))
            self.assertEqual(self.votes()[place - 1], vote, (key, code))
            self.assertEqual(self.place(), place + 1)
            self.press("ArrowUp")
        # No answer, and nobody is led elsewhere.
        self.until("answerable")
        before = self.browser.run("JSON.stringify([judge.votes, judge.at])")
        for key, code, details in (
            ("ArrowUp", "Numpad8", {"location": 3}), ("ArrowLeft", "Numpad4", {"location": 3}),
            ("ArrowRight", "Numpad6", {"location": 3}), ("4", "Digit4", {}), ("End", "End", {}),
            ("Unidentified", "", {}), ("1", "Digit1", {"modifiers": CONTROL}),
            ("2", "Digit2", {"modifiers": ALT}), ("3", "Numpad3", {"modifiers": META, "location": 3}),
            ("1", "Digit1", {"autoRepeat": True}), ("u", "KeyF", {}), (" ", "Space", {}),
        ):
            self.browser.press(key, code, **details)
            self.browser.draw()
            self.assertEqual(self.browser.run("JSON.stringify([judge.votes, judge.at])"), before, (key, code))
            self.assertEqual(self.screen(), "trial")
            self.assertFalse(self.browser.run("document.fullscreenElement !== null"))
        for key, code in ("f", "KeyF"), ("ب", "KeyF"), ("F", "KeyY"):
            self.browser.press(key, code)
            self.until("document.fullscreenElement !== null")
            self.browser.press(key, code)
            self.until("document.fullscreenElement === null")
        for key, code in ("?", "KeyM"), ("؟", "Slash"), ("?", "Minus"):
            self.browser.press(key, code, modifiers=SHIFT)
            self.until_screen("start")
            self.browser.press("Enter")
            self.until_screen("trial")
        self.assert_calm()

    def test_settings_of_the_viewer_change_nothing(self):
        """Contrast themes, dark mode and its automatic kinds: spheres and surround stay as they are."""
        self.make_kit("light", "--background", "0.9")
        self.addCleanup(shutil.rmtree, self.kits / "light")
        # Small spheres of two colours: what a browser takes for an icon, and inverts.
        page = self.kits / "light" / "index.html"
        disc = b"".join(bytes([0, *(16 if math.hypot(x - 24, y - 24) < 20 else 230 for x in range(48))])
                        for y in range(48))
        image = base64.b64encode(png(48, 48, disc)).decode()
        page.write_text(re.sub(r'(?<=id="images">).*?(?=</script>)', lambda found: json.dumps(
            [[image]] * len(json.loads(found[0]))), page.read_text(), flags=re.DOTALL))
        path = self.work / "window.png"

        def picture(below="sides"):
            """From the upper edge of the spheres down."""
            self.browser.draw()
            top, bottom = self.browser.run(
                "[Math.ceil(byId('sides').getBoundingClientRect().top),"
                f"Math.floor(byId('{below}').getBoundingClientRect().bottom)]")
            return self.browser.screenshot(path, x=0, y=top, width=360, height=bottom - top)

        def show():
            self.show("light", width=360, height=640)
            self.begin()
            self.browser.run("speed = 0")
            self.press("ArrowDown")

        show()
        whole, plain = picture("votes"), picture()
        _, height, rows = read_png(path)
        self.assertEqual(pixel(rows, 180, height // 2), (230, 230, 230))
        self.assertNotEqual(pixel(rows, 90, height // 2), (230, 230, 230))
        for feature, value in (("forced-colors", "active"), ("prefers-contrast", "more"),
                               ("prefers-color-scheme", "dark"), ("prefers-reduced-motion", "reduce")):
            self.browser.call("Emulation.setEmulatedMedia", features=[{"name": feature, "value": value}])
            self.assertTrue(self.browser.run(f"matchMedia('({feature}: {value})').matches"))
            self.assertEqual(picture("votes"), whole, feature)
        self.browser.call("Emulation.setEmulatedMedia", features=[])
        self.browser.call("Emulation.setAutoDarkModeOverride", enabled=True)
        self.assertEqual(picture(), plain)
        # As the user's own setting, on a system that is light, where no page is asked, and on one that is dark.
        for flags in [], ["--force-dark-mode"]:
            self.browser = self.start(flags=["--enable-features=WebContentsForceDark", *flags])
            show()
            self.assertEqual(picture(), plain, flags)
        self.assertEqual(picture("votes"), whole)
        # Extensions that darken pages leave one alone that says so.
        self.assertTrue(self.browser.run("document.querySelector('meta[name=darkreader-lock]') !== null"))

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
        self.answer("1")
        self.browser.run("document.querySelector('#nextJudge').click()")
        # Nobody learns who else was here.
        self.assertNotIn("anna", self.browser.run("document.body.innerText + byId('name').value"))
        self.begin("  =bo\tb  ")
        self.answer("2")
        rows = self.download("#save", "votes-bo_b.csv")
        self.assertEqual((rows[0]["judge"], rows[0]["vote"]), ("bo b", "2"))
        self.browser.run("document.querySelector('#nextJudge').click()")
        # One judge, however the name is written.
        self.browser.call("Input.insertText", text="  ANNA\u00a0")
        self.until("byId('known').textContent.includes('1 of')")
        self.browser.press("Enter")
        self.until_screen("trial")
        self.assertEqual(self.place(), 2)
        rows = self.download("#save", "votes-anna.csv")
        self.assertEqual([rows[0]["vote"], rows[1]["vote"]], ["1", ""])
        self.assertEqual(self.browser.run(
            "[['Åsa', 'ÅSA'], ['Ασ', 'ας'], ['Straße', 'STRAßE'], ['e\u0301', 'É']].map("
            "names => new Set(names.map(n => identity(cleaned(n)))).size)"), [1, 1, 1, 1])
        # As `votes` does it: İ is a letter of its own.
        self.assertEqual(self.browser.run("['İnci', 'inci', 'ıNCI'].map(name => identity(cleaned(name)))"),
                         ["İnci", "inci", "inci"])
        self.assertEqual(self.browser.run("JSON.stringify(orderFor('Anna')) === JSON.stringify(orderFor('anna'))"), True)
        # A tab that is opened anew belongs to nobody.
        self.show_again()
        self.assertEqual(self.screen(), "start")
        self.assertNotIn("anna", self.browser.run("document.body.innerText + byId('name').value").lower())
        self.assert_calm()

    def test_instructions_in_the_middle(self):
        self.show()
        self.begin()
        self.answer("1")
        for way in "document.querySelector('#help').click()", None:
            if way:
                self.browser.run(way)
            else:
                self.browser.press("?", "Slash", modifiers=SHIFT)
            self.until_screen("start")
            self.assertEqual(self.browser.run("document.querySelector('#name').value"), "anna")
            self.until("byId('known').textContent.includes('1 of')")
            self.browser.press("3", "Digit3")  # is no vote here
            self.browser.run("document.querySelector('[data-language=sv]').click()")
            self.browser.run("document.querySelector('[data-language=en]').click()")
            self.browser.run("document.querySelector('#who button').focus()")
            self.browser.press("Enter")
            self.until_screen("trial")
            self.assertEqual(self.place(), 2)
        # Somebody else may begin; the first one goes on later.
        self.browser.press("?", "Slash")
        self.begin("bo")
        self.assertEqual(self.place(), 1)
        self.browser.press("?", "Slash")
        self.name("anna")
        self.until_screen("trial")
        self.assertEqual(self.browser.run("judge.votes.filter(v => v).length"), 1)
        self.assert_calm()

    def test_practice_says_what_was_to_be_seen(self):
        self.show()
        self.begin()
        self.assertIn("the answer was 1", self.browser.text("#practised"))
        self.browser.run("turnTo('practice')")
        self.answer("1")
        self.assertEqual(self.screen(), "ready")
        self.assertIn("So it was", self.browser.text("#practised"))
        practice = self.kit["practice"]
        self.assertEqual(practice["left"][0], practice["left"][1])

    def answer_and_kill(self, digit):
        """Answers, and kills the whole browser as soon as the page has moved on."""
        self.until("answerable")
        self.browser.call("Runtime.addBinding", name="movedOn")
        self.browser.run("new MutationObserver(() => movedOn('')).observe(byId('place'), {childList: true})")
        self.browser.send("Input.dispatchKeyEvent", type="keyDown", key=digit, code=f"Digit{digit}", text=digit)
        self.browser.event("Runtime.bindingCalled")
        self.browser.kill()

    def test_every_vote_is_on_the_disk_when_the_page_moves_on(self):
        profile = self.enterContext(tempfile.TemporaryDirectory(ignore_cleanup_errors=True))
        given = []
        for votes in "1", "32", "321":
            self.browser = self.start(profile=profile)
            self.show()
            if given:
                self.assertEqual(self.screen(), "start")
                self.name("anna")
                self.until_screen("trial")
                self.assertEqual(self.votes()[:len(given) + 1], [*given, 0])
                self.assertEqual(self.place(), len(given) + 1)
            else:
                self.begin()
            for vote in votes[:-1]:
                self.answer(vote)
            self.answer_and_kill(votes[-1])
            given += map(int, votes)
        # The answers to the questions as well.
        self.browser = self.start(profile=profile)
        self.browser.call("Page.addScriptToEvaluateOnNewDocument", source="""
            const begin = IDBDatabase.prototype.transaction;
            window.writes = new Set();
            IDBDatabase.prototype.transaction = function (...all) {
              const transaction = begin.apply(this, all);
              window.writes.add(transaction.durability);
              return transaction;
            };""")
        self.show()
        self.name("anna")
        self.until_screen("trial")
        self.assertEqual(self.votes()[:len(given) + 1], [*given, 0])
        while self.screen() != "survey":
            self.answer("1")
        self.browser.run("document.querySelector('textarea').focus()")
        self.browser.call("Input.insertText", text="all well")
        self.until("desk.loose.size === 0")
        # What no killed process shows: the operating system has written it to the disk, too.
        self.assertEqual(self.browser.run("[...writes]"), ["strict"])
        self.browser.kill()
        self.browser = self.start(profile=profile)
        self.show()
        self.name("anna")
        self.until_screen("survey")
        self.assertEqual(self.votes()[:len(given)], given)
        self.assertEqual(self.browser.run("document.querySelector('textarea').value"), "all well")

    def test_one_tab_of_a_judge_is_at_work(self):
        self.show()
        self.begin()
        self.answer("1")
        first = self.browser.session
        second = self.show_again()
        self.name("Anna")
        self.until_screen("elsewhere")
        self.assertIn("Anna is at work in another tab", self.browser.text("#elsewhere"))
        self.browser.press("2", "Digit2")  # is no vote
        # A reload does not change that; another judge can go on beside.
        self.reload()
        self.until_screen("elsewhere")
        third = self.show_again()
        self.begin("bo")
        self.answer("3")
        self.browser.use(first)
        self.answer("3")
        self.assertEqual(self.votes()[:3], [1, 3, 0])
        # When the first one is closed, the second follows with all of its answers.
        self.browser.close_page()
        self.browser.use(second)
        self.until_screen("trial")
        self.assertEqual(self.place(), 3)
        self.answer("2")
        self.assertEqual(self.votes()[:4], [1, 3, 2, 0])
        # It can also be taken over, in the middle of whatever; the one before says so, and follows in turn.
        fourth = self.show_again()
        self.name("anna")
        self.until_screen("elsewhere")
        self.until("performance.now() - changedAt > secondClick")
        self.browser.click("#takeOver")
        self.until_screen("trial")
        self.answer("1")
        self.browser.use(second)
        self.until_screen("elsewhere")
        # A tab that crashes lets the other go on.
        self.browser.session = fourth
        self.browser.send("Page.crash")
        self.browser.use(second)
        self.until_screen("trial")
        self.assertEqual(self.votes()[:5], [1, 3, 2, 1, 0])
        self.assert_calm()
        self.browser.use(third)
        self.assertEqual(self.votes()[:2], [3, 0])

    def test_no_tab_overwrites_another_where_there_are_no_locks(self):
        without = "Object.defineProperty(Navigator.prototype, 'locks', {value: undefined})"
        self.browser.call("Page.addScriptToEvaluateOnNewDocument", source=without)
        self.show()
        self.begin()
        self.answer("1")
        first = self.browser.session
        second = self.browser.new_page()
        self.browser.set_clock(20)
        self.browser.call("Page.addScriptToEvaluateOnNewDocument", source=without)
        self.show()
        self.name("anna")
        self.until_screen("trial")
        self.answer("2")
        self.answer("2")
        # The first is still at its second configuration, whose answer stays that of the second tab.
        self.browser.use(first)
        self.assertEqual(self.place(), 2)
        self.answer("3")
        self.until("judge.votes[2] === 2")
        self.assertEqual(self.votes()[:4], [1, 2, 2, 0])
        self.until("byId('place').textContent.startsWith('4 ')")
        self.answer("3")
        self.browser.use(second)
        self.answer("1")
        self.until("judge.votes[3] === 3")
        self.assertEqual(self.votes()[:5], [1, 2, 2, 3, 0])

    def test_kits_do_not_see_each_other(self):
        self.make_kit("other", "--seed", "2")
        self.addCleanup(shutil.rmtree, self.kits / "other")
        shutil.copytree(self.kits / "kit", self.kits / "copy")
        self.addCleanup(shutil.rmtree, self.kits / "copy")
        self.show()
        self.begin()
        self.answer("1")
        first = self.browser.session
        other = self.show_again("other")
        self.begin()  # both are open
        self.assertEqual(self.place(), 1)
        self.answer("3")
        self.assertEqual(self.votes()[:2], [3, 0])
        self.browser.use(first)
        self.assertEqual(self.votes()[:2], [1, 0])
        self.reload()
        self.until_screen("trial")
        self.assertEqual(self.votes()[:2], [1, 0])
        # The same page from one kit to the other, as the address bar does it.
        self.show("other")
        self.assertEqual(self.screen(), "start")
        # A copy of the kit is the kit.
        self.browser.use(other)
        self.show("copy")
        self.name("anna")
        self.until_screen("trial")
        self.assertEqual(self.votes()[:2], [1, 0])

    def test_storage_that_is_full_or_broken(self):
        self.show()
        self.begin()
        self.answer("1")
        self.browser.run("put = IDBObjectStore.prototype.put")
        self.browser.run("IDBObjectStore.prototype.put = function () { this.transaction.abort(); }")
        self.answer("2")
        self.assertEqual(self.browser.run("document.getElementById('warning').hidden"), False)
        # Leaving asks, until the votes are in a file or kept after all.
        self.browser.send("Page.reload")
        self.assertEqual(self.browser.event("Page.javascriptDialogOpening")["type"], "beforeunload")
        self.browser.call("Page.handleJavaScriptDialog", accept=False)
        self.assertEqual(self.votes()[:3], [1, 2, 0])
        rows = self.download("#save", "votes-anna.csv")
        self.assertEqual([row["vote"] for row in rows[:3]], ["1", "2", ""])
        self.assertEqual(self.browser.run("desk.loose.size"), 0)
        # Another judge goes on in between, and loses nothing either.
        self.answer("3")
        self.browser.press("?", "Slash")
        self.begin("bo")
        self.answer("3")
        self.browser.press("?", "Slash")
        self.name("anna")
        self.until_screen("trial")
        self.assertEqual(self.votes()[:4], [1, 2, 3, 0])
        self.browser.run("IDBObjectStore.prototype.put = put")
        self.answer("1")
        self.assertEqual(self.browser.run("document.getElementById('warning').hidden"), True)
        self.assertEqual(self.browser.run("[...desks.values()].map(d => d.loose.size)"), [0, 1])
        self.browser.press("?", "Slash")
        self.name("bo")
        self.until_screen("trial")
        self.until("[...desks.values()].every(d => d.loose.size === 0)")
        self.reload()
        self.until_screen("trial")
        self.assertEqual((self.browser.run("judge.name"), self.votes()[:2]), ("bo", [3, 0]))
        # What is no judge of this kit is not taken for one.
        for broken in "null", "[]", "{}", "{judge: {name: 'bo'}}", "{judge: {name: 'bo', order: [], votes: []}}":
            self.browser.run(f"exchange('judge:bo', () => ({broken}))")
            self.reload()
            self.assertEqual(self.screen(), "start", broken)
        self.assert_calm()

    def test_storage_that_is_full_from_the_beginning(self):
        self.browser.call("Storage.overrideQuotaForOrigin", origin="file://", quotaSize=1)
        self.show()
        self.assertFalse(self.browser.run("byId('warning').hidden"))
        self.begin()
        self.answer("2")
        self.assertEqual(self.download("#save", "votes-anna.csv")[0]["vote"], "2")

    def stall(self):
        """Storage answers nobody any more, until `stalled` is false: a transaction that does not end."""
        self.browser.run("""stalled = true; openDatabase().then(opened => new Promise(begun => {
            const store = opened.transaction('kept', 'readwrite').objectStore('kept');
            const hold = () => store.get('language').onsuccess = () => {
              begun();
              if (stalled) hold();
            };
            hold();
        })).then(() => { patience = 300; })""")

    def stored(self):
        """The record of anna."""
        return self.browser.run("exchange('judge:anna', () => undefined)")

    def return_while_storage_stalls(self):
        self.show()
        self.begin()
        for vote in "1231":
            self.answer(vote)
        self.browser.run("keepJudgeOfTab(null)")
        self.reload()
        self.stall()
        self.name("anna")
        self.until_screen("trial")
        self.until("!byId('warning').hidden")
        self.assertEqual((self.browser.text("#place"), self.votes()[:4]), ("Practice", [0, 0, 0, 0]))

    def test_storage_that_stalls_as_a_judge_returns(self):
        self.return_while_storage_stalls()
        self.browser.run("stalled = false")
        # Nothing has to be done: the page goes on where the judge was.
        self.until("byId('place').textContent.startsWith('5 ') && byId('warning').hidden")
        self.assertEqual(self.votes()[:5], [1, 2, 3, 1, 0])
        self.assertEqual(self.stored()["judge"]["votes"][:5], [1, 2, 3, 1, 0])
        self.answer("2")
        self.reload()
        self.until_screen("trial")
        self.assertEqual(self.votes()[:6], [1, 2, 3, 1, 2, 0])
        self.assert_calm()

    def test_what_is_answered_while_storage_stalls_is_joined_to_what_is_stored(self):
        self.return_while_storage_stalls()
        self.answer("1")
        self.step(lambda: self.browser.press("Enter"))
        self.answer("3")
        self.assertEqual(self.votes()[:5], [3, 0, 0, 0, 0])
        # Somebody reads the instructions at the moment when it is back, and is not led away from them.
        self.browser.press("?", "Slash")
        self.until_screen("start")
        self.browser.run("stalled = false")
        self.until("patience === 10000")
        self.assertEqual(self.stored()["judge"]["votes"][:5], [1, 2, 3, 1, 0])
        self.assertEqual(self.screen(), "start")
        self.name("anna")
        self.until("byId('place').textContent.startsWith('5 ') && byId('warning').hidden")
        self.assertEqual(self.votes()[:5], [3, 2, 3, 1, 0])
        self.until("desk.loose.size === 0")
        self.assertEqual(self.stored()["judge"]["votes"][:5], [3, 2, 3, 1, 0])

    def test_storage_that_fails_as_a_judge_returns(self):
        self.show()
        self.begin()
        self.answer("3")
        self.answer("2")
        for name, shown in ("get", [0, 0]), ("put", [3, 2]):  # nothing can be read, or nothing written
            self.browser.run("keepJudgeOfTab(null)")
            self.reload()
            self.browser.run(f"method = IDBObjectStore.prototype.{name}")
            self.browser.run(f"IDBObjectStore.prototype.{name} = function () {{ this.transaction.abort(); return {{}}; }}")
            self.name("anna")
            self.until("!byId('trial').hidden && !byId('warning').hidden")
            self.assertEqual(self.votes()[:2], shown, name)
            self.until("answerable")  # and stays so
            self.browser.run(f"IDBObjectStore.prototype.{name} = method")
            # The next write finds the record, and reads it.
            self.answer("1")
            self.until("byId('warning').hidden && !byId('trial').hidden && !practising()")
            given = [3, 2, 0] if name == "get" else [3, 2, 1]
            self.assertEqual(self.votes()[:3], given, name)
            self.assertEqual(self.stored()["judge"]["votes"][:3], given, name)

    def test_a_judge_who_begins_while_storage_stalls_is_stored_when_it_is_back(self):
        self.show()
        self.stall()
        self.name("anna")
        self.answer("3")
        self.step(lambda: self.browser.press("Enter"))
        self.answer("2")
        self.browser.run("stalled = false")
        self.until("patience === 10000")
        self.until("!byId('trial').hidden && byId('warning').hidden && desk.loose.size === 0")
        self.assertEqual(self.votes()[:2], [2, 0])
        self.answer("1")
        self.assertEqual(self.stored()["judge"]["votes"][:3], [2, 1, 0])

    def test_a_late_attempt_does_not_write_an_old_state(self):
        self.show()
        self.begin()
        self.answer("1")
        self.stall()
        # The second write waits at the database before the second attempt of the first one.
        self.browser.run("""new Promise(done => {
            judge.votes[1] = 1;
            keepJudge('votes');
            setTimeout(() => {
              judge.votes[1] = 2;
              keepJudge('votes');
            }, 200);
            setTimeout(() => done(stalled = false), 400);
        })""")
        self.until("desk.loose.size === 0 && patience === 10000")
        self.assertEqual(self.stored()["judge"]["votes"][:3], [1, 2, 0])

    def test_storage_that_is_cleared_meanwhile(self):
        self.show()
        self.begin()
        self.answer("1")
        self.browser.call("Storage.clearDataForOrigin", origin="file://", storageTypes="all")
        self.answer("2")
        self.reload()
        self.until_screen("trial")
        self.assertEqual(self.votes()[:3], [1, 2, 0])
        self.assertTrue(self.browser.run("byId('warning').hidden"))

    def test_storage_that_is_off(self):
        self.browser = self.start(preferences={
            "profile": {"default_content_setting_values": {"cookies": 2}}})
        self.show(width=1024, height=700)
        self.assertFalse(self.browser.run("byId('warning').hidden"))
        self.begin()
        self.answer("1")
        self.assert_everything_is_in_the_window([(1024, 700), (512, 350), (360, 640)])
        self.browser.send("Page.reload")
        self.assertEqual(self.browser.event("Page.javascriptDialogOpening")["type"], "beforeunload")
        self.browser.call("Page.handleJavaScriptDialog", accept=False)
        rows = self.download("#save", "votes-anna.csv")
        self.assertEqual([row["vote"] for row in rows[:2]], ["1", ""])
        self.reload()  # does not ask
        self.assertEqual(self.screen(), "start")

    def test_touch_and_small_windows(self):
        self.show(width=320, height=480)
        self.begin()
        sizes = [(320, 480), (360, 640), (568, 320), (512, 350), (1024, 700), (1440, 900), (1920, 1080)]
        self.assert_everything_is_in_the_window(sizes)
        self.browser.press("ArrowUp")
        self.browser.run("byId('hint').textContent = text('wait')")
        self.assert_everything_is_in_the_window(sizes)
        self.browser.run("speed = 0")
        self.press("ArrowDown")
        self.browser.tap("[data-vote='2']")  # too early
        self.until("byId('hint').textContent !== ''")
        self.browser.run("speed = 20")
        self.until("answerable")
        self.step(lambda: self.browser.tap("[data-vote='2']"))
        self.assertEqual(self.votes()[:3], [0, 2, 0])

    def test_no_answer_where_spheres_are_too_small_or_out_of_sight(self):
        def resize(width, height):
            self.browser.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                              deviceScaleFactor=1, mobile=False)
            self.browser.draw()

        self.show()
        self.begin()
        for width, height in (200, 150), (120, 100), (60, 700), (1000, 80):
            self.until("answerable")
            shown = self.browser.run("shownAt")
            resize(width, height)
            self.until("!byId('small').hidden")
            self.browser.press("2", "Digit2")
            self.browser.run("document.querySelector('[data-vote=\"3\"]').click()")
            time.sleep(0.2)
            self.assertEqual(self.browser.run("[answerable, judge.votes[0]]"), [False, 0], (width, height))
            if width >= 200:
                top, bottom = self.browser.run("(b => [b.top, b.bottom])(byId('small').getBoundingClientRect())")
                self.assertGreaterEqual(top, 0)
                self.assertLessEqual(bottom, height)
            # In a larger window everything has to be seen from the beginning.
            self.browser.run("speed = 0")
            resize(1200, 900)
            self.until(f"byId('small').hidden && shownAt !== {shown}")
            time.sleep(0.4)
            self.assertFalse(self.browser.run("answerable"))
            self.browser.run("speed = 20")
        self.assertIn("larger", self.browser.text("#small"))
        # Fingers that magnify the page show a part of it.
        self.until("answerable")
        self.browser.call("Emulation.setPageScaleFactor", pageScaleFactor=3)
        self.until("visualViewport.scale > 2 && !byId('small').hidden && !answerable")
        self.browser.call("Emulation.setPageScaleFactor", pageScaleFactor=1)
        self.answer("2")
        self.assertEqual(self.votes()[:2], [2, 0])
        self.assert_calm()

    def test_spheres_of_several_lights_are_as_large_as_they_can_be(self):
        self.make_kit("two-lights", "--light", "1,1,1", "--light", "-1,1,1")
        for width, height, across in (390, 844, "1"), (1600, 500, "2"):
            self.show("two-lights", width=width, height=height)
            if self.screen() == "start":
                self.begin()
            self.until("shownAt")
            self.assertEqual(self.browser.run("byId('left').style.getPropertyValue('--across')"), across)
        # Also when the window changes.
        self.browser.call("Emulation.setDeviceMetricsOverride", width=390, height=844,
                          deviceScaleFactor=1, mobile=False)
        self.until("byId('left').style.getPropertyValue('--across') === '1'")
        self.assert_calm()

    def test_swedish_says_everything(self):
        self.show()
        self.assertEqual(self.browser.run("Object.keys(texts.en).sort().join()"),
                         self.browser.run("Object.keys(texts.sv).sort().join()"))
        self.browser.run("document.querySelector('[data-language=sv]').click()")
        self.assertIn("Vilka sfärer", self.browser.text("#start h1"))
        self.until("exchange('language', () => undefined).then(l => l === 'sv')")
        self.show_again()
        self.assertIn("Vilka sfärer", self.browser.text("#start h1"))
        self.assertEqual(self.browser.run("document.documentElement.lang"), "sv")


class ReferencePage(PageCase):
    """The kit of a reference scan: the original stands still between two approximations."""

    title = "Which sphere looks more like the original?"
    practised = "right sphere looks more like the one in the middle"

    @classmethod
    def select(cls):
        write_reference_selection(cls.kits)

    def on_screen(self):
        """The names of what is seen on the left, in the middle and on the right."""
        shown = self.browser.run(
            "['left', 'middle', 'right'].map(id => [...document.querySelectorAll(`#${id} canvas`)]"
            ".filter(c => getComputedStyle(c).visibility === 'visible').map(c => "
            "kit.materials[images.findIndex(lights => c.sphere.src.endsWith(lights[0]))]))")
        self.assertEqual([len(place) for place in shown], [1, 1, 1])
        return [name for [name] in shown]

    def test_a_whole_experiment_by_keyboard(self):
        self.show()
        start = self.browser.text("#start")
        for words in "Look at the whole sphere", "left sphere looks more like", "all three spheres have been":
            self.assertIn(words, start)
        self.begin()
        self.assertIn("the left sphere was the very one in the middle", self.browser.text("#practised"))
        count = len(self.kit["trials"])
        numbers = random.Random(2)
        votes = [numbers.choice("123") for _ in range(count)]
        seen = []
        for vote in votes:
            self.assertIn("Which of the two outer spheres", self.browser.text("#question"))
            self.until("answerable")
            seen.append(self.on_screen())
            # Nobody learns what the spheres are.
            words = self.browser.run("document.body.innerText + [...document.querySelectorAll('#trial *')]"
                                     ".map(e => e.title + e.getAttribute('aria-label')).join()")
            for label in REFERENCE, *LABELS:
                self.assertNotIn(label, words)
            self.answer(vote)
        self.assertEqual(self.screen(), "survey")
        asked = self.browser.run("[...new Set([...byId('questions').elements].map(e => e.name))].filter(n => n)")
        self.assertEqual(asked, ["instructions_clear", "look_clear", "sphere_size", "keys_easy",
                                 "vision_impairment", "comments"])
        self.browser.run("document.querySelector('#questions button').click()")
        rows = self.download("#saveVotes", "votes-anna.csv")
        self.assert_rows_are_of_the_kit(rows)
        self.assertEqual([row["vote"] for row in rows], votes)
        self.assertEqual([[row["left_2"], row["left_1"], row["right_2"]] for row in rows], seen)
        self.assertEqual([row["left_1"] for row in rows], [row["right_1"] for row in rows])
        self.assertEqual({row["swapped"] for row in rows}, {"0", "1"})
        self.assert_calm()
        self.assert_success("votes", "saved-votes-anna.csv", "--selection",
                            self.kits / "results" / "selection.csv", "--kit",
                            self.page.parent / "kit.json", "--out", "analysis")
        figures = read_json(self.work / "analysis" / "summary.json")["figures"]
        sides = [4 - int(row["vote"]) if row["swapped"] == "1" else int(row["vote"])
                 for row in rows if row["kind"] == "selection"]
        self.assertEqual(figures["judges"][0]["votes"], [sides.count(side) for side in (1, 2, 3)])

    def test_nothing_moves_and_no_answer_comes_before_a_look(self):
        """At the true speed."""
        self.show()
        self.begin()
        self.browser.run("speed = 1")
        self.press("ArrowDown")
        self.press("ArrowUp")
        for _ in range(3):
            self.until("answerable")
            self.step(lambda: self.browser.press("2", "Digit2"))
            self.browser.press("1", "Digit1")
            seen = self.browser.run("[answerable, byId('hint').textContent, performance.now() - shownAt]")
            if seen[2] < 450:  # or else this machine was too busy to be in a hurry
                self.assertEqual(seen[:2], [False, "Look at all three spheres first. Then you can answer."])
        times = [t for t in self.browser.run("judge.times") if t is not None]
        self.assertGreaterEqual(min(times), 450)
        self.until("answerable")
        shown, end = self.on_screen(), time.monotonic() + 2.2
        while time.monotonic() < end:
            self.assertEqual(self.on_screen(), shown)
            time.sleep(0.02)

    def test_layout(self):
        self.program("judge", "--selection", "results/selection.csv", "--size", "300", "--repeats", "0",
                     "--sentinels", "0", "--random", "0", "--out", "large", "--quiet")
        self.addCleanup(shutil.rmtree, self.kits / "large")
        self.show("large", width=320, height=480)
        self.begin()
        sizes = [(320, 480), (390, 844), (568, 320), (768, 1024), (1024, 768), (1400, 900), (1920, 1080)]
        self.assert_everything_is_in_the_window(sizes)
        for width, height in sizes:
            self.browser.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                              deviceScaleFactor=1, mobile=False)
            self.browser.draw()
            left, middle, right = self.browser.run(
                "['left', 'middle', 'right'].map(id => document.querySelector(`#${id} canvas`)"
                ".getBoundingClientRect().toJSON())")
            self.assertEqual({box["width"] for box in (left, middle, right)}, {left["height"]})
            self.assertAlmostEqual(left["left"] + right["right"], middle["left"] + middle["right"], delta=2)
            self.assertEqual(left["top"], right["top"])
            # Neighbours are as near as there is room, and no sphere touches another.
            if width > height:
                self.assertEqual(middle["top"], left["top"])
                self.assertGreaterEqual(middle["left"] - left["right"], 8)
                self.assertLessEqual(middle["left"] - left["right"], 0.45 * width / 3)
            else:
                self.assertGreaterEqual(left["top"] - middle["bottom"], 8)
                self.assertLessEqual(left["top"] - middle["bottom"], 20)
                self.assertGreater(left["width"], 0.3 * width)
        # What the viewer has set changes nothing.
        path = self.work / "window.png"
        place = self.browser.run("(b => ({x: b.x, y: Math.ceil(b.y), width: b.width, height: Math.floor(b.height)}))"
                                 "(byId('sides').getBoundingClientRect())")
        before = self.browser.screenshot(path, **place)
        for feature, value in (("prefers-color-scheme", "dark"), ("forced-colors", "active")):
            self.browser.call("Emulation.setEmulatedMedia", features=[{"name": feature, "value": value}])
            self.browser.draw()
            self.assertEqual(self.browser.screenshot(path, **place), before, feature)

    def test_swedish_says_everything(self):
        self.show()
        self.assertEqual(self.browser.run("Object.keys(texts.en).sort().join()"),
                         self.browser.run("Object.keys(texts.sv).sort().join()"))
        self.browser.run("document.querySelector('[data-language=sv]').click()")
        self.assertIn("Vilken sfär liknar originalet mest?", self.browser.text("#start h1"))
        self.name("bo")
        self.until_screen("trial")
        self.assertIn("Vilken av de två yttre", self.browser.text("#question"))
        self.assertEqual(self.browser.run("[...document.querySelectorAll('#votes span')].map(s => s.textContent)"),
                         ["Den vänstra liknar mest", "Båda lika mycket", "Den högra liknar mest"])


if __name__ == "__main__":
    support.main()
