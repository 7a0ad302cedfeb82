#!/usr/bin/env python3
"""Receives what the page of a kit sends: the files of judges, and their withdrawals.

    python3 examples/receiver.py --kit kit/kit.json --out received
    merl-scan judge ... --post http://127.0.0.1:8765/

docs/experiment.md says what is sent and what has to be answered. A file is answered for when it is
whole on the disk, under its own name; whatever ends this program leaves no half of one. It listens on
this machine alone unless --host says otherwise, and speaks plain HTTP: put it behind a server that
speaks HTTPS where judges are elsewhere. Needs nothing but Python's standard library.
"""

import argparse
import collections
import hashlib
import http.server
import json
import os
import pathlib
import re
import socket
import sys
import tempfile
import threading
import time

TOKEN = re.compile(r"[0-9a-f]{32}")


class Refused(Exception):
    """What is sent is not taken; the first argument is the status, the second says why."""


def no_number(name):
    """NaN and Infinity, which Python reads and JSON has not."""
    raise ValueError(name)


class Store:
    """The directory of received files: one for each judge, whom the token in it tells apart."""

    def __init__(self, kit, directory):
        self.kit_hash = kit["kit_hash"]
        self.asks_consent = kit.get("study", {}).get("consent") is not None
        self.trials = {(t["configuration"], t["kind"]): sorted([*t["left"], *t["right"]]) for t in kit["trials"]}
        # A trial with a thousand changed answers, and texts of ten thousand characters.
        self.most_bytes = (1 << 20) + 4096 * len(self.trials)
        self.most_files = 10_000
        self.directory = directory
        self.lock = threading.Lock()
        directory.mkdir(parents=True, exist_ok=True)
        for left in directory.glob(".receiving-*"):
            left.unlink()  # of a receiver that was stopped; nobody was told that it had arrived

    def path(self, token):
        # The token erases, so that it is in no name.
        return self.directory / f"judge-{hashlib.sha256(token.encode()).hexdigest()[:32]}.json"

    def take(self, body):
        """Does what a body asks for; returns what the sender is told."""
        try:
            message = json.loads(body.decode("utf-8"), parse_constant=no_number)
        except (ValueError, RecursionError):
            raise Refused(400, "no JSON in UTF-8") from None
        if not isinstance(message, dict) or message.get("version") != 1:
            raise Refused(400, "not of a kit's page")
        if message.get("kit_hash") != self.kit_hash:
            raise Refused(403, "of another kit")
        token = message.get("token")
        if not isinstance(token, str) or not TOKEN.fullmatch(token):
            raise Refused(400, "without a token")
        if message.get("format") == "merl-scan withdrawal":
            with self.lock:
                self.withdraw(token)
        elif message.get("format") == "merl-scan judge":
            self.check(message)
            with self.lock:
                self.keep(token, body)
        else:
            raise Refused(400, "not of a kit's page")
        return {"stored": len(body)}

    def check(self, message):
        """Only trials of the kit, each once, of somebody who has agreed where that is asked for."""
        if not isinstance(message.get("judge"), str) or not 1 <= len(message["judge"]) <= 200:
            raise Refused(400, "without a judge")
        if self.asks_consent and not isinstance(message.get("consent"), dict):
            raise Refused(400, "without consent")
        trials = message.get("trials")
        if not isinstance(trials, list) or len(trials) != len(self.trials):
            raise Refused(400, "not the trials of the kit")
        left = dict(self.trials)
        for trial in trials:
            try:
                shown = left.pop((trial["configuration"], trial["kind"]))
                same = sorted([*trial["left"], *trial["right"]]) == shown
            except (KeyError, TypeError):
                same = False
            if not same or trial.get("vote") not in (None, 1, 2, 3):
                raise Refused(400, "not the trials of the kit")

    def keep(self, token, body):
        gone = self.path(token).with_suffix(".withdrawn")
        if gone.exists():
            raise Refused(410, "withdrawn")
        if not self.path(token).exists():
            self.expect_room(".json")
        self.write(self.path(token), body)

    def expect_room(self, kind):
        # Each by itself: made-up withdrawals keep no judge out.
        if sum(path.suffix == kind for path in self.directory.iterdir()) >= self.most_files:
            raise Refused(507, "there are too many files")

    def withdraw(self, token):
        if not self.path(token).exists():
            self.expect_room(".withdrawn")
        # What is still under way is not to come back.
        self.write(self.path(token).with_suffix(".withdrawn"), b"")
        self.path(token).unlink(missing_ok=True)
        self.sync()

    def write(self, path, body):
        """Puts a file there whole, on the disk."""
        file, name = tempfile.mkstemp(prefix=".receiving-", dir=self.directory)
        try:
            with open(file, "wb") as stream:
                stream.write(body)
                stream.flush()
                os.fsync(stream.fileno())
            os.replace(name, path)
        except BaseException:
            pathlib.Path(name).unlink(missing_ok=True)
            raise
        self.sync()

    def sync(self):
        directory = os.open(self.directory, os.O_RDONLY)
        try:
            os.fsync(directory)
        finally:
            os.close(directory)


class Rate:
    """So many requests a minute, of an address and of all."""

    def __init__(self, of_one, of_all):
        self.most = {"one": of_one, "all": of_all}
        self.times = collections.defaultdict(collections.deque)
        self.lock = threading.Lock()

    def allows(self, address):
        now = time.monotonic()
        with self.lock:
            for key in [key for key, times in self.times.items() if not times or now - times[-1] > 60]:
                del self.times[key]
            for key, most in ((address, self.most["one"]), ("", self.most["all"])):
                times = self.times[key]
                while times and now - times[0] > 60:
                    times.popleft()
                if len(times) >= most:
                    return False
            self.times[address].append(now)
            self.times[""].append(now)
            return True


class Handler(http.server.BaseHTTPRequestHandler):
    timeout = 30  # seconds, of one that says nothing
    protocol_version = "HTTP/1.1"

    def answer(self, status, content):
        body = json.dumps(content).encode()
        self.send_response(status)
        # A page that was opened as a file has the origin `null`: anybody may send, and learns nothing.
        self.send_header("Access-Control-Allow-Origin", "*")
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Connection", "close")
        self.close_connection = True
        if status == 429:
            self.send_header("Retry-After", "60")
        self.end_headers()
        self.wfile.write(body)

    def do_OPTIONS(self):
        self.answer(200, {})

    def do_GET(self):
        self.answer(405, {"error": "answers are sent here with POST"})

    def do_POST(self):
        self.answer(*self.outcome())

    def outcome(self):
        """The status and the content of the answer to what is sent."""
        try:
            if not self.server.rate.allows(self.client_address[0]):
                raise Refused(429, "too many requests")
            length = self.headers.get("Content-Length", "")
            if not re.fullmatch("[0-9]{1,12}", length):
                raise Refused(411, "without a length")
            if int(length) > self.server.store.most_bytes:
                raise Refused(413, "too large")
            body = self.rfile.read(int(length))
            if len(body) != int(length):
                raise Refused(400, "cut off")
            return 200, self.server.store.take(body)
        except Refused as refused:
            status, why = refused.args
            return status, {"error": why}
        except OSError as error:
            # It may be better in a minute: the page tries again.
            self.log_error("%s", error)
            return 503, {"error": "cannot be stored"}

    def address_string(self):
        return "-"  # a judge's is personal data, and in no consent

    def log_message(self, form, *values):
        if not self.server.quiet:
            super().log_message(form, *values)


class Receiver(http.server.ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 256
    most_open = 500

    def __init__(self, address, store, rate, quiet, seconds):
        super().__init__(address, Handler)
        self.store, self.rate, self.quiet, self.seconds = store, rate, quiet, seconds
        self.open = {}  # connections, and when they began

    def verify_request(self, request, client_address):
        if len(self.open) >= self.most_open:
            return False
        self.open[request] = time.monotonic()
        return True

    def close_request(self, request):
        self.open.pop(request, None)
        super().close_request(request)

    def service_actions(self):
        """Ends what takes too long, however often it sends a byte."""
        for request, begun in self.open.copy().items():
            if time.monotonic() - begun > self.seconds:
                try:
                    request.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass  # it has ended itself

    def handle_error(self, request, client_address):
        if not self.quiet:
            print(f"ended with {sys.exc_info()[1]!r}", file=sys.stderr)


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    options.add_argument("--kit", type=pathlib.Path, required=True, help="kit.json of the kit")
    options.add_argument("--out", type=pathlib.Path, required=True, help="the directory to put files into")
    options.add_argument("--host", default="127.0.0.1", help="the address to listen on (default: this machine alone)")
    options.add_argument("--port", type=int, default=8765, help="0: any that is free")
    options.add_argument("--per-minute", type=int, default=30, help="most requests of one address in a minute")
    options.add_argument("--per-minute-of-all", type=int, default=600, help="most requests in a minute")
    options.add_argument("--seconds", type=float, default=60, help="how long a request may take")
    options.add_argument("--quiet", action="store_true")
    given = options.parse_args()
    store = Store(json.loads(given.kit.read_text(encoding="utf-8")), given.out)
    rate = Rate(given.per_minute, given.per_minute_of_all)
    server = Receiver((given.host, given.port), store, rate, given.quiet, given.seconds)
    print(f"receiving at http://{given.host}:{server.server_address[1]}/ into {given.out}", flush=True)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
