"""Between the workers of a cluster and the process that sent them: news one way, whether to stop the other.

It has a process of its own, so it imports no learning library, and news stay as they were packed.
"""

from __future__ import annotations


class Desk:
    """Keeps news until they are taken."""

    def __init__(self) -> None:
        self._news: list[tuple[str, bytes]] = []
        self._stop = False

    def tell(self, name: str, news: bytes) -> bool:
        """Leave news of a job; returns whether it shall stop."""
        self._news.append((name, news))
        return self._stop

    def hear(self, stop: bool) -> list[tuple[str, bytes]]:
        """Take the news, each with its job's name.

        Args:
            stop: Whether all jobs shall stop.
        """
        news, self._news, self._stop = self._news, [], stop
        return news
