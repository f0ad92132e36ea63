"""Who is answered, and who is not."""

import http.client
import json
import re
import socket
import struct
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

import pytest

from gaitval.apps.live.log import read_log, walk_again
from gaitval.apps.live.page import served
from gaitval.apps.live.pictures import NUMBERS
from gaitval.apps.live.server import FILES, GREETING, MOST_BYTES, MOST_CONNECTIONS
from gaitval.apps.live.walk import LiveWalk
from gaitval.model.parameters import PARAMETERS

PUSH = json.dumps({"do": "push", "forward": 90.0, "left": 0.0})
READS = ("", "live.js", "scene", "walk")


@pytest.fixture(scope="module")
def server(person):
    with served(person, LiveWalk(person, person.speeds[1])) as found:
        yield found


@contextmanager
def answer(server, name="", *, method="GET", secret=None, body=None, host=None, **headers):
    """Status and response to a request as a browser makes it, but for what is given."""
    connection = http.client.HTTPConnection(*server.server_address[:2], timeout=10)
    path = f"/{server.secret if secret is None else secret}/{name}"
    sent = {"Host": host or server.host, "Sec-Fetch-Site": "same-origin"}
    if method == "POST":
        sent |= {"Origin": f"http://{server.host}", "Content-Type": "application/json"}
        sent["Content-Length"] = str(len(body or ""))
    sent |= {key.replace("_", "-"): value for key, value in headers.items()}
    connection.putrequest(method, path, skip_host=True)
    for key, value in sent.items():
        if value is not None:
            connection.putheader(key, value)
    connection.endheaders(None if body is None else body.encode())
    try:
        yield connection.getresponse()
    finally:
        connection.close()


def status(server, *arguments, **options):
    with answer(server, *arguments, **options) as response:
        return response.status


def test_it_listens_on_this_machine_alone(server):
    assert server.server_address[0] == "127.0.0.1"
    assert server.socket.family == socket.AF_INET


def test_its_own_page_is_answered(server):
    for name in (*FILES, "scene", "walk"):
        assert status(server, name) == 200
    assert status(server, "do", method="POST", body=PUSH) == 204
    assert status(server, Sec_Fetch_Site="none") == 200  # an address that was typed in
    assert status(server, "no-such-file") == 404


@pytest.mark.parametrize("secret", ["", "x", "a" * 43, "..", "%2e%2e"])
def test_a_wrong_secret_is_refused(server, secret):
    for name in READS:
        assert status(server, name, secret=secret) == 403
    assert status(server, "do", method="POST", body=PUSH, secret=secret) == 403


def test_nearly_the_secret_is_refused(server):
    for secret in (server.secret[:-1], server.secret + "A", server.secret.swapcase()):
        assert status(server, secret=secret) == 403


def test_a_secret_that_is_no_ascii_is_refused(server):
    with socket.create_connection(server.server_address[:2]) as connection:
        connection.sendall(f"GET /\xe4/ HTTP/1.1\r\nHost: {server.host}\r\n\r\n".encode("latin-1"))
        assert b" 403 " in connection.recv(100)


@pytest.mark.parametrize("host", ["evil.example", "evil.example:{port}", "localhost:{port}",
                                  "127.0.0.1", "127.0.0.1:1", "[::1]:{port}"])  # fmt: skip
def test_another_host_is_refused(server, host):
    """A name of somebody else's that is bound to 127.0.0.1 (DNS rebinding)."""
    host = host.format(port=server.server_address[1])
    for name in READS:
        assert status(server, name, host=host) == 403
    assert status(server, "do", method="POST", body=PUSH, host=host) == 403


def test_two_hosts_are_refused(server):
    with socket.create_connection(server.server_address[:2]) as connection:
        hosts = f"Host: {server.host}\r\nHost: evil.example\r\n"
        connection.sendall(f"GET /{server.secret}/ HTTP/1.1\r\n{hosts}\r\n".encode())
        assert b" 403 " in connection.recv(100)


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://{host}", "file://"])
def test_another_origin_is_refused(server, origin):
    origin = origin.format(host=server.host)
    for name in READS:
        assert status(server, name, Origin=origin) == 403
    assert status(server, "do", method="POST", body=PUSH, Origin=origin) == 403


def test_who_acts_must_say_where_from(server):
    assert status(server, "do", method="POST", body=PUSH, Origin=None) == 403


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_a_request_that_another_site_made_is_refused(server, site):
    for name in READS:
        assert status(server, name, Sec_Fetch_Site=site) == 403
    assert status(server, "do", method="POST", body=PUSH, Sec_Fetch_Site=site) == 403


def test_a_form_cannot_act(server):
    for kind in ("text/plain", "application/x-www-form-urlencoded"):
        assert status(server, "do", method="POST", body=PUSH, Content_Type=kind) == 403


def test_what_cannot_be_done_is_refused(server):
    for body in ("", "{", "[]", "[" * 1500, '{"do": "push", "forward": NaN, "left": 0}'):
        assert status(server, "do", method="POST", body=body) == 400
    assert status(server, "do", method="POST", body="x" * (MOST_BYTES + 1)) == 413
    for length in ("-1", "", "1e3", "٣"):
        found = None
        try:
            found = status(server, "do", method="POST", Content_Length=length)
        except UnicodeEncodeError:
            continue
        assert found == 413


def test_the_page_may_load_and_send_nothing_elsewhere(server):
    with answer(server) as response:
        headers, page = response.headers, response.read().decode()
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; ")
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Cache-Control"] == "no-store"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Access-Control-Allow-Origin"] is None
    assert not re.search(r"https?:|//|\son\w+=|style=|<script>", page)
    assert "never for verdicts" in page


def test_a_refusal_says_nothing(server):
    with answer(server, secret="x") as response:
        assert response.read() == b""
        assert "gaitval" in response.headers["Server"]
        assert "Python" not in response.headers["Server"]


@pytest.mark.parametrize("method", ["PUT", "OPTIONS", "HEAD", "DELETE", "TRACE", "CONNECT", "X"])
@pytest.mark.parametrize("secret", ["x", None], ids=["a stranger", "the page"])
def test_another_method_is_refused_as_all_else(server, method, secret):
    with answer(server, method=method, secret=secret) as response:
        assert response.status == 403
        assert response.read() == b""


@pytest.mark.parametrize(
    "line",
    [b"GET / HTTP/9.9", b"GET /a b HTTP/1.1", b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 200,
     b"GET /" + b"x" * 70_000 + b" HTTP/1.1"],
)  # fmt: skip
def test_a_request_that_is_none_gets_no_page(server, line):
    with socket.create_connection(server.server_address[:2]) as connection:
        connection.sendall(line + b"\r\n\r\n")
        connection.settimeout(5.0)
        message = b""
        with suppress(ConnectionResetError):
            while part := connection.recv(10_000):
                message += part
    assert b"html" not in message.lower()
    assert not message or b" 403 " in message.partition(b"\r\n")[0]


FLOOD = """
import selectors, socket, sys

def one():
    new = socket.create_connection(("127.0.0.1", int(sys.argv[1])), timeout=5.0)
    ready.register(new, selectors.EVENT_READ)

ready = selectors.DefaultSelector()
for _ in range(30):
    one()
while True:
    for key, _ in ready.select():
        ready.unregister(key.fileobj)
        key.fileobj.close()
        one()
"""


def test_connections_that_come_and_go_do_not_keep_the_page_out(server):
    """Four other processes say nothing, and connect again as soon as they are hung up on."""
    port = str(server.server_address[1])
    others = [subprocess.Popen([sys.executable, "-c", FLOOD, port]) for _ in range(4)]
    try:
        time.sleep(1.5)
        answered = 0
        for _ in range(12):
            with suppress(OSError, http.client.HTTPException):
                answered += status(server) == 200
        assert all(each.poll() is None for each in others)
    finally:
        for each in others:
            each.kill()
            each.wait()
    assert answered == 12


def test_too_many_connections_are_closed(server):
    several = [socket.create_connection(server.server_address[:2]) for _ in range(40)]
    try:
        time.sleep(0.3)
        closed = 0
        for each in several:
            each.setblocking(False)
            try:
                closed += each.recv(1) == b""
            except BlockingIOError:
                pass
            except ConnectionResetError:
                closed += 1
        assert closed >= 40 - MOST_CONNECTIONS
    finally:
        for each in several:
            each.close()
    time.sleep(0.3)
    assert status(server) == 200


def moments(response):
    """The moments of a walk, as the page reads them."""
    while True:
        (size,) = struct.unpack("<I", response.read(4))
        yield struct.unpack(f"<{size // 8}d", response.read(size))


def test_a_push_acts_a_moment_after_it_came_in(person):
    """And what was done is in the log, from which it is walked again, bit for bit."""
    walk = LiveWalk(person, person.speeds[1])
    with served(person, walk) as server, answer(server, "walk") as response:
        seen = moments(response)
        for _ in range(10):
            next(seen)
        began = time.monotonic()
        assert status(server, "do", method="POST", body=PUSH) == 204
        force = len(NUMBERS) + len(PARAMETERS)  # behind numbers and mu
        for moment in seen:
            if moment[force] > 0.0:
                break
            assert time.monotonic() - began < 5.0
        assert moment[force] == 90.0
        assert time.monotonic() - began < 1.0  # a busy machine
        path = server.session.written
    shown = server.session.shown
    assert 0.0 <= shown.acted - shown.received < 0.25
    log = read_log(path)
    assert [line.doing.forward for line in log.lines if line.doing] == [90.0]
    found = walk_again(log, LiveWalk(person, log.speed))
    assert found.differs is None
    assert found.checked > 0


def test_nobody_looks_so_nobody_walks(person):
    walk = LiveWalk(person, person.speeds[1])
    with served(person, walk) as server:
        time.sleep(0.2)
        assert walk.step == 0
        with answer(server, "walk") as response:
            seen = moments(response)
            while next(seen)[0] < 5:
                pass
        time.sleep(0.3)
        stood = walk.step
        time.sleep(0.3)
        # The page is missed with the first moment that it does not take.
        assert walk.step - stood < 100


def test_who_says_nothing_does_not_keep_the_page_out(server):
    idle = [socket.create_connection(server.server_address[:2]) for _ in range(MOST_CONNECTIONS)]
    try:
        time.sleep(GREETING + 0.5)
        assert status(server) == 200
    finally:
        for each in idle:
            each.close()


def test_who_says_a_letter_now_and_then_does_not_keep_the_page_out(server):
    slow = []
    for _ in range(MOST_CONNECTIONS):
        slow.append(socket.create_connection(server.server_address[:2]))
        time.sleep(0.02)  # until it is taken; of those that come at once some are lost
    began = time.monotonic()
    try:
        while time.monotonic() < began + GREETING + 0.5:
            for each in slow:
                with suppress(OSError):  # it was hung up on
                    each.send(b"G")
            time.sleep(0.25)
        assert status(server) == 200
    finally:
        for each in slow:
            each.close()
