"""A headless Chromium that tests look through: pages at any width and colour, keys, what is logged and asked for."""

import contextlib
import itertools
import json
import os
import signal
import subprocess
import tempfile
import time

from browsing import BROWSER

QUIET = ("--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-quic")


class Chromium:
    """The browser, spoken to through a pipe in its DevTools protocol."""

    def __init__(self):
        self._folder = tempfile.TemporaryDirectory()
        theirs_in, self._out = os.pipe()
        self._in, theirs_out = os.pipe()
        words = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", *QUIET]
        words += ["--remote-debugging-pipe", f"--user-data-dir={self._folder.name}", "about:blank"]
        moved = f"exec {' '.join(words)} 3<&{theirs_in} 4>&{theirs_out}"  # it reads from 3 and writes to 4
        self._process = subprocess.Popen(
            ["/bin/bash", "-c", moved], pass_fds=(theirs_in, theirs_out), stderr=subprocess.DEVNULL, process_group=0
        )
        for end in (theirs_in, theirs_out):
            os.close(end)
        self._numbers, self._rest, self.heard = itertools.count(1), b"", []
        page = next(each for each in self.ask("Target.getTargets")["targetInfos"] if each["type"] == "page")
        self._session = None
        self._session = self.ask("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")
        forget = "try { localStorage.clear(); } catch {}"  # what a page kept is not there the next time
        self.ask("Page.addScriptToEvaluateOnNewDocument", source=forget)

    _session = None

    def _next(self):
        while b"\0" not in self._rest:
            read = os.read(self._in, 1 << 20)
            assert read, "the browser is gone"
            self._rest += read
        message, _, self._rest = self._rest.partition(b"\0")
        return json.loads(message)

    def ask(self, method, **given):
        """The result of a method of the protocol; what is heard meanwhile is kept."""
        number = next(self._numbers)
        session = {"sessionId": self._session} if self._session else {}
        os.write(self._out, json.dumps({"id": number, "method": method, "params": given, **session}).encode() + b"\0")
        while (message := self._next()).get("id") != number:
            self.heard.append(message)
        assert "error" not in message, (method, message["error"])
        return message["result"]

    def value(self, expression):
        """The value of an expression of JavaScript in the page, a promise's when it is kept."""
        found = self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def open(self, address, width=1400, height=900, dark=False, ready="true"):
        """Show a page, and wait until an expression is true of it."""
        self.heard.clear()
        phone = {"deviceScaleFactor": 1, "mobile": width < 600}
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=height, **phone)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.ask("Emulation.setEmulatedMedia", features=[scheme])
        self.ask("Page.navigate", url="about:blank")
        self.heard.clear()
        self.ask("Page.navigate", url=str(address))
        end = time.monotonic() + 30
        there = "location.href !== 'about:blank' && document.readyState === 'complete'"
        while not self.value(f"{there} && Boolean({ready})"):
            assert time.monotonic() < end, f"{address} is not ready: {self.complaints()}"
            time.sleep(0.02)
        self.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def complaints(self):
        """What the page said on its console, and the errors in it."""
        kinds = ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded")
        return [each["params"] for each in self.heard if each.get("method") in kinds]

    def asked_for(self):
        """Addresses that were asked for, but files, and what stands in the page itself."""
        sent = [each["params"]["request"]["url"] for each in self.heard if each.get("method") == NETWORK]
        return [url for url in sent if not url.startswith(("file:", "data:", "blob:", "about:"))]

    def first_paint(self, tries=5):
        """Seconds from asking for the page to its first paint: the least of some tries, where others compute, too."""
        paint = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? 1e5"
        found = []
        while not found or (found[-1] >= 1.0 and len(found) < tries):
            if found:
                self.ask("Page.reload")
                time.sleep(1.0)
            found.append(self.value(paint) / 1000)
        return min(found)

    def wider_than_its_screen(self):
        return self.value("document.documentElement.scrollWidth > document.documentElement.clientWidth")

    def press(self, *keys):
        """Press keys, by their names in JavaScript."""
        for key in keys:
            text = {"text": key} if len(key) == 1 else {"text": "\r"} if key == "Enter" else {}
            code = {"Tab": 9, "Enter": 13, "Escape": 27, "ArrowLeft": 37, "ArrowRight": 39}.get(key, 0)
            self.ask("Input.dispatchKeyEvent", type="keyDown", key=key, windowsVirtualKeyCode=code, **text)
            self.ask("Input.dispatchKeyEvent", type="keyUp", key=key, windowsVirtualKeyCode=code)

    def drag(self, *points):
        """Press the mouse at the first of some points (x, y) of the window, and let go at the last."""
        for kind, (x, y) in zip(
            ("mousePressed", *("mouseMoved" for _ in points[1:]), "mouseReleased"), (*points, points[-1]), strict=True
        ):
            button = {"button": "left", "clickCount": 1} if kind != "mouseMoved" else {"button": "left", "buttons": 1}
            self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, **button)

    def picture(self, path, whole=True):
        """A picture of the page, for a person to look at."""
        import base64

        shot = self.ask("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(shot["data"]))

    def close(self):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        os.close(self._in)
        os.close(self._out)
        self._folder.cleanup()


NETWORK = "Network.requestWillBeSent"
