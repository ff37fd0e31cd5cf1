"""Warnings, of which a damaged file may have as many as it has bytes."""

from __future__ import annotations

MAXIMUM_WARNINGS = 100

_MORE = f"there is more to warn of than these {MAXIMUM_WARNINGS}, which is not listed"


class WarningList(list[str]):
    """What is odd, for people: each text once, and no more of them than somebody reads."""

    def add(self, text: str) -> None:
        """Add a text; where there are too many, one that says so."""
        if len(self) <= MAXIMUM_WARNINGS and text not in self:
            self.append(text if len(self) < MAXIMUM_WARNINGS else _MORE)
