"""A clock that tests set."""


class Clock:
    """Seconds from any origin, as `Transport` and `Session` take them: `now`, until it is set to another."""

    def __init__(self, now: float = 100.0) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now
