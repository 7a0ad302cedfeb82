"""Firefox without a window, driven through WebDriver BiDi over a web socket: what a user sees of a
page, with real keys, mouse and fingers, and without anything but the standard library."""

import base64
import collections
import json
import os
import pathlib
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import time

from browser import CLOCK, Window

FIREFOX = os.environ.get("FIREFOX") or shutil.which("firefox-esr") or shutil.which("firefox")

# What keys without a character of their own are called (WebDriver, "keyboard actions").
KEYS = {"Backspace": "\ue003", "Enter": "\ue006", "ArrowLeft": "\ue012",
        "ArrowUp": "\ue013", "ArrowRight": "\ue014", "ArrowDown": "\ue015"}

# The user's settings: files are saved without a question, and nothing is asked of the network.
SETTINGS = """
user_pref("browser.download.folderList", 2);
user_pref("browser.download.dir", %s);
user_pref("browser.download.always_ask_before_handling_new_types", false);
user_pref("datareporting.policy.dataSubmissionEnabled", false);
user_pref("network.captive-portal-service.enabled", false);
user_pref("network.connectivity-service.enabled", false);
user_pref("dom.w3c_touch_events.enabled", 1);
"""


class WebSocket:
    """The client's side of RFC 6455, for texts."""

    def __init__(self, host, port, path, seconds):
        self.seconds = seconds
        self.buffer = b""
        self.socket = socket.create_connection((host, port), timeout=seconds)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        answer = b""
        while not answer.endswith(b"\r\n\r\n"):
            answer += self.take(1)
        if b" 101 " not in answer.split(b"\r\n", 1)[0]:
            raise ConnectionError(answer.decode())

    def close(self):
        self.socket.close()

    def take(self, count):
        while len(self.buffer) < count:
            data = self.socket.recv(1 << 16)
            if not data:
                raise EOFError("the browser has ended")
            self.buffer += data
        taken, self.buffer = self.buffer[:count], self.buffer[count:]
        return taken

    def send(self, content, kind=1):
        mask = os.urandom(4)
        size = len(content)
        length = bytes([128 | size]) if size < 126 else struct.pack(">BH", 254, size) if size < 1 << 16 else struct.pack(">BQ", 255, size)
        self.socket.sendall(bytes([128 | kind]) + length + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(content)))

    def receive(self, end):
        """The next text, whose frames may be several."""
        text = b""
        while True:
            self.socket.settimeout(max(0.001, end - time.monotonic()))
            first, size = self.take(2)
            self.socket.settimeout(self.seconds)
            if size >= 126:
                size = int.from_bytes(self.take(2 if size == 126 else 8), "big")
            content = self.take(size)
            kind = first & 15
            if kind == 8:
                raise EOFError("the browser has ended")
            if kind == 9:
                self.send(content, 10)
            elif kind < 3:
                text += content
                if first & 128:
                    return text


def value_of(remote):
    """What a value of the page is in Python."""
    kind, value = remote["type"], remote.get("value")
    if kind == "array":
        return [value_of(each) for each in value]
    if kind == "object":
        return {key: value_of(each) for key, each in value}
    return value if kind in ("string", "number", "boolean") else None


class Firefox(Window):
    """One browser with one page. Use it in a with statement. Files that pages save go to `downloads`."""

    def __init__(self, downloads, seconds=60):
        self.downloads = downloads
        self.seconds = seconds
        self.number = 0
        self.events = collections.deque()

    def __enter__(self):
        self.scratch = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        home = pathlib.Path(self.scratch.name)
        profile = home / "profile"
        profile.mkdir()
        (profile / "user.js").write_text(SETTINGS % json.dumps(str(self.downloads)))
        self.process = subprocess.Popen(
            [FIREFOX, "--headless", "--no-remote", "--profile", profile, "--remote-debugging-port", "0", "about:blank"],
            env={**os.environ, "HOME": str(home), "XDG_CACHE_HOME": str(home), "TMPDIR": str(home)},
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        try:
            self.connect(profile / "WebDriverBiDiServer.json")
        except BaseException:
            self.kill()
            raise
        return self

    def __exit__(self, *_):
        self.socket.close()
        self.kill()
        self.scratch.cleanup()

    def kill(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def connect(self, file):
        """As soon as the browser has written where it listens."""
        end = time.monotonic() + self.seconds
        while not (text := file.read_text() if file.exists() else "").rstrip().endswith("}"):
            if self.process.poll() is not None or time.monotonic() > end:
                raise TimeoutError("the browser does not start")
            time.sleep(0.02)
        where = json.loads(text)
        self.socket = WebSocket(where["ws_host"], where["ws_port"], "/session", self.seconds)
        self.call("session.new", capabilities={})
        self.call("session.subscribe", events=["log.entryAdded", "network.beforeRequestSent"])
        # A tab of its own: in the one that the browser begins with, keys do not press buttons.
        self.context = self.call("browsingContext.create", type="tab")["context"]

    def call(self, method, **parameters):
        """Calls a method of the protocol; events that come meanwhile are kept."""
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": parameters}).encode())
        end = time.monotonic() + self.seconds
        while True:
            message = json.loads(self.socket.receive(end))
            if message["type"] == "event":
                self.events.append(message)
            elif message["id"] == self.number:
                if message["type"] == "error":
                    raise RuntimeError(f"{method}: {message['error']}: {message['message']}")
                return message["result"]

    def open(self, path, width=1200, height=900):
        """Shows a file in a window of this size, and waits until it is drawn."""
        self.call("browsingContext.setViewport", context=self.context, viewport={"width": width, "height": height})
        self.events.clear()
        self.call("browsingContext.navigate", context=self.context, url=path.resolve().as_uri(), wait="complete")
        self.draw()

    def reload(self):
        self.events.clear()
        self.call("browsingContext.reload", context=self.context, wait="complete")
        self.draw()

    def set_clock(self, speed):
        """For pages that are opened after this: how fast their frames say that time goes."""
        self.call("script.addPreloadScript", functionDeclaration="() => {" + CLOCK % speed + "}")

    def run(self, script):
        """The value of a JavaScript expression, awaited."""
        result = self.call("script.evaluate", expression=script, target={"context": self.context}, awaitPromise=True)
        if result["type"] == "exception":
            raise RuntimeError(json.dumps(result["exceptionDetails"]))
        return value_of(result["result"])

    def act(self, kind, actions, pointer=None):
        """Does something with the keyboard ("key") or with a `pointer`, "mouse" or "touch"."""
        source = {"type": kind, "id": pointer or kind, "actions": actions}
        if pointer:
            source["parameters"] = {"pointerType": pointer}
        self.call("input.performActions", context=self.context, actions=[source])

    def press(self, key, code=None, times=1):
        """Presses and releases a key; what the place on the keyboard is called the browser says itself."""
        value = KEYS.get(key, key)
        self.act("key", [{"type": kind, "value": value} for kind in ("keyDown", "keyUp")] * times)

    def type(self, text):
        self.act("key", [{"type": kind, "value": letter} for letter in text for kind in ("keyDown", "keyUp")])

    def point(self, selector, pointer):
        self.act("pointer", [{"type": "pointerMove", **self.place_of(selector)}, {"type": "pointerDown", "button": 0},
                             {"type": "pointerUp", "button": 0}], pointer)

    def click(self, selector):
        """Clicks with the mouse on the place of an element."""
        self.point(selector, "mouse")

    def tap(self, selector):
        self.point(selector, "touch")

    def complaints(self):
        """Exceptions, and whatever was written to the console."""
        self.run("0")
        return [e["params"] for e in self.events if e["method"] == "log.entryAdded"]

    def requests(self):
        """The addresses of everything that was asked for."""
        self.run("0")
        return [e["params"]["request"]["url"] for e in self.events if e["method"] == "network.beforeRequestSent"]

    def screenshot(self, path):
        image = base64.b64decode(self.call("browsingContext.captureScreenshot", context=self.context)["data"])
        path.write_bytes(image)
        return image
