"""YAML of bags and plugins, which may come from anywhere: read as plain texts, within limits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

from rosidl_adapter_proto.errors import BagError

Node: TypeAlias = "str | list[Node] | dict[str, Node]"
"""A value as it is written: rosbag2 says what type each has, never YAML (`1e3`, `on` and `~` are texts)."""

MAXIMUM_DEPTH = 32
MAXIMUM_NODE_COUNT = 2_000_000


def read_yaml(text: str, path: str) -> Node:
    """Return what a YAML text says.

    An alias counts as often as it is used, so that a short text cannot become a large value.

    Args:
        text: One YAML document.
        path: The file that it is from, for people.

    Raises:
        BagError: It is no YAML, or nested or large beyond what there is need for.
    """
    import yaml

    # Only the events: to compose nodes, PyYAML calls itself for each level, in C without a limit.
    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
    try:
        return _Reader(yaml.parse(text, Loader=loader), path).document()
    except yaml.MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}: " if error.problem_mark else ""
        raise BagError(f"{path}: {line}not valid YAML: {error.problem}") from None
    except yaml.YAMLError as error:
        raise BagError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from None


class _Reader:
    """The events of a YAML text, made into values.

    Attributes:
        count: How many values there are so far, those of aliases again for each use.
        anchors: The values that have a name for aliases, with their counts.
    """

    def __init__(self, events: Iterator[Any], path: str) -> None:
        self.events = events
        self.path = path
        self.count = 0
        self.anchors: dict[str, tuple[Node, int]] = {}

    def document(self) -> Node:
        import yaml

        found: Node = ""
        documents = 0
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise self.error(event, "a second document begins; there may be one")
                found = self.node(next(self.events), 0)
        return found

    def node(self, event: Any, depth: int) -> Node:
        import yaml

        before = self.count
        self.count += 1
        if isinstance(event, yaml.AliasEvent):
            return self.alias(event)
        if depth > MAXIMUM_DEPTH:
            raise self.error(event, f"nested more than {MAXIMUM_DEPTH} deep")
        if isinstance(event, yaml.ScalarEvent):
            node: Node = event.value
        elif isinstance(event, yaml.SequenceStartEvent):
            node = self.sequence(depth)
        else:
            node = self.mapping(depth)
        if self.count > MAXIMUM_NODE_COUNT:
            raise self.error(event, f"more than {MAXIMUM_NODE_COUNT} values")
        if event.anchor is not None:
            self.anchors[event.anchor] = node, self.count - before
        return node

    def alias(self, event: Any) -> Node:
        if event.anchor not in self.anchors:  # named later, or around it
            raise self.error(event, f"nothing before it is called {event.anchor}")
        node, count = self.anchors[event.anchor]
        self.count += count
        if self.count > MAXIMUM_NODE_COUNT:
            raise self.error(event, f"more than {MAXIMUM_NODE_COUNT} values, counting each use of an alias")
        return node

    def sequence(self, depth: int) -> list[Node]:
        import yaml

        values: list[Node] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            values.append(self.node(event, depth + 1))
        return values

    def mapping(self, depth: int) -> dict[str, Node]:
        import yaml

        values: dict[str, Node] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            key = self.node(event, depth + 1)
            if not isinstance(key, str):
                raise self.error(event, "a key that is not a text")
            if key in values:
                raise self.error(event, f"a second {key}")
            values[key] = self.node(next(self.events), depth + 1)
        return values

    def error(self, event: Any, reason: str) -> BagError:
        return BagError(f"{self.path}: line {event.start_mark.line + 1}: {reason}")
