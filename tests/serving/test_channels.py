"""Who gets which message; and when, by a clock that only the test moves."""

import json
from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import pytest

from fba.codec import encode_animation
from fba.errors import BitstreamError
from fba.serving import Plane, PlaneSplitter, arriving, show_file, show_pipe
from fba.serving._channel import MOST_KEPT, MOST_UNSENT, Channel
from fba.serving._pacing import LEAD, LONGEST_PAUSE, paced
from joinable_streams import JOINABLE, performance


class Net:
    """Viewers are names; what each got, and how much waits for them, is written down."""

    def __init__(self) -> None:
        self.got: dict[str, list[Any]] = defaultdict(list)
        self.unsent: dict[str, int] = defaultdict(int)
        self.channel: Channel[str] = Channel(["a", "b"], 1, self.send, lambda viewer: self.unsent[viewer])

    def send(self, viewers: Iterable[str], message: str | bytes) -> None:
        for viewer in viewers:
            self.got[viewer].append(json.loads(message) if isinstance(message, str) else message)

    def take(self, viewer: str) -> list[Any]:
        return self.got.pop(viewer, [])


def plane(number: int, *, opens: bool = False, fresh: bool = False, data: bytes = b"") -> Plane:
    body = data or b"p%d" % number
    return Plane(body, number / 10, 10.0, b"C" + body if opens else b"", fresh)


HELLO = {"event": "hello", "streams": ["a", "b"], "stream": 1}


def start(number: int) -> dict[str, object]:
    return {"event": "start", "time": number / 10, "rate": 10.0}


def test_a_late_viewer_gets_all_since_the_last_i_plane() -> None:
    net = Net()
    net.channel.join("early")
    assert net.take("early") == [HELLO]
    assert net.channel.newcomers == 1
    for number in range(4):
        net.channel.publish(plane(number, opens=number in (0, 2), fresh=not number))
    assert net.channel.newcomers == 0
    assert net.take("early") == [start(0), b"Cp0", b"p1", b"p2", b"p3"]
    net.channel.join("late")
    assert net.take("late") == [HELLO, start(2), b"Cp2p3"]
    net.channel.publish(plane(4))
    assert net.take("late") == net.take("early") == [b"p4"]
    net.channel.leave("late")
    net.channel.end(b"E")
    assert net.take("late") == []
    assert net.take("early") == [b"E", {"event": "end"}]
    assert net.channel.viewers == 1


def test_a_viewer_waits_where_too_much_would_have_to_be_kept() -> None:
    net = Net()
    net.channel.publish(plane(0, opens=True, fresh=True))
    net.channel.publish(plane(1, data=bytes(MOST_KEPT)))
    net.channel.join("late")
    net.channel.publish(plane(2))
    assert net.take("late") == [HELLO]
    net.channel.publish(plane(3, opens=True))
    assert net.take("late") == [HELLO, start(3), b"Cp3"][1:]


def test_a_slow_viewer_loses_frames_and_the_others_none() -> None:
    net = Net()
    net.channel.publish(plane(0, opens=True, fresh=True))
    for viewer in ("slow", "quick"):
        net.channel.join(viewer)
        net.take(viewer)
    net.unsent["slow"] = MOST_UNSENT + 1
    for number in (1, 2, 3):
        net.channel.publish(plane(number, opens=number == 2))
    assert net.take("slow") == []  # not at the I plane either: it has not taken what was sent
    net.unsent["slow"] = 0
    net.channel.publish(plane(4))
    net.channel.publish(plane(5, opens=True))
    net.channel.publish(plane(6))
    assert net.take("slow") == [{"event": "lost", "planes": 4}, start(5), b"Cp5", b"p6"]
    assert net.take("quick") == [b"p%d" % number for number in range(1, 7)]


def test_damage_starts_everyone_anew() -> None:
    net = Net()
    net.channel.publish(plane(0, opens=True, fresh=True))
    net.channel.join("a")
    net.take("a")
    net.channel.publish(plane(1, fresh=True))
    net.channel.publish(plane(2))
    net.channel.join("b")
    net.channel.publish(plane(3, opens=True))
    assert net.take("a") == [start(3), b"Cp3"]
    assert net.take("b") == [HELLO, start(3), b"Cp3"]


class FakeStage:
    """A stage whose clock moves by waiting alone."""

    def __init__(self, *, viewers: int = 1, stop_at: float = 100.0) -> None:
        self.now = 50.0
        self.viewers = self.newcomers = viewers
        self.stop_at = self.now + stop_at
        self.shown: list[tuple[float, bytes]] = []

    def clock(self) -> float:
        return self.now

    def wait(self, seconds: float) -> bool:
        self.now += seconds
        return self.now >= self.stop_at

    def publish(self, plane: Plane) -> None:
        self.newcomers = 0
        self.shown.append((round(self.now - 50, 3), plane.data))

    def end(self, ending: bytes) -> None:
        self.shown.append((round(self.now - 50, 3), ending))


PLANES = [plane(number, opens=not number, fresh=not number) for number in range(3)]


def test_a_file_is_shown_in_real_time_once_for_each_newcomer() -> None:
    stage = FakeStage(viewers=0, stop_at=10)
    show_file(stage, (PLANES, b"E"))
    assert stage.shown == []
    stage = FakeStage(stop_at=10)
    show_file(stage, (PLANES, b"E"))
    assert stage.shown == [(0.0, b"p0"), (0.1, b"p1"), (0.2, b"p2"), (0.3, b"E")]
    stage = FakeStage(stop_at=0.65)
    show_file(stage, (PLANES, b"E"), loop=True)
    assert [at for at, _ in stage.shown] == [0.0, 0.1, 0.2, 0.3, 0.3, 0.4, 0.5, 0.6, 0.6]


def test_pacing() -> None:
    times = [0.0, 0.1, 5.0, 5.0 + LONGEST_PAUSE + 1, 3.0, 3.2]
    stage = FakeStage()
    planes = [Plane(b"%d" % at, time, 10.0) for at, time in enumerate(times)]
    assert [round(stage.now - 50, 3) for _ in paced(planes, stage)] == [0.0, 0.1, 5.0, 5.0, 5.0, 5.2]
    stage = FakeStage()
    planes = [Plane(b"", at / 10, 10.0) for at in range(10)]
    shown = [round(stage.now - 50, 3) for _ in paced(planes, stage, lead=LEAD)]
    assert shown == [0, 0, 0, 0, 0, 0, 0.1, 0.2, 0.3, 0.4]


def test_what_is_live_is_passed_on_at_once() -> None:
    """Also what comes all together, after the program has started."""
    data = encode_animation(performance(), JOINABLE)[0]
    stage, rest = FakeStage(), iter([data, b""])
    at_once = [
        stage.now for _ in arriving(lambda _size: next(rest), PlaneSplitter("visage"), stage, live=True)
    ]
    stage, rest = FakeStage(), iter([data, b""])
    paced = [stage.now for _ in arriving(lambda _size: next(rest), PlaneSplitter("visage"), stage)]
    assert at_once == [50.0] * len(paced)
    assert paced[-1] > 50.0


def test_a_pipe_is_shown_as_it_comes() -> None:
    data = encode_animation(performance(), JOINABLE)[0]
    pieces = [data[at : at + 100] for at in range(0, len(data), 100)]
    stage, splitter = FakeStage(), PlaneSplitter("visage")
    rest = iter([*pieces, b""])
    show_pipe(stage, lambda _size: next(rest), splitter)
    assert len(stage.shown) == splitter.planes + 1
    assert stage.shown[-1][1] == splitter.ending
    with pytest.raises(BitstreamError):
        show_pipe(stage, lambda _size: b"", PlaneSplitter())
