"""Chromium without a window, driven through its DevTools protocol over a pipe: what a user sees of a
page, without anything but the standard library."""

import base64
import collections
import json
import os
import pathlib
import select
import shutil
import signal
import subprocess
import tempfile
import time

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")

# Bits of Input.dispatchKeyEvent.
ALT, CONTROL, META, SHIFT = 1, 2, 4, 8

# The clock of the frames of a page runs `speed` times as fast as it should, or stands still at 0.
CLOCK = """
(() => {
  const real = requestAnimationFrame.bind(window);
  let last = null;
  let now = 0;
  window.speed = %s;
  window.requestAnimationFrame = step => real(time => {
    now += (last === null ? 0 : time - last) * window.speed;
    last = time;
    step(now);
  });
})();
"""


class Window:
    """What is asked of a page in any browser, by its run()."""

    def draw(self):
        """Waits until what is due is drawn."""
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def text(self, selector):
        return self.run(f"document.querySelector({json.dumps(selector)}).textContent")

    def place_of(self, selector):
        """The middle of an element, which must be in the window."""
        x, y, inside = self.run(
            f"(() => {{ const b = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
            "const x = b.x + b.width / 2, y = b.y + b.height / 2;"
            "return [x, y, x >= 0 && y >= 0 && x < innerWidth && y < innerHeight]; })()")
        assert inside, selector
        return {"x": x, "y": y}


class Browser(Window):
    """One browser, with one page to begin with. Use it in a with statement. A profile that is given
    stays; `preferences` are the user's settings, as Chromium keeps them, `flags` more options of it."""

    def __init__(self, seconds=60, profile=None, preferences=None, flags=()):
        self.seconds = seconds
        self.number = 0
        self.session = None
        self.buffer = b""
        self.events = collections.deque()
        self.profile = profile
        self.preferences = preferences
        self.flags = flags

    def __enter__(self):
        self.scratch = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        profile = pathlib.Path(self.profile or self.scratch.name)
        if self.preferences:
            (profile / "Default").mkdir()
            (profile / "Default" / "Preferences").write_text(json.dumps(self.preferences))
        for_browser, self.to_browser = os.pipe()
        self.from_browser, of_browser = os.pipe()
        # The browser reads commands from descriptor 3 and writes to descriptor 4.
        self.process = subprocess.Popen(
            ["/bin/sh", "-c", 'exec "$0" "$@" 3<&0 4>&1 </dev/null >/dev/null', CHROMIUM,
             "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
             "--remote-debugging-pipe", "--no-first-run", "--disable-background-networking",
             "--disable-component-update", "--disable-sync", f"--user-data-dir={profile}", *self.flags],
            stdin=for_browser, stdout=of_browser, stderr=subprocess.DEVNULL, start_new_session=True,
        )
        os.close(for_browser)
        os.close(of_browser)
        self.new_page()
        return self

    def __exit__(self, *_):
        self.kill()
        os.close(self.to_browser)
        os.close(self.from_browser)
        self.scratch.cleanup()

    def kill(self):
        """Ends all of its processes at once, in the middle of whatever they do."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def new_page(self, **options):
        """Opens a tab, from now on the one that is meant; returns what use() takes."""
        self.session = None
        target = self.call("Target.createTarget", url="about:blank", **options)["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in "Page", "Runtime", "Log", "Network":
            self.call(f"{domain}.enable")
        return self.session

    def use(self, session):
        """Brings a tab to the front."""
        self.session = session
        self.call("Page.bringToFront")

    def message(self, end):
        """The next message of the browser."""
        while b"\0" not in self.buffer:
            if not select.select([self.from_browser], [], [], max(0, end - time.monotonic()))[0]:
                raise TimeoutError("the browser does not answer")
            data = os.read(self.from_browser, 1 << 16)
            if not data:
                raise EOFError("the browser has ended")
            self.buffer += data
        text, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(text)

    def send(self, method, **parameters):
        """Calls a method of the protocol without waiting for it; returns its number."""
        self.number += 1
        command = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            command["sessionId"] = self.session
        text = json.dumps(command).encode() + b"\0"
        while text:
            text = text[os.write(self.to_browser, text):]
        return self.number

    def call(self, method, **parameters):
        """Calls a method of the protocol; events that come meanwhile are kept."""
        number = self.send(method, **parameters)
        end = time.monotonic() + self.seconds
        while True:
            message = self.message(end)
            if message.get("id") == number:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]
            if "method" in message:
                self.events.append(message)

    def event(self, method):
        """The first event of this kind that this tab has had since its page was opened, or has."""
        end = time.monotonic() + self.seconds
        while True:
            for event in self.events:
                if event["method"] == method and event.get("sessionId") == self.session:
                    return event["params"]
            message = self.message(end)
            if "method" in message:
                self.events.append(message)

    def open(self, path, width=1200, height=900):
        """Shows a file in a window of this size, and waits until it is drawn."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=False)
        self.events.clear()
        self.call("Page.navigate", url=path.resolve().as_uri())
        self.event("Page.loadEventFired")
        self.draw()

    def reload(self):
        self.events.clear()
        self.call("Page.reload")
        self.event("Page.loadEventFired")
        self.draw()

    def close_page(self):
        """Closes the tab; another one has to be used then."""
        self.call("Page.close")

    def set_clock(self, speed):
        """For pages that are opened after this: how fast their frames say that time goes."""
        self.call("Page.addScriptToEvaluateOnNewDocument", source=CLOCK % speed)

    def run(self, script):
        """The value of a JavaScript expression, awaited."""
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True,
                           returnByValue=True)
        if "exceptionDetails" in result:
            raise RuntimeError(json.dumps(result["exceptionDetails"]))
        return result["result"].get("value")

    def press(self, key, code=None, **details):
        """Presses and releases a key: what it types, and what the place on the keyboard is called."""
        self.hold(key, code, **details)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, code=key if code is None else code)

    def hold(self, key, code=None, **details):
        """Presses a key."""
        text = {"Enter": "\r"}.get(key, key if len(key) == 1 else "")
        self.call("Input.dispatchKeyEvent", type="keyDown" if text else "rawKeyDown", key=key,
                  code=key if code is None else code,
                  windowsVirtualKeyCode={"Enter": 13, "Tab": 9}.get(key, 0),
                  **({"text": text} if text else {}), **details)

    def click(self, selector, times=1):
        """Clicks with the mouse, or double-clicks with `times` 2, on the place of an element."""
        place = self.place_of(selector)
        for count in range(times):
            for kind in "mousePressed", "mouseReleased":
                self.call("Input.dispatchMouseEvent", type=kind, button="left",
                          clickCount=count + 1, **place)

    def tap(self, selector):
        for kind, points in (("touchStart", [self.place_of(selector)]), ("touchEnd", [])):
            self.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def point_at(self, x, y):
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def complaints(self):
        """Exceptions, and whatever was written to the console."""
        self.run("0")
        return [e for e in self.events if e["method"] in
                ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded")]

    def requests(self):
        """The addresses of everything that was asked for."""
        self.run("0")
        return [e["params"]["request"]["url"] for e in self.events
                if e["method"] == "Network.requestWillBeSent"]

    def screenshot(self, path, **clip):
        """The window, or the part of it that is in `clip`, as PNG."""
        if clip:
            clip = {"clip": {**clip, "scale": 1}}
        image = base64.b64decode(self.call("Page.captureScreenshot", **clip)["data"])
        path.write_bytes(image)
        return image
