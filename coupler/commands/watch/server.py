"""The server of the page: on the loopback address alone, with a secret in the address, nothing from outside.

    GET  /SECRET/            the page               GET  /SECRET/picture/N   newest picture of run N
    GET  /SECRET/events      Server-Sent Events     POST /SECRET/stop/N      asks run N to stop

Whoever knows the address may look and stop; other users of the machine do not know it. A page of another site cannot
ask either: it does not know the secret, and the Host of a request must be this server's own (DNS rebinding).
"""

from __future__ import annotations

import contextlib
import json
import secrets
import threading
import time as clock
from hmac import compare_digest
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from coupler.commands.watch.pictures import Pictures
from coupler.commands.watch.state import Watched, runs_in
from coupler.run.stop import FILE_NAME as STOP

ADDRESS = "127.0.0.1"
EVERY = 1.0
"""[s] between two looks at the runs."""
LOOK = 5.0
"""[s] between two searches for new runs."""
PAGE = Path(__file__).parent / "page.html"
POLICY = (
    "default-src 'self'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src 'self' data:; "
    "frame-ancestors 'none'"
)


class Site:
    """The watched runs, and the state that was last sent to the page.

    A run keeps the number that it got when it was first seen, by which the page asks for its picture and its stop: the
    order of the runs changes, by the last change of each, while somebody reads the question whether to stop one."""

    def __init__(self, places: list[Path], pictures: Pictures | None = None):
        self.places, self.pictures = places, pictures
        self.secret = secrets.token_urlsafe(16)
        self._seen: list[Watched] = []
        self._number: dict[Path, int] = {}
        self._order: list[int] = []
        self._searched = -LOOK
        self._lock = threading.Lock()
        self._message = "[]"
        self._read = -EVERY

    def message(self) -> str:
        """The state of all runs as JSON, not older than EVERY."""
        with self._lock:
            now = clock.monotonic()
            if now - self._searched >= LOOK:
                self._searched = now
                self._order = [self._number_of(path) for path in runs_in(self.places)]
            if now - self._read >= EVERY:
                self._read = now
                runs = [self._seen[number] for number in self._order]
                states = [{"number": number} | run.state() for number, run in zip(self._order, runs)]
                self._message = json.dumps(states, ensure_ascii=False)
                if self.pictures is not None:
                    self.pictures.consider(runs, states)
            return self._message

    def _number_of(self, path: Path) -> int:
        if path not in self._number:
            self._number[path] = len(self._seen)
            self._seen.append(Watched(path))
        return self._number[path]

    def run(self, number: str) -> Watched | None:
        """The run of a number in an address."""
        return self._seen[int(number)] if number.isdecimal() and int(number) < len(self._seen) else None


def server_of(site: Site, port: int = 0) -> ThreadingHTTPServer:
    """A server for a site, not yet serving; port 0: any that is free."""

    class Handler(_Handler):
        pass

    Handler.site = site
    made = ThreadingHTTPServer((ADDRESS, port), Handler)
    made.daemon_threads = True
    return made


def address_of(server: ThreadingHTTPServer, site: Site) -> str:
    """What to open in a browser."""
    return f"http://{ADDRESS}:{server.server_port}/{site.secret}/"


class _Handler(BaseHTTPRequestHandler):
    site: Site
    server_version, sys_version = "surgebreak", ""
    protocol_version = "HTTP/1.1"

    def do_GET(self) -> None:
        words = self._words()
        if words == [""]:
            self._send(PAGE.read_bytes(), "text/html; charset=utf-8")
        elif words == ["events"]:
            self._events()
        elif words and words[0] == "picture" and len(words) == 2:
            self._picture(self.site.run(words[1]))
        elif words is not None:
            self.send_error(404)

    def do_POST(self) -> None:
        words = self._words()
        if words is None:
            return
        run = self.site.run(words[1]) if len(words) == 2 and words[0] == "stop" else None
        if run is None or self.headers.get("X-Confirmed") != "yes":
            self.send_error(
                404 if run is None else 400, None if run is None else "stopping wants to be confirmed"
            )
            return
        (run.path / STOP).touch()
        self._send(b"{}", "application/json")

    def _words(self) -> list[str] | None:
        """The parts of the address after the secret. None if the request is refused; the refusal has then been sent."""
        own = {f"{name}:{self.server.server_port}" for name in (ADDRESS, "localhost")}
        _, _, rest = self.path.partition("?")[0].partition("/")
        secret, slash, behind = rest.partition("/")
        if self.headers.get("Host") not in own or not compare_digest(
            secret.encode(), self.site.secret.encode()
        ):
            self.send_error(403, "open the address that `surgebreak watch` printed")
            return None
        return behind.split("/") if slash else [None]

    def _send(self, body: bytes, kind: str) -> None:
        self.send_response(200)
        for name, value in (
            ("Content-Type", kind), ("Content-Length", str(len(body))), ("Cache-Control", "no-store"),
            ("Content-Security-Policy", POLICY), ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
        ):  # fmt: skip
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def _picture(self, run: Watched | None) -> None:
        path = run.newest_picture() if run else None
        if path is None:
            self.send_error(404)
        else:
            self._send(path.read_bytes(), "image/png")

    def _events(self) -> None:
        """Send the state whenever it changes, and comments in between, which fail when the browser has gone."""
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Cache-Control", "no-store")
        self.send_header("Connection", "close")
        self.end_headers()
        before = None
        with contextlib.suppress(OSError):
            while True:
                message = self.site.message()
                self.wfile.write(b": here\n\n" if message == before else f"data: {message}\n\n".encode())
                self.wfile.flush()
                before = message
                clock.sleep(EVERY)

    def log_message(self, *_) -> None:
        """Print nothing, because the terminal belongs to the run."""
