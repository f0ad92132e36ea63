"""The page of a live walk, on this machine alone.

Who is answered: requests to 127.0.0.1 (the server listens nowhere else) whose address begins with a
secret, whose Host is the address itself (a name that was bound to 127.0.0.1 is refused, "DNS
rebinding"), and that no other site made (Origin, Sec-Fetch-Site). Everyone else gets 403 and no
word more. The page loads nothing from elsewhere, and its policy (Content-Security-Policy) allows
nothing else.

The walk goes to the page as one endless answer of binary messages (`pictures`), and what is done
comes back as one small request each.
"""

import hmac
import json
import secrets
import socket
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from typing import Any, Final

from gaitval.apps.live.doing import doing_of
from gaitval.apps.live.pictures import message_of
from gaitval.apps.live.session import LiveSession
from gaitval.errors import GaitvalError

ADDRESS: Final = "127.0.0.1"
MOST_BYTES: Final = 2_000
"""Of what is done, as JSON."""
MOST_CONNECTIONS: Final = 24
"""At the same time, of those who said the secret and of the others; a browser opens six."""
PATIENCE: Final = 20.0
"""s for which a connection may say nothing."""
GREETING: Final = 2.0
"""s in which the secret must be said: others' connections that are idle, say one letter a second,
or come and go, shall not keep the page out."""
QUIET: Final = 1.0
"""s without anything new after which the page is told that the walk is still there."""
POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS: Final[Mapping[str, str]] = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
FILES: Final[Mapping[str, tuple[str, str, str]]] = {
    "": ("gaitval.apps.live", "live.html", "text/html; charset=utf-8"),
    "live.css": ("gaitval.apps.live", "live.css", "text/css; charset=utf-8"),
    "live.js": ("gaitval.apps.live", "live.js", "text/javascript; charset=utf-8"),
    "body.js": ("gaitval.reporting", "replay_body.js", "text/javascript; charset=utf-8"),
    "three.js": ("gaitval.reporting", "vendor/three.min.js", "text/javascript; charset=utf-8"),
}
"""What is served, by its name behind the secret: package, file and type."""


class LiveServer(ThreadingHTTPServer):
    """Serves one `session`, that is watched and acted on, until it is shut down. `scene` is what
    the page needs to know once, as JSON values; `port` is 0 for one that is free.
    """

    daemon_threads = True
    allow_reuse_address = False
    request_queue_size = 1024
    """Connections that the system keeps until they are taken, so that many at once leave room."""

    def __init__(self, session: LiveSession, scene: Mapping[str, Any], *, port: int = 0) -> None:
        super().__init__((ADDRESS, port), _Handler)
        self.session = session
        self.scene = json.dumps(scene).encode()
        self.secret = secrets.token_urlsafe(32)
        self._free = threading.BoundedSemaphore(2 * MOST_CONNECTIONS)
        self._strangers: dict[Any, None] = {}
        self._taking = threading.Lock()

    @property
    def host(self) -> str:
        """As a request to it names it."""
        return f"{ADDRESS}:{self.server_address[1]}"

    @property
    def address(self) -> str:
        """Of the page, with the secret."""
        return f"http://{self.host}/{self.secret}/"

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread. Who has not said the secret may have to go for the next one: who
        connects again and again only puts out others of that kind.
        """
        if self._has_gone(request):
            self.shutdown_request(request)
            return
        with self._taking:
            if len(self._strangers) >= MOST_CONNECTIONS:
                hang_up(next(iter(self._strangers)))
                self._strangers.pop(next(iter(self._strangers)))
            self._strangers[request] = None
        # Those that were put out end in a moment.
        if not self._free.acquire(timeout=GREETING):
            self.known(request)
            self.shutdown_request(request)
            return
        super().process_request(request, client_address)

    def known(self, request: Any) -> None:
        """Who is at the other end of a connection has said the secret, or has gone."""
        with self._taking:
            self._strangers.pop(request, None)

    def _has_gone(self, request: Any) -> bool:
        """Whether who has connected has left already, without a word."""
        request.setblocking(False)
        try:
            return not request.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            return False
        except OSError:
            return True
        finally:
            request.setblocking(True)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """One connection."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.known(request)
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A page that is closed is no error; nothing is printed of others' requests."""


def hang_up(connection: Any) -> None:
    """End a connection that a thread may wait at."""
    with suppress(OSError):  # it has gone
        connection.shutdown(socket.SHUT_RDWR)


class _Handler(BaseHTTPRequestHandler):
    """One connection of a browser."""

    protocol_version = "HTTP/1.1"
    timeout = PATIENCE
    server_version, sys_version = "gaitval", ""
    server: LiveServer

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: a request's line has the secret in it."""

    def setup(self) -> None:
        """Small messages go at once."""
        self.request.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        super().setup()
        self._stranger = threading.Timer(GREETING, hang_up, (self.connection,))
        self._stranger.daemon = True
        self._stranger.start()

    def finish(self) -> None:
        """Also where the secret was never said."""
        self._stranger.cancel()
        super().finish()

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """What the library refuses is refused as all else: other methods, lines that are none."""
        self._refuse(403)

    def _name(self, *, acts: bool) -> str | None:
        """What is asked for, behind the secret; None if whoever asks may not."""
        server, headers = self.server, self.headers
        given, _, name = self.path.removeprefix("/").partition("/")
        secret = hmac.compare_digest(given.encode(), server.secret.encode())
        here = headers.get_all("Host") == [server.host]
        origins = headers.get_all("Origin") or []
        own = f"http://{server.host}"
        # A page of ours that acts says where it is from, and so does every browser for it.
        from_here = origins == [own] or (not origins and not acts)
        site = headers.get("Sec-Fetch-Site", "same-origin")
        allowed = site == "same-origin" or (site == "none" and not acts)
        if not (secret and here and from_here and allowed):
            return None
        self._stranger.cancel()
        server.known(self.connection)
        return name

    def do_GET(self) -> None:
        """The page, its parts, what it shows, and the walk."""
        name = self._name(acts=False)
        if name is None:
            self._refuse(403)
        elif name in FILES:
            package, file, kind = FILES[name]
            self._send(resources.files(package).joinpath(file).read_bytes(), kind)
        elif name == "scene":
            self._send(self.server.scene, "application/json")
        elif name == "walk":
            self._walk()
        else:
            self._refuse(404)

    def do_POST(self) -> None:
        """Something is done to the walk."""
        name = self._name(acts=True)
        length = self.headers.get("Content-Length", "")
        if name != "do" or self.headers.get("Content-Type") != "application/json":
            self._refuse(403)
        elif not (length.isascii() and length.isdigit()) or int(length) > MOST_BYTES:
            self._refuse(413)
        else:
            try:
                values = json.loads(self.rfile.read(int(length)))
                self.server.session.do(doing_of(values, "the page"))
            except (ValueError, RecursionError, GaitvalError):
                self._refuse(400)
            else:
                self._send(b"", "application/json", code=204)

    def _refuse(self, code: int) -> None:
        # What was sent with it is not read, so the connection cannot go on.
        self.close_connection = True
        self._send(b"", "text/plain", code=code)

    def _send(self, content: bytes, kind: str, *, code: int = 200) -> None:
        self._begin(kind, code, {"Content-Length": str(len(content))})
        self.wfile.write(content)

    def _begin(self, kind: str, code: int, more: Mapping[str, str]) -> None:
        self.send_response(code)
        for key, value in {"Content-Type": kind, **HEADERS, **more}.items():
            self.send_header(key, value)
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()

    def _walk(self) -> None:
        """The walk, picture by picture, until the page is closed or the walk ends."""
        session = self.server.session
        self.close_connection = True
        # What a slow page has not taken is soon old; it is better not sent.
        self.request.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 8192)
        self._begin("application/octet-stream", 200, {})
        shown = None
        session.watch(True)
        try:
            while not session.ended:
                shown = session.next_shown(shown, QUIET)
                self.wfile.write(message_of(shown, session))
        except OSError:
            pass  # the page was closed
        finally:
            session.watch(False)


def serving(server: LiveServer) -> Callable[[], None]:
    """Serve in a thread; gives what ends it."""
    thread = threading.Thread(target=server.serve_forever, name="page", daemon=True)
    thread.start()

    def end() -> None:
        server.shutdown()
        server.server_close()
        with suppress(RuntimeError):
            thread.join(5.0)

    return end
