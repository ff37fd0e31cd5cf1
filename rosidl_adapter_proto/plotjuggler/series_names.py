"""Names of series as users give them."""

from __future__ import annotations

import re
from collections.abc import Iterable

from rosidl_adapter_proto.interfaces.catalog import near_misses

_WILD = re.compile(r"[*?]")


class SeriesNames:
    """Tells which series somebody has chosen.

    A name is that of a series, such as `/imu/linear_acceleration/x`; or what stands above several, such as
    `/imu/linear_acceleration` or `/scan/ranges`; or a pattern, in which `*` is any text and `?` any character.

    Args:
        names: The names; none chooses all series.

    Raises:
        TypeError: `names` is one text.
    """

    def __init__(self, names: Iterable[str] = ()) -> None:
        if isinstance(names, str):
            raise TypeError(f"fields is one text, {names!r}; give a list of names")
        self._patterns = {name: _pattern(name) for name in names}
        self._unused = dict.fromkeys(self._patterns)
        self._seen: list[str] = []

    def may_be_of(self, topic: str) -> bool:
        """Tell whether a topic can have one of the series."""
        return not self._patterns or any(_may_be_of(name, topic) for name in self._patterns)

    def is_chosen(self, name: str) -> bool:
        """Tell whether a series is among the chosen ones."""
        chosen = [each for each, pattern in self._patterns.items() if pattern.fullmatch(name)]
        for each in chosen:
            self._unused.pop(each, None)
        if not chosen and self._unused:
            self._seen.append(name)
        return bool(chosen) or not self._patterns

    def problem(self) -> str | None:
        """Return what to say of a name that no series had, if there is one."""
        unused = next(iter(self._unused), None)
        return None if unused is None else f"there is no series {unused}{near_misses(unused, self._seen)}"


EVERY_NAME = SeriesNames()


def _pattern(name: str) -> re.Pattern[str]:
    text = re.escape(name).replace(r"\*", ".*").replace(r"\?", ".")
    return re.compile(rf"{text}(?:[/\[].*)?", re.DOTALL)


def _may_be_of(name: str, topic: str) -> bool:
    begin = _WILD.split(name, maxsplit=1)[0]
    is_wild = begin != name
    return (
        begin == topic
        or begin.startswith((f"{topic}/", f"{topic}["))
        or (is_wild and topic.startswith(begin))
    )
