"""merl-scan judge --study: the template, what is refused and where, and what a kit records of it."""

import json
import pathlib
import re
import shutil
import subprocess
import tempfile

import support
from support import INPUT, PROGRAM, USAGE, Case, read_json, write_database


def without_comments(text):
    return re.sub(r"//.*$", "", text, flags=re.MULTILINE)


class Study(Case):
    @classmethod
    def setUpClass(cls):
        cls.scanned = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        write_database(cls.scanned / "db", 6)
        subprocess.run([PROGRAM, "scan", "--database", "db", "--select", "4", "--out", "results", "--quiet"],
                       cwd=cls.scanned, check=True)

    def setUp(self):
        super().setUp()
        shutil.copytree(self.scanned, self.work, dirs_exist_ok=True)

    def options(self, *more, size=16):
        return ("judge", "--selection", "results/selection.csv", "--size", size, "--sentinels", "0", "--random", "0",
                "--out", "kit", *more)

    def judge(self, study, *more, size=16):
        text = study if isinstance(study, str) else json.dumps(study)
        (self.work / "study.json").write_text(text, encoding="utf-8")
        output = self.assert_success(*self.options("--force", "--study", "study.json", *more, size=size))
        return output, read_json(self.work / "kit" / "kit.json")

    def refused(self, study, *words):
        text = study if isinstance(study, str) else json.dumps(study)
        (self.work / "study.json").write_text(text, encoding="utf-8")
        return self.assert_refused(INPUT, ["study.json", *words], *self.options("--study", "study.json"))

    def test_the_template_is_the_default_and_explains_itself(self):
        template = self.assert_success("judge", "--study-template")
        output, kit = self.judge(template)
        self.assertIn("study", output)
        study = kit["study"]
        # What is null in it is decided by the rest.
        given = json.loads(without_comments(template))
        self.assertEqual(list(study), list(given))
        self.assertEqual({value for value in study["record"].values()}, {False})
        self.assertEqual(study["timing"], {**given["timing"], "earliest_ms": 1250})
        self.assertEqual(kit["exclusion"], {})
        # An empty one is the same, but for its hash.
        other = self.judge("{}")[1]
        self.assertEqual(other["study"], study)
        self.assertNotEqual(other["study_hash"], kit["study_hash"])
        self.assertNotEqual(other["kit_hash"], kit["kit_hash"])
        # Every key has a comment above, and every text of the page is there.
        lines = template.splitlines()
        explained = [line for before, line in zip(lines, lines[1:]) if re.match(r'\s+"', line) and "//" in before]
        self.assertGreater(len(explained), 35)
        for path in ("title", "consent", "record", "sentinels_failed", "withdrawText", "statement1"):
            self.assertIn(f'"{path}"', template)
        # A kit without a study file says nothing of one.
        self.assert_success(*self.options("--force"))
        plain = read_json(self.work / "kit" / "kit.json")
        self.assertEqual([key for key in ("study", "study_hash", "exclusion", "post", "more_practice") if key in plain], [])

    def test_faults_are_named_by_their_key(self):
        question = {"name": "q", "kind": "choice", "text": "?", "choices": ["a", "b"]}
        scale = {"name": "q", "kind": "scale", "text": "?"}
        for study, *words in (
                ({"titel": "x"}, "titel: is no key", "title"), ([], "expected an object"),
                ({"format": 2}, "newer merl-scan"),
                ({"title": 1}, "title: found 1", "a text"), ({"title": "  "}, "title:"),
                ({"title": {"en": "x"}}, 'title: has no text for "sv"'),
                ({"title": {"en": "x", "sv": "y", "fi": "z"}}, "title.fi: is no key"),
                ({"languages": []}, "languages: found []"), ({"languages": ["e n"]}, "languages[0]"),
                ({"languages": ["en", "en"]}, "languages[1]", "second time"),
                ({"languages": ["en", "fi"]}, "texts.fi", "texts are missing"),
                ({"language": "fi"}, "language: found", "en, sv"),
                ({"instructions": "mine"}, "instructions", '"kit", "thesis"'),
                ({"instructions": "thesis", "languages": ["sv"]}, "languages", "English"),
                ({"surround": "grey|light"}, "surround:"), ({"surround": True}, "surround:"),
                ({"timing": 1}, "timing: found 1", "an object"), ({"timing": {"period": 1}}, "timing.period: is no key"),
                ({"timing": {"period_ms": "1"}}, 'timing.period_ms: found "1"', "200 to 10000"),
                ({"timing": {"period_ms": 100}}, "timing.period_ms: found 100"),
                ({"timing": {"period_ms": 1000.5}}, "timing.period_ms: found 1000.5", "whole"),
                ({"timing": {"earliest_ms": 1249}}, "timing.earliest_ms", "1250"),
                ({"timing": {"period_ms": 2000, "earliest_ms": 1500}}, "timing.earliest_ms", "2250"),
                ({"timing": {"latest_ms": 1300}}, "timing.latest_ms", "earliest_ms"),
                ({"timing": {"between": "music"}}, "timing.between"),
                ({"practice": {"trials": 2, "pass": 3}}, "practice.pass", "practice.trials, 2"),
                ({"spheres": {"unit": "degrees", "diameter": 2}}, "spheres.unit", "calibration.card"),
                ({"spheres": {"unit": "pixels"}}, "spheres.diameter"), ({"spheres": {"diameter": 2}}, "spheres.diameter"),
                ({"exclusion": {"repeats_below": 1.1}}, "exclusion.repeats_below: found 1.1"),
                # What votes would refuse when everybody has taken part.
                ({"exclusion": {"repeats_below": 0}}, "exclusion, repeats_below: found 0", "above 0"),
                ({"exclusion": {"median_time_below": 0}}, "exclusion, median_time_below: found 0", "above 0"),
                ({"exclusion": {"same_key_above": 1}}, "exclusion, same_key_above: found 1", "below 1"),
                ({"exclusion": {"calibration_failed": True}}, "exclusion.calibration_failed", "calibration.gamma"),
                ({"calibration": {"gamma_least": 3}}, "calibration.gamma_most", "more than gamma_least, 3"),
                ({"calibration": {"card": 1}}, "calibration.card: found 1", "true or false"),
                ({"record": {"browser": True}}, "record.browser", "consent"),
                ({"texts": {"en": {"begin": 1}}}, "texts.en.begin: found 1"),
                ({"texts": {"en": {"bgin": "x"}}}, "texts.en.bgin: is no text"),
                ({"texts": {"en": {"begin": "{name} begins"}}}, "texts.en.begin: found {name}"),
                ({"before": {}}, "before: found {}"), ({"before": [1]}, "before[0]: found 1"),
                ({"before": [{"name": "q", "kind": "text"}]}, 'before[0]: "text" is missing'),
                ({"before": [{**question, "kind": "poem"}]}, "before[0].kind"),
                ({"before": [{**question, "name": "Q q"}]}, "before[0].name"),
                ({"before": [{**question, "name": "__proto__"}]}, "before[0].name"),
                ({"before": [{**question, "least": 1}]}, "before[0].least: is no key"),
                ({"before": [{**question, "choices": ["a"]}]}, "before[0].choices"),
                ({"before": [{**question, "choices": ["a", "a"]}]}, "before[0].choices[1]", "second time"),
                ({"before": [{**question, "choices": ["a", {"answer": "b"}]}]}, 'before[0].choices[1]: "text" is missing'),
                ({"before": [{**scale, "most": 1}]}, "before[0].most"), ({"before": [{**scale, "most": 50}]}, "before[0].most"),
                ({"before": [question], "after": [question]}, "after[0].name", "second time"),
                ({"before": [{**question, "name": "comments"}]}, 'found "comments"', "afterwards")):
            with self.subTest(study=study):
                self.refused(study, *words)
        self.refused('{\n  "title": "x",\n  "languages": ["en"\n  "consent": null\n}', "no JSON", "line 4")
        self.refused('{"title": "a", "title": "b"}', 'the key "title" twice')
        self.refused('{"title": ' + "[" * 200_000 + "]" * 200_000 + "}", "nested more than 100 deep")
        self.refused('{"title": "\xff"}'.encode("latin-1").decode("latin-1").replace("\xff", "\x00"), "no JSON")
        self.assert_refused(INPUT, ["none.json", "cannot be opened"], *self.options("--study", "none.json"))

    def test_what_is_recorded_of_a_study(self):
        study = {"consent": {"en": "Yes?", "sv": "Ja?"}, "exclusion": {"median_time_below": 0.8, "same_key_above": 0.95},
                 "practice": {"trials": 4}, "record": {"browser": False}}
        text = "// mine\n" + json.dumps(study) + "\n"
        _, kit = self.judge(text, "--post", "HTTP://Example.org:8080/a?b=c")
        self.assertEqual(kit["exclusion"], {"median_time_below": 0.8, "same_key_above": 0.95})
        self.assertEqual(kit["study"]["consent"], study["consent"])
        self.assertEqual((kit["study"]["record"]["browser"], kit["study"]["record"]["screen"]), (False, True))
        self.assertEqual(kit["post"], "HTTP://Example.org:8080/a?b=c")
        page = (self.work / "kit" / "index.html").read_text(encoding="utf-8")
        self.assertIn("; connect-src http://example.org:8080\"", page)
        # Practice whose right answer is the left, the right, and so on.
        practices = [kit["practice"], *kit["more_practice"]]
        self.assertEqual(len(practices), 4)
        for number, practice in enumerate(practices):
            still, other = ("left", "right") if number % 2 == 0 else ("right", "left")
            self.assertEqual(len(set(practice[still])), 1)
            self.assertEqual(len(set(practice[other])), 2)
        # What the kit recorded is a study file that gives the same study.
        _, again = self.judge(kit["study"], "--post", "HTTP://Example.org:8080/a?b=c")
        self.assertEqual(again["study"], kit["study"])

    def test_addresses_to_post_to(self):
        for address in ("ftp://a/", "example.org", "http://", "http://a b/", "https://u@a/", "https://a;b/", "https://a'/", "https://a/#b",
                        "https://a/\"", "https://a:123456/", "https://a:65536/", "https://a/\u00e5",
                        "https://[::1]:80/"):  # which a policy of a page has no place for
            with self.subTest(address=address):
                self.assert_refused(USAGE, ["--post", "http"], *self.options("--post", address))
        for address in "https://a", "http://127.0.0.1:8765/", "https://localhost:65535/x?y=%20":
            self.assert_success(*self.options("--force", "--post", address))

    def test_exposure_by_image_clips_a_hundredth(self):
        output, kit = self.judge({"spheres": {"exposure": "by image"}}, size=64)
        shares = [share for lights in kit["images"]["clipped"].values() for share in lights]
        self.assertEqual(len(shares), len(kit["database"]["material_hashes"]))
        for share in shares:
            self.assertGreater(share, 0.005)
            self.assertLessEqual(share, 0.01)
        self.assertIn("have pixels brighter than white", output)
        stops = [stop for lights in kit["images"]["exposure"].values() for stop in lights]
        self.assertGreater(len(set(stops)), 1)
        # A stop less for all.
        _, darker = self.judge({"spheres": {"exposure": "by image"}}, "--exposure", "-1", size=64)
        for name, lights in darker["images"]["exposure"].items():
            self.assertAlmostEqual(lights[0], kit["images"]["exposure"][name][0] - 1)
        self.assertLess(max(share for lights in darker["images"]["clipped"].values() for share in lights), min(shares))

    def judge_file(self, kit, name):
        """What the page would save: everything in one file, and as CSV."""
        trials, rows = [], ["judge,trial,configuration,kind,left_1,left_2,right_1,right_2,swapped,vote,response_ms,seed,kit_hash"]
        for place, trial in enumerate(kit["trials"]):
            swapped = place % 2
            left, right = (trial["right"], trial["left"]) if swapped else (trial["left"], trial["right"])
            vote, time = (None, None) if place == 2 else (1 + place % 3, 1500 + place)
            trials.append({"trial": place + 1, "configuration": trial["configuration"], "kind": trial["kind"], "left": left,
                           "right": right, "swapped": swapped, "vote": vote, "response_ms": time, "looks": 1})
            rows.append(",".join(map(str, [name, place + 1, trial["configuration"], trial["kind"], *left, *right, swapped,
                                           "" if vote is None else vote, "" if time is None else time, 1, kit["kit_hash"]])))
        return {"format": "merl-scan judge", "version": 1, "kit_hash": kit["kit_hash"], "judge": name, "trials": trials,
                "survey": {"age": "30", "comments": ""}, "calibration": {"passed": False, "gamma": 1.2}}, "\n".join(rows) + "\n"

    def test_votes_reads_the_one_file(self):
        _, kit = self.judge({"calibration": {"gamma": True}, "before": [{"name": "age", "kind": "number", "text": "Age?"}]})
        (self.work / "mixed").mkdir()
        for name in "ann", "bo", "cy":
            everything, rows = self.judge_file(kit, name)
            (self.work / f"{name}.json").write_text(json.dumps(everything))
            (self.work / f"{name}.csv").write_text(rows)
            (self.work / f"{name}-survey.csv").write_text(f"judge,question,answer\n{name},age,30\n{name},comments,\n")
        votes = ("--selection", "results/selection.csv", "--kit", "kit/kit.json", "--quiet")
        self.assert_success("votes", "ann.csv", "bo.csv", "cy.csv", *votes, "--out", "csv",
                            "--survey", "ann-survey.csv", "bo-survey.csv", "cy-survey.csv")
        self.assert_success("votes", "ann.json", "bo.csv", "cy.json", *votes, "--out", "json", "--survey", "bo-survey.csv")
        for name in "configurations.csv", "judgements.csv":
            self.assertEqual((self.work / "json" / name).read_text(), (self.work / "csv" / name).read_text(), name)
        self.assertEqual(sorted((self.work / "json" / "survey.csv").read_text().splitlines()),
                         sorted((self.work / "csv" / "survey.csv").read_text().splitlines()))
        # What judges wrote themselves is in no picture, though all wrote the same.
        self.assertIn('"age"', (self.work / "json" / "votes.html").read_text())
        self.assertNotIn("survey-age", (self.work / "json" / "votes.html").read_text())
        # A judge who has changed an answer between two saves would count twice.
        changed, _ = self.judge_file(kit, "ann")
        (self.work / "later.json").write_text(json.dumps({**changed, "survey": {**changed["survey"], "age": "31"}}))
        said = self.run_program("votes", "ann.json", "later.json", *votes, "--out", "changed")
        self.assertEqual(said.returncode, 0, said.stderr)
        self.assertIn("1 answer beside another one of the same judge", said.stderr)
        # Of two saves of one judge the one that was counted may be the table, which says nothing of the screen.
        said = self.run_program("votes", "ann.csv", "ann.json", "bo.json", "cy.csv", *votes, "--out", "twice",
                                "--exclude", "calibration_failed=true")
        self.assertEqual(said.returncode, 0, said.stderr)
        self.assertIn('ann.json: has the same votes of "ann" as ann.csv', said.stderr)
        excluded = read_json(self.work / "twice" / "summary.json")["exclusion"]["judges"]
        self.assertEqual([judge["judge"] for judge in excluded], ["ann", "bo"])
        good, _ = self.judge_file(kit, "dan")
        first, *others = good["trials"]
        for bad, *words in (("{", "no JSON", "line 1"), ('{"format": ' + "[" * 200_000 + "]" * 200_000 + "}", "nested more than 100 deep"),
                            ('{"format": "merl-scan judge", "judge": "a", "judge": "b"}', 'the key "judge" twice'),
                            (json.dumps(good).replace('"vote": 1', '"vote": 1e999', 1), "no JSON"), ({"format": "x"}, "format", "merl-scan judge"),
                            ({**good, "version": 2}, "version: found 2", "newer"), ({**good, "judge": ""}, "judge:", "a name"),
                            ({**good, "trials": []}, "trials: found []"), ({**good, "trials": [1]}, "trials[0]", "an object"),
                            ({**good, "trials": [first, first]}, "trials[1]", "a second time"),
                            ({**good, "trials": [{**first, "vote": 4}, *others]}, "trials[0], vote: found 4", "1 to 3"),
                            ({**good, "trials": [{**first, "swapped": True}, *others]}, "trials[0], swapped"),
                            ({**good, "trials": [{**first, "left": ["m1"]}, *others]}, "trials[0], left", "2"),
                            ({**good, "trials": [{**first, "response_ms": -1}, *others]}, "trials[0], response_ms"),
                            ({**good, "survey": []}, "survey: found []"), ({**good, "survey": {"age": 1}}, "survey, age: found 1"),
                            ({**good, "calibration": {"passed": 1}}, "calibration, passed: found 1"),
                            ({key: value for key, value in good.items() if key != "trials"}, '"trials" is missing')):
            with self.subTest(bad=str(bad)[:80]):
                (self.work / "bad.json").write_text(bad if isinstance(bad, str) else json.dumps(bad))
                self.assert_refused(INPUT, ["bad.json", *words], "votes", "bad.json", *votes, "--out", "none")

    def test_what_a_quick_judge_can_have_seen(self):
        """The second material comes after a second, or when the study says."""
        for study, hasty in ({}, True), ({"timing": {"period_ms": 400}}, False):
            _, kit = self.judge(study)
            everything, _ = self.judge_file(kit, "ann")
            for trial in everything["trials"]:
                trial["response_ms"] = None if trial["vote"] is None else 700
            (self.work / "ann.json").write_text(json.dumps(everything))
            self.assert_success("votes", "ann.json", "--selection", "results/selection.csv", "--kit", "kit/kit.json",
                                "--quiet", "--force", "--out", "analysis")
            (judge,) = read_json(self.work / "analysis" / "summary.json")["figures"]["judges"]
            self.assertEqual(any("median response of 0.7 s" in doubt for doubt in judge["looks_wrong"]), hasty)

    def test_the_selection_is_needed(self):
        self.assert_refused(USAGE, ["--selection"], "judge", "--out", "kit")


if __name__ == "__main__":
    support.main()
