"""Names of topics as users give them."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from fnmatch import fnmatchcase

from rosidl_adapter_proto.interfaces.catalog import near_misses


def is_named(name: str, patterns: Iterable[str]) -> bool:
    """Tell whether a topic is among names and patterns with `*`, `?` and `[...]`."""
    return any(name == pattern or fnmatchcase(name, pattern) for pattern in patterns)


def no_such_topic(name: str, known: Collection[str]) -> str:
    """Return what to say of a name that no topic has: which one may be meant, or which ones there are."""
    others = f"; there are {', '.join(known) or 'none'}"
    return f"there is no topic {name}{near_misses(name, known) or others}"
