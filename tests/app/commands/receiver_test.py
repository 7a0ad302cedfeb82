"""examples/receiver.py: what it takes, what it refuses, and that nothing it answered for is lost."""

import concurrent.futures
import hashlib
import http.client
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

RECEIVER = pathlib.Path(__file__).parents[3] / "examples" / "receiver.py"

KIT = {"kit_hash": "k" * 32, "trials": [
    {"configuration": 1, "kind": "selection", "left": ["a", "b"], "right": ["c", "d"]},
    {"configuration": 2, "kind": "selection", "left": ["a", "c"], "right": ["b", "d"]},
    {"configuration": 1, "kind": "repeat", "left": ["a", "b"], "right": ["c", "d"]},
]}


def file_of(number, **changes):
    """The file of a judge."""
    trials = [{**trial, "trial": place + 1, "vote": 1 + (number + place) % 3} for place, trial in enumerate(KIT["trials"])]
    return {"format": "merl-scan judge", "version": 1, "kit_hash": KIT["kit_hash"], "judge": f"judge {number}",
            "token": f"{number:032x}", "trials": trials, **changes}


class ReceiverCase(unittest.TestCase):
    def setUp(self):
        self.work = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (self.work / "kit.json").write_text(json.dumps(KIT))
        self.out = self.work / "received"
        self.process = None
        self.addCleanup(self.stop)

    def start(self, *options):
        self.process = subprocess.Popen(
            [sys.executable, RECEIVER, "--kit", self.work / "kit.json", "--out", self.out, "--port", "0", "--quiet",
             "--per-minute", "1000", "--per-minute-of-all", "1000", *options], stdout=subprocess.PIPE, encoding="utf-8")
        line = self.process.stdout.readline()
        self.host, port = re.search(r"http://([0-9.]+):([0-9]+)/", line).groups()
        self.port = int(port)

    def stop(self):
        if self.process:
            self.process.kill()
            self.process.wait()
            self.process.stdout.close()
            self.process = None

    def post(self, body, method="POST", **headers):
        """The status and what is answered."""
        if not isinstance(body, bytes):
            body = json.dumps(body).encode()
        connection = http.client.HTTPConnection(self.host, self.port, timeout=60)
        try:
            connection.request(method, "/", body, {"Origin": "null", "Content-Type": "text/plain", **headers})
            response = connection.getresponse()
            self.assertEqual(response.getheader("Access-Control-Allow-Origin"), "*")
            return response.status, json.loads(response.read())
        finally:
            connection.close()

    def files(self):
        return {path.name: path.read_bytes() for path in self.out.iterdir()}


class Receiver(ReceiverCase):
    def test_a_hundred_judges_at_once(self):
        self.start()
        self.assertEqual(self.host, "127.0.0.1")
        bodies = [json.dumps(file_of(number)).encode() for number in range(100)]
        with concurrent.futures.ThreadPoolExecutor(100) as pool:
            answers = list(pool.map(self.post, bodies))
        self.assertEqual(answers, [(200, {"stored": len(body)}) for body in bodies])
        self.assertEqual(sorted(self.files().values()), sorted(bodies))
        # The same judge again, with more answers: one file, the later one.
        later = file_of(7, complete=True)
        self.assertEqual(self.post(later)[0], 200)
        self.assertEqual(len(self.files()), 100)
        self.assertIn(json.dumps(later).encode(), self.files().values())

    def test_what_it_answered_for_survives_a_kill(self):
        self.start()
        bodies = [json.dumps(file_of(number, comment="x" * 10_000)).encode() for number in range(100)]
        stored = []

        def send(body):
            try:
                if self.post(body)[0] == 200:
                    stored.append(body)
                if len(stored) == 30:
                    os.kill(self.process.pid, signal.SIGKILL)
            except (OSError, http.client.HTTPException):
                pass  # it was killed before it answered

        with concurrent.futures.ThreadPoolExecutor(20) as pool:
            list(pool.map(send, bodies))
        self.assertGreaterEqual(len(stored), 30)
        self.assertLess(len(stored), 100)
        # Every file that has a name of its own is whole, and every one that was answered for is there.
        whole = {content for name, content in self.files().items() if name.endswith(".json")}
        self.assertLessEqual(set(stored), whole)
        self.assertLessEqual(whole, set(bodies))
        # It goes on, and clears away what was under way.
        self.stop()
        (self.out / ".receiving-left").write_bytes(b"half")
        self.start()
        self.assertEqual([name for name in self.files() if not name.endswith(".json")], [])
        for body in bodies:
            self.assertEqual(self.post(body)[0], 200)
        self.assertEqual(set(self.files().values()), set(bodies))

    def test_withdrawal_deletes_and_what_comes_late_stays_out(self):
        self.start()
        for number in range(3):
            self.assertEqual(self.post(file_of(number))[0], 200)
        gone = {"format": "merl-scan withdrawal", "version": 1, "kit_hash": KIT["kit_hash"], "token": f"{1:032x}"}
        self.assertEqual(self.post(gone)[0], 200)
        self.assertEqual(self.post(gone)[0], 200)  # it may be asked twice
        kept = [content for name, content in self.files().items() if name.endswith(".json")]
        self.assertEqual(sorted(json.loads(content)["judge"] for content in kept), ["judge 0", "judge 2"])
        # An attempt to send that was still under way.
        self.assertEqual(self.post(file_of(1))[0], 410)
        # Nothing of the judge is left, nor the token.
        everything = b"".join(name.encode() + content for name, content in self.files().items())
        self.assertNotIn(b"judge 1", everything)
        self.assertNotIn(f"{1:032x}".encode(), everything)
        # Nobody else's token erases.
        name = f"judge-{hashlib.sha256(b'x').hexdigest()[:32]}"
        self.assertEqual(self.post({**gone, "token": name})[0], 400)
        self.assertEqual(sum(name.endswith(".json") for name in self.files()), 2)

    def test_what_is_not_of_the_kit_is_refused(self):
        self.start()
        good = file_of(1)
        other_pair = [{**good["trials"][0], "left": ["a", "x"]}, *good["trials"][1:]]
        for body, status in (
                (b"", 400), (b"{", 400), (b"\xff", 400), (b"[" * 100_000, 400), (b"[]", 400), (b"1", 400),
                ({**good, "format": "other"}, 400), ({**good, "version": 2}, 400),
                ({**good, "kit_hash": "other"}, 403), ({**good, "token": "../../x"}, 400),
                ({**good, "token": None}, 400), ({**good, "judge": ""}, 400), ({**good, "trials": []}, 400),
                ({**good, "trials": good["trials"][:2]}, 400), ({**good, "trials": [good["trials"][0]] * 3}, 400),
                ({**good, "trials": other_pair}, 400), ({**good, "trials": [1, 2, 3]}, 400),
                ({**good, "trials": [{**trial, "vote": 4} for trial in good["trials"]]}, 400),
                (json.dumps({**good, "comment": 1}).replace('"comment": 1', '"comment": NaN').encode(), 400),
                ({**good, "comment": "x" * 2_000_000}, 413)):
            with self.subTest(body=str(body)[:80]):
                try:
                    answer = self.post(body)
                except (BrokenPipeError, ConnectionResetError):
                    answer = (413, {"error": "it does not read what is too large"})
                self.assertEqual(answer[0], status)
                self.assertIn("error", answer[1])
        self.assertEqual(self.post(b"", "GET")[0], 405)
        self.assertEqual(self.post(b"", "OPTIONS")[0], 200)
        self.assertEqual(self.files(), {})
        self.assertEqual(self.post(good)[0], 200)

    def test_consent_is_needed_where_the_kit_asks_for_it(self):
        (self.work / "kit.json").write_text(json.dumps({**KIT, "study": {"consent": {"en": "Yes?"}}}))
        self.start()
        for consent in None, True, "yes":
            self.assertEqual(self.post(file_of(1, consent=consent))[0], 400)
        self.assertEqual(self.files(), {})
        self.assertEqual(self.post(file_of(1, consent={"language": "en"}))[0], 200)

    def test_no_address_is_written_down(self):
        process = subprocess.Popen([sys.executable, RECEIVER, "--kit", self.work / "kit.json", "--out", self.out, "--port", "0"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8")
        self.process = process
        self.host, self.port = "127.0.0.1", int(re.search(r":([0-9]+)/ ", process.stdout.readline())[1])
        self.assertEqual(self.post(file_of(1))[0], 200)
        process.kill()
        with process.stderr as said:
            words = said.read()
        self.assertIn("POST / HTTP/1.1", words)
        self.assertNotIn("127.0.0.1", words)

    def test_rates_are_bounded(self):
        self.start("--per-minute", "3")
        answers = [self.post(file_of(number))[0] for number in range(5)]
        self.assertEqual(answers, [200, 200, 200, 429, 429])
        self.stop()
        self.start("--per-minute-of-all", "2")
        answers = [self.post(file_of(number))[0] for number in range(4)]
        self.assertEqual(answers, [200, 200, 429, 429])

    def test_slow_senders_are_cut_off(self):
        self.start("--seconds", "1")
        with socket.create_connection((self.host, self.port), timeout=60) as slow:
            slow.sendall(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n")
            try:
                for _ in range(600):  # far longer than any one wait for a byte
                    slow.sendall(b"x")
                    time.sleep(0.05)
                self.fail("it was read for half a minute")
            except OSError:
                pass
        self.assertEqual(self.files(), {})
        self.assertEqual(self.post(file_of(1))[0], 200)


if __name__ == "__main__":
    unittest.main(verbosity=2)
