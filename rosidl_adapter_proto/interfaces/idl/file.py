"""A file while it is being read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces.idl.mistakes import Mistake, shown
from rosidl_adapter_proto.interfaces.model import Constant, FieldType, Location, ScalarValue
from rosidl_adapter_proto.interfaces.problem import problem

Node = Any
"""A tree or a token (which is a `str`) of lark; lark itself is imported when the first file is read."""

FullName = tuple[str, ...]
"""A name with those of the modules around it, outermost first."""

MAX_NESTING = 50
"""How deep modules, and parentheses in expressions, may be nested."""


class Type(NamedTuple):
    """A type, and the constants that an enum brings along with it."""

    type: FieldType
    enumerators: tuple[Constant, ...] = ()


@dataclass(frozen=True)
class File:
    """A file, and what has been read from it so far, by full name.

    Attributes:
        typedefs: Typedefs by their last name, since `rosidl_parser` finds them from every scope.
        messages: Where a name that was not defined before is taken for a message.
        values: The values of constants and enumerators.
        warnings: What the user should know, each with its place.
    """

    text: str
    label: str
    structs: dict[FullName, Node] = field(default_factory=dict)
    types: dict[FullName, Type] = field(default_factory=dict)
    typedefs: dict[str, Type] = field(default_factory=dict)
    messages: dict[FullName, Node] = field(default_factory=dict)
    constants: dict[FullName, Constant] = field(default_factory=dict)
    values: dict[FullName, ScalarValue] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def location(self, node: Node) -> Location:
        """Return where the first token of a tree stands."""
        while not isinstance(node, str):
            node = node.children[0]
        return Location(self.label, node.line, node.column)  # type: ignore[attr-defined]

    def problem(self, message: str, place: Node | Location) -> DefinitionError:
        """Return the error for a mistake at a tree, a token or a location."""
        location = place if isinstance(place, Location) else self.location(place)
        return problem(message, self.text, location)

    def as_in_ros(self, read: ScalarValue, value: ScalarValue, place: Node) -> ScalarValue:
        """Return the value that ROS 2 reads in an expression, and warn if it is not the one that OMG IDL has."""
        if read != value:
            self.warnings.append(
                f"{self.location(place)}: ROS 2 reads {shown(read)} here, where OMG IDL has {shown(value)}, and so "
                "it is generated: its parser does not calculate; write a single number"
            )
        return read


@contextmanager
def placed(file: File, node: Node, prefix: str = "") -> Iterator[None]:
    """Give a mistake that is made meanwhile its place in the file."""
    try:
        yield
    except Mistake as mistake:
        raise file.problem(f"{prefix}{mistake}", node) from None
