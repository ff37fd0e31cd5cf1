"""Names, and what they can stand for."""

from __future__ import annotations

from collections.abc import Iterator

from rosidl_adapter_proto.interfaces.idl.file import FullName, Node


def plain_name(identifier: str) -> str:
    """Return an identifier without the underscore that escapes a keyword (section 7.2.3.2)."""
    return str(identifier).removeprefix("_")


def scoped_name(node: Node) -> tuple[bool, FullName]:
    """Return whether a name (rule 4) begins with `::`, and its identifiers."""
    text = "".join(node.children)
    return text.startswith("::"), tuple(plain_name(each) for each in text.removeprefix("::").split("::"))


def candidates(scope: FullName, node: Node) -> Iterator[FullName]:
    """Yield the full names that a name can stand for, from the innermost scope outwards (section 7.5.2)."""
    absolute, path = scoped_name(node)
    for depth in range(0 if absolute else len(scope), -1, -1):
        yield scope[:depth] + path
