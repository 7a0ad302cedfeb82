"""A study from its file to its figures: the kit, judges' files that examples/receiver.py collects, one `votes` command."""

import http.client
import json
import pathlib
import random
import statistics
import subprocess
import sys
import urllib.parse

import support
from browser import CHROMIUM, Browser
from support import Case, read_csv, read_json, write_database

RECEIVER = pathlib.Path(__file__).parents[3] / "examples" / "receiver.py"

STUDY = {
    "languages": ["en"], "consent": "You may take part.", "timing": {"break_every": 5},
    "calibration": {"card": True, "gamma": True},
    "before": [{"name": "age", "kind": "number", "text": "How old are you?", "required": True}],
    "after": [{"name": "sure", "kind": "scale", "text": "How sure were you?", "least": 1, "most": 5},
              {"name": "comments", "kind": "text", "text": "What did you look at?"}],
    "exclusion": {"sentinels_failed": 2, "repeats_below": 0.5, "median_time_below": 1.5, "same_key_above": 0.9,
                  "calibration_failed": True},
}


class Collected(Case):
    def judge_file(self, kit, name, choose, seconds=2.5, gamma=2.2, **survey):
        """What the page sends of a judge who answers a trial with choose(side of the right answer on the screen)."""
        lots = random.Random(name)
        trials = []
        for trial in lots.sample(kit["trials"], len(kit["trials"])):
            swapped = lots.random() < 0.5
            right = trial.get("expected", 3)
            left_pair, right_pair = (trial["right"], trial["left"]) if swapped else (trial["left"], trial["right"])
            vote = choose(4 - right if swapped else right)
            time = round(1000 * lots.uniform(0.9, 1.1) * seconds)
            trials.append({"trial": len(trials) + 1, "configuration": trial["configuration"], "kind": trial["kind"],
                           "left": left_pair, "right": right_pair, "swapped": int(swapped), "vote": vote, "response_ms": time,
                           "looks": 1, "shown_ms": 1000 * seconds, "changes": [{"vote": vote, "response_ms": time}]})
        return {"format": "merl-scan judge", "version": 1, "kit_hash": kit["kit_hash"], "study_hash": kit["study_hash"],
                "seed": kit["seed"], "judge": name, "token": f"{lots.getrandbits(128):032x}", "complete": True,
                "consent": {"language": "en", "given": "2026-01-01T12:00:00.000Z"}, "panel": {},
                "calibration": {"passed": 1.8 <= gamma <= 2.6, "pixel_ratio": 1, "css_px_per_mm": 4, "distance_mm": 600,
                                "gammas": [gamma, gamma], "gamma": gamma},
                "sessions": [{"begun": "2026-01-01T12:00:00.000Z"}], "practice": {"attempts": 1, "passed": True, "answers": []},
                "survey": {"age": "", "sure": "", "comments": "", **survey}, "trials": trials}

    def collect(self, *messages):
        """The files of a receiver that was sent these."""
        process = subprocess.Popen(
            [sys.executable, RECEIVER, "--kit", self.work / "kit" / "kit.json", "--out", self.work / "received", "--port", "0", "--quiet"],
            stdout=subprocess.PIPE, encoding="utf-8")
        try:
            address = urllib.parse.urlsplit(process.stdout.readline().split()[2])
            for message in messages:
                connection = http.client.HTTPConnection(address.hostname, address.port, timeout=60)
                connection.request("POST", "/", json.dumps(message).encode(), {"Content-Type": "text/plain;charset=UTF-8"})
                response = connection.getresponse()
                self.assertEqual(response.status, 200, response.read())
                connection.close()
        finally:
            process.kill()
            process.wait()
            process.stdout.close()
        return sorted((self.work / "received").glob("*.json"))

    def falls(self, kit, file):
        """The rules of the study that a judge falls under, by the words of docs/experiment.md."""
        expected = {trial["configuration"]: trial["expected"] for trial in kit["trials"] if "expected" in trial}
        firsts, repeats, failed = {}, {}, 0
        for trial in file["trials"]:
            side = 4 - trial["vote"] if trial["swapped"] else trial["vote"]
            if trial["kind"] == "sentinel":
                failed += side != expected[trial["configuration"]]
            (repeats if trial["kind"] == "repeat" else firsts)[trial["configuration"]] = side
        alike = [firsts[number] == side for number, side in repeats.items()]
        keys = [trial["vote"] for trial in file["trials"]]
        tests = {"sentinels_failed": failed >= 2, "repeats_below": sum(alike) / len(alike) < 0.5,
                 "median_time_below": statistics.median(trial["response_ms"] for trial in file["trials"]) < 1500,
                 "same_key_above": max(keys.count(key) for key in (1, 2, 3)) / len(keys) > 0.9,
                 "calibration_failed": not file["calibration"]["passed"]}
        return [rule for rule, holds in tests.items() if holds]

    def test_from_the_study_to_the_figures(self):
        if CHROMIUM is None:
            raise AssertionError("there is no chromium; scripts/setup.sh installs it")
        write_database(self.work / "db", 14)
        (self.work / "study.json").write_text(json.dumps(STUDY))
        self.scan("--database", "db", "--select", "10", out="results")
        self.assert_success("judge", "--selection", "results/selection.csv", "--size", "16", "--sentinels", "4", "--random", "5",
                            "--repeats", "40", "--study", "study.json", "--post", "https://example.org/", "--out", "kit", "--quiet")
        kit = read_json(self.work / "kit" / "kit.json")
        self.assertGreaterEqual(sum(trial["kind"] == "sentinel" for trial in kit["trials"]), 2)
        self.assertEqual(kit["exclusion"], STUDY["exclusion"])
        lots = random.Random(1)
        careful = lambda right: right if lots.random() < 0.9 else 2
        files = [self.judge_file(kit, "anna", careful, age="44", sure="4", comments="=1+1 highlights"),
                 self.judge_file(kit, "bo", careful, age="30", sure="2"),
                 self.judge_file(kit, "cecilia", careful, age="31", sure="2"),
                 self.judge_file(kit, "dan careless", lambda right: 1, seconds=0.15, gamma=1.2, age="19", sure="5", comments="nothing"),
                 self.judge_file(kit, "eva at a dim screen", careful, gamma=3.1, age="70", sure="3")]
        gone = self.judge_file(kit, "who withdrew", careful, age="50")
        withdrawal = {"format": "merl-scan withdrawal", "version": 1, "kit_hash": kit["kit_hash"], "token": gone["token"]}
        received = self.collect(*files, gone, withdrawal)
        self.assertEqual(len(received), len(files))
        arguments = ("votes", *received, "--selection", "results/selection.csv", "--kit", "kit/kit.json")
        output = self.assert_success(*arguments, "--out", "analysis")
        expected = {file["judge"]: self.falls(kit, file) for file in files}
        self.assertEqual([expected["anna"], expected["bo"], expected["cecilia"], expected["eva at a dim screen"]],
                         [[], [], [], ["calibration_failed"]])
        self.assertLessEqual({"median_time_below", "same_key_above", "calibration_failed"}, set(expected["dan careless"]))
        summary = read_json(self.work / "analysis" / "summary.json")
        self.assertEqual({j["judge"]: [r["rule"] for r in j["rules"]] for j in summary["exclusion"]["judges"]},
                         {judge: rules for judge, rules in expected.items() if rules})
        header, rows = read_csv(self.work / "analysis" / "judges.csv")
        self.assertEqual({row[0]: row[header.index("excluded_by")].split() for row in rows}, expected)
        for words in ("excluded        2 of 5 judges, by sentinels_failed=2 (kit.json), ", "dan careless: calibration failed",
                      "eva at a dim screen: calibration failed", "dan careless has a median response of 0.15 s"):
            self.assertIn(words, output)
        # The figures without them are those of the others' files alone, and what the careful said.
        kept = [path for path in received if not expected[read_json(path)["judge"]]]
        self.assert_success("votes", *kept, *arguments[len(received) + 1:], "--out", "kept", "--quiet")
        figures = read_json(self.work / "kept" / "summary.json")["figures"]
        self.assertEqual(summary["exclusion"]["figures"], figures)
        counts = [0, 0, 0]
        for file in files[:3]:
            for trial in file["trials"]:
                if trial["kind"] == "selection":
                    counts[(4 - trial["vote"] if trial["swapped"] else trial["vote"]) - 1] += 1
        self.assertEqual(figures["selection"]["votes"], counts)
        # Everybody's answers to the questions, as data for a spreadsheet; in the page, of those who are counted.
        _, rows = read_csv(self.work / "analysis" / "survey.csv")
        self.assertEqual([question for _, question, _ in rows[:3]], ["age", "sure", "comments"])  # as the page has them
        answers = {(file["judge"], question): "'" + answer if answer.startswith("=") else answer
                   for file in files for question, answer in file["survey"].items()}
        self.assertEqual({(judge, question): answer for judge, question, answer in rows}, answers)
        with Browser() as browser:
            browser.open(self.work / "analysis" / "votes.html")
            for counted, judges in (("all", {file["judge"] for file in files}), ("kept", {"anna", "bo", "cecilia"}), ("all", set(expected))):
                browser.click(f"#counted input[value={counted}]")
                said = browser.run("[...document.querySelectorAll('#survey tbody td:last-child')].map(c => c.textContent)")
                self.assertEqual({judge for cell in said for judge in cell.split(": ")[1].split(", ")}, judges)
            self.assertEqual(browser.complaints(), [])


if __name__ == "__main__":
    support.main()
