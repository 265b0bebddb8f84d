"""A headless Chromium, driven by its own protocol over a websocket (tornado): open a page, ask it, press keys."""

import asyncio
import json
import shutil
import subprocess
import time
import urllib.request

CHROMIUM = next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)
PATIENCE = 60.0
"""[s] that anything may take on a busy machine."""


class Browser:
    """A context: one page. folder: for the profile."""

    def __init__(self, folder, width=1100, height=1400):
        self.process = subprocess.Popen(
            [CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0",
             "--remote-allow-origins=*", f"--window-size={width},{height}", f"--user-data-dir={folder}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.folder, self.number = folder, 0
        self.loop = asyncio.new_event_loop()

    def __enter__(self):
        port = self.wait(lambda: (self.folder / "DevToolsActivePort").read_text().splitlines()[0])
        pages = self.wait(lambda: json.load(urllib.request.urlopen(f"http://127.0.0.1:{port}/json")))
        address = next(p["webSocketDebuggerUrl"] for p in pages if p["type"] == "page")
        self.socket = self.loop.run_until_complete(self._connect(address))
        return self

    def __exit__(self, *_):
        self.socket.close()
        self.loop.close()
        self.process.terminate()
        self.process.wait()

    @staticmethod
    async def _connect(address):
        from tornado.websocket import websocket_connect

        return await websocket_connect(address)

    def call(self, method, **params):
        """The result of a call of the protocol."""
        self.number += 1

        async def ask():
            await self.socket.write_message(
                json.dumps({"id": self.number, "method": method, "params": params})
            )
            while True:
                reported = json.loads(await self.socket.read_message())
                if reported.get("id") == self.number:
                    return reported

        return self.loop.run_until_complete(asyncio.wait_for(ask(), PATIENCE))["result"]

    def open(self, address):
        self.call("Page.navigate", url=address)

    def value(self, script):
        """What an expression of the page is."""
        return self.call("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def key(self, key):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, text=key if kind == "keyDown" else "")

    def until(self, script):
        """Wait until an expression is true; its value."""
        return self.wait(lambda: self.value(script) or None)

    @staticmethod
    def wait(ask):
        """What ask() returns as soon as it does and is not None."""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                found = ask()
                if found is not None:
                    return found
            except (OSError, IndexError):
                pass
            if time.monotonic() > end:
                raise TimeoutError("the browser has not come to it")
            time.sleep(0.1)

    def picture(self, path):
        """A screenshot."""
        import base64

        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))
