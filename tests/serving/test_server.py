"""The server, over real sockets of the loopback: who is let in, and what comes out."""

import gzip
import json
import re
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

import fba
from fba.codec import Decoder, encode_animation
from fba.errors import FbaError
from fba.serving import Plane, Server, Stage, show_file, split_stream
from fba.serving._gate import REQUESTS_PER_SECOND, Gate, security_headers
from joinable_streams import JOINABLE, assert_same, performance

LOCAL = "127.0.0.1"
PAGE = b"<!doctype html><title>t</title><script>1 + 1</script><script type=module>\nlet x\n</script>"


@contextmanager
def serving(titles: Sequence[str] = ("a.fba",), **options: Any) -> Iterator[Server]:
    with Server(PAGE, titles, port=0, **options) as server:
        yield server


def watch(server: Server, path: str = "stream", **options: Any) -> ClientConnection:
    address = server.url.replace("http:", "ws:")
    return connect(address + path, compression=None, proxy=None, **options)


def take(viewer: ClientConnection, count: int) -> list[Any]:
    messages = [viewer.recv(timeout=60) for _ in range(count)]
    return [json.loads(one) if isinstance(one, str) else one for one in messages]


def get(server: Server, path: str = "", **headers: str) -> tuple[int, bytes, dict[str, str]]:
    url = server.url + path
    try:
        with urlopen(
            Request(url, headers={"Host": f"{LOCAL}:{server.port}"} | headers), timeout=60
        ) as answer:
            return answer.status, answer.read(), dict(answer.headers)
    except HTTPError as error:
        with error:
            return error.code, error.read(), dict(error.headers)


def refusal(server: Server, path: str = "stream", **options: Any) -> int:
    with pytest.raises(InvalidStatus) as refused, watch(server, path, **options):
        pass
    return refused.value.response.status_code


def raw(server: Server, request: str) -> bytes:
    """Return the answer to a request that no client would make."""
    with socket.create_connection((LOCAL, server.port), timeout=60) as opened:
        opened.sendall(request.encode())
        answer = b""
        while more := opened.recv(4096):
            answer += more
    return answer


def test_the_page_and_its_headers() -> None:
    with serving() as server:
        status, body, headers = get(server)
        assert (status, body) == (200, PAGE)
        assert headers["Content-Type"] == "text/html; charset=utf-8"
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert (headers["Referrer-Policy"], headers["Cache-Control"]) == ("no-referrer", "no-store")
        assert "Server" not in headers
        packed = get(server, **{"Accept-Encoding": "br, gzip"})
        assert packed[2]["Content-Encoding"] == "gzip"
        assert gzip.decompress(packed[1]) == PAGE


def test_only_the_scripts_of_the_page_may_run() -> None:
    policy = security_headers(PAGE)["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert len(re.findall(r"'sha256-[\w+/]{43}='", policy)) == 2
    assert "script-src 'none'" in security_headers(b"")["Content-Security-Policy"]


def test_a_long_page_arrives_whole() -> None:
    page = np.random.default_rng(1).bytes(3_000_000)
    with Server(page, ["a"], port=0) as server, urlopen(server.url, timeout=60) as answer:
        assert answer.read() == page


@pytest.mark.parametrize(
    "path",
    ["x", "index.html", "..%2f..%2fetc/passwd", "stream?n=1", "stream?n=-1", "stream?n=00000", "stream?m=0",
     "stream?n=%30", "stream/", "streamx", "?", "stream?n=0&n=0", "stream?n=\u0660".encode().hex()],
)  # fmt: skip
def test_nothing_else_is_served(path: str) -> None:
    with serving() as server:
        assert get(server, path)[0] == 404


@pytest.mark.parametrize("path", ["/../../etc/passwd", "//etc/passwd", "/./", "http://127.0.0.1/", "*", "\\"])
def test_paths_that_lead_elsewhere(path: str) -> None:
    with serving() as server:
        assert raw(server, f"GET {path} HTTP/1.1\r\nHost: {LOCAL}\r\n\r\n").startswith(b"HTTP/1.1 404 ")


def test_other_methods_and_names_are_refused() -> None:
    with serving() as server:
        assert raw(server, f"POST / HTTP/1.1\r\nHost: {LOCAL}\r\n\r\n").startswith(b"HTTP/1.1 405 ")
        for hosts in ("Host: evil.example\r\n", "", f"Host: {LOCAL}\r\nHost: {LOCAL}\r\n", "Host: [\r\n"):
            assert raw(server, f"GET / HTTP/1.1\r\n{hosts}\r\n").startswith(b"HTTP/1.1 421 ")
        assert raw(server, "nonsense\r\n\r\n") == b""
        assert get(server, Host="localhost:1234")[0] == 200
        assert get(server, "stream")[0] == 426  # it is no page


def test_origins() -> None:
    with serving() as server:
        host = f"{LOCAL}:{server.port}"
        for origin in (f"http://{host}", f"https://{host}", None):
            with watch(server, origin=origin) as viewer:
                assert take(viewer, 1)[0]["event"] == "hello"
        for origin in ("http://evil.example", f"http://{LOCAL}", "null", f"http://{host}.evil.example"):
            assert refusal(server, origin=origin) == 403


def test_a_server_for_others_has_a_token() -> None:
    with serving(host=LOCAL) as server:
        assert len(server.token) >= 20
        assert server.url == f"http://{LOCAL}:{server.port}/{server.token}/"
        assert get(server)[:2] == (200, PAGE)
        with watch(server) as viewer:
            assert take(viewer, 1)[0]["event"] == "hello"
        assert get(server, Host="viewer.example")[0] == 200  # other computers know it by other names
        for path in (
            "/",
            "/stream",
            f"/{server.token}",
            f"/{server.token}x/",
            f"/{server.token[:-1]}/stream",
            "//",
        ):
            answer = raw(server, f"GET {path} HTTP/1.1\r\nHost: {LOCAL}\r\n\r\n")
            assert answer.startswith(b"HTTP/1.1 404 ")
    with serving(host=LOCAL) as other:
        assert other.token != server.token


def test_viewers_who_send_are_cut_off() -> None:
    with serving() as server:
        for message in ("x", b"x", "x" * 200, b"x" * 100_000):
            with watch(server) as viewer:
                viewer.send(message)
                with pytest.raises(ConnectionClosed) as closed:
                    take(viewer, 2)
                assert closed.value.rcvd.code == (1008 if len(message) < 126 else 1009)
        with watch(server) as viewer:
            assert take(viewer, 1)[0]["event"] == "hello"


def test_most_viewers() -> None:
    with serving(("a", "b"), most_viewers=2) as server:
        with watch(server) as one, watch(server, "stream?n=1") as two:
            assert [take(viewer, 1)[0]["stream"] for viewer in (one, two)] == [0, 1]
            assert refusal(server) == 503
            assert get(server)[0] == 200
        for _ in range(1000):  # both have left soon
            if not sum(channel.viewers for channel in server.channels):
                break
            threading.Event().wait(0.01)
        with watch(server) as viewer:
            assert take(viewer, 1)[0]["event"] == "hello"


def test_requests_a_second() -> None:
    now = [100.0]
    gate = Gate(PAGE, 1, token="", most_viewers=5, clock=lambda: now[0])
    headers = {"Host": [LOCAL]}

    def answers(count: int) -> list[int]:
        given = [gate.answer("/", lambda name: headers.get(name, []), 0) for _ in range(count)]
        return [0 if one is None else int(one.status) for one in given]

    most = 5 + REQUESTS_PER_SECOND
    assert answers(most + 3) == [200] * most + [429] * 3
    now[0] += 2.5 / REQUESTS_PER_SECOND
    assert answers(3) == [200, 200, 429]
    now[0] += 3600
    assert answers(most + 1) == [200] * most + [429]


STREAM = encode_animation(performance(), JOINABLE)[0]
FRAMES = Decoder(bap_steps="visage").push(STREAM)
PLANES, ENDING = split_stream(STREAM, "visage")


def decode(messages: Sequence[Any]) -> list[fba.Frame]:
    """Decode what a viewer got: each `start` begins another stream."""
    frames: list[fba.Frame] = []
    decoder = Decoder()
    for message in messages:
        if isinstance(message, bytes):
            frames += decoder.push(message)
        elif message["event"] == "start":
            decoder = Decoder()
    return frames


def joined(server: Server, viewers: int, number: int = 0) -> None:
    """Wait until so many viewers are there."""
    while server.channels[number].viewers < viewers:
        threading.Event().wait(0.005)


def test_a_late_viewer_gets_the_frames_of_the_file() -> None:
    with serving() as server:
        stage = server.stage(0)
        with watch(server) as early:
            joined(server, 1)
            for plane in PLANES[:38]:
                stage.publish(plane)
            got = take(early, 40)
            assert got[1] == {"event": "start", "time": 0.0, "rate": 25.0}
            with watch(server) as late:
                joined(server, 2)
                for plane in PLANES[38:]:
                    stage.publish(plane)
                stage.end(ENDING)
                behind = take(late, 3 + len(PLANES) - 38 + 2)
                assert behind[1] == {"event": "start", "time": 1.0, "rate": 25.0}
                assert behind[-1] == {"event": "end"}
                for frame, other in zip(decode(behind), FRAMES[25:], strict=True):
                    assert_same(frame, other)
            got += take(early, len(PLANES) - 38 + 2)
            for frame, other in zip(decode(got), FRAMES, strict=True):
                assert_same(frame, other)
            joined_up = b"".join(one for one in got if isinstance(one, bytes))
            assert len(fba.decode(joined_up)) == len(FRAMES)


def test_a_viewer_who_takes_nothing_loses_frames_and_another_none() -> None:
    """Planes so large that what the system holds for a viewer is soon full."""
    large = [
        Plane(bytes(50_000), n / 10, 10.0, bytes(50_000) if n % 10 == 0 else b"", not n) for n in range(200)
    ]
    with serving() as server:
        stage = server.stage(0)
        with watch(server) as quick, watch(server, max_queue=1) as slow:
            joined(server, 2)
            taken = []
            for plane in large:
                stage.publish(plane)
                taken += take(quick, 3 if not taken else 1)
            assert sum(isinstance(one, bytes) for one in taken) == len(large)
            texts, planes, number = [], 0, len(large)
            while not any(one["event"] == "lost" for one in texts):
                try:
                    message = slow.recv(timeout=0.2)
                except TimeoutError:  # all that was sent has been taken
                    stage.publish(Plane(b"x", number / 10, 10.0, b"Cx", fresh=False))
                    number += 1
                    continue
                if isinstance(message, str):
                    texts.append(json.loads(message))
                else:
                    planes += 1
            lost = texts[-1]["planes"]
            assert [one["event"] for one in texts] == ["hello", "start", "lost"]
            assert lost > 0
            assert planes + lost == number - 1
            assert take(slow, 2) == [{"event": "start", "time": (number - 1) / 10, "rate": 10.0}, b"Cx"]


def test_files_are_shown_when_somebody_comes() -> None:
    short = [Plane(one.data, one.time / 1000, 25_000.0, one.opening, one.fresh) for one in PLANES]

    def source(stage: Stage) -> None:
        show_file(stage, (short, ENDING))

    with serving() as server:
        server.start(0, source)
        for _ in range(2):
            with watch(server) as viewer:
                got = take(viewer, 2 + len(PLANES) + 2)
            assert got[-1] == {"event": "end"}
            assert len(decode(got)) == len(FRAMES)


def finish(_stage: Stage) -> None:
    """A source that ends at once."""


def fail(_stage: Stage) -> None:
    raise FbaError("torn")


@pytest.mark.parametrize(("source", "code"), [(finish, 1000), (fail, 1001), (None, 1001)])
def test_the_end(source: Callable[[Stage], None] | None, code: int) -> None:
    """Viewers may try again but where the stream has ended."""
    failing = pytest.raises(FbaError, match="torn") if source is fail else nullcontext()
    with ExitStack() as stack, failing, serving() as server:
        viewer = stack.enter_context(watch(server))
        take(viewer, 1)
        if source is None:
            server.start(0, lambda stage: show_file(stage, (PLANES, ENDING), loop=True))
            server.stop()
        else:
            server.start(0, source)
        server.wait()
    with pytest.raises(ConnectionClosed) as closed:
        take(viewer, 1000)
    assert closed.value.rcvd.code == code


def test_ports_and_hosts() -> None:
    with serving() as server:
        with pytest.raises(
            FbaError, match=f"port {server.port}: cannot be listened on: .*; give another port"
        ):
            Server(PAGE, ["a"], port=server.port).__enter__()
        for host in ("no.such.host.invalid", "192.0.2.1"):
            with pytest.raises(
                FbaError, match=f"{host}, port 0: cannot be .*; give an address of this computer"
            ):
                Server(PAGE, ["a"], host=host, port=0).__enter__()
