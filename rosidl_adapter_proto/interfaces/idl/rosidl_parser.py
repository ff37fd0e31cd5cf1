"""What ROS 2's own `rosidl_parser` takes for the value of an expression.

It does not calculate. Out of an array size or a bound it takes the decimal literal that lies deepest in its tree, and
for `~` it has no rule. What it reads is what is installed and hashed, so it counts; see `File.as_in_ros`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rosidl_adapter_proto.interfaces.idl.file import Node

_DECIMAL = re.compile(r"0|[1-9][0-9]*")

_OPERATORS = (("|",), ("^",), ("&",), ("<<", ">>"), ("+", "-"), ("*", "/", "%"))
"""The binary operators, those that bind weakest first (rules 8 to 13)."""

_UNARY_AND_PRIMARY = 2
"""How many levels its tree has between the binary operators and an operand (rules 14 and 16)."""


def size_literal(expression: Node) -> str | None:
    """Return the decimal literal that is taken for an array size or a bound; None if there is none, an error there."""
    literals = [(depth, node) for depth, node in _nodes(expression, 0) if _is_decimal(node)]
    # Of several that lie equally deep, it is the first.
    return max(literals, key=lambda each: each[0])[1] if literals else None


def complemented_literal(expression: Node) -> str | None:
    """Return the decimal literal behind the `~` that an expression begins with, which goes unseen there."""
    operand, *others = expression.children
    if others or isinstance(operand, str) or operand.data != "unary_expr":
        return None
    symbol, literal = operand.children
    return literal if symbol == "~" and _is_decimal(literal) else None


def parameter_part(expression: Node) -> Node:
    """Return the part of an annotation's parameter that is taken for all of it: the deepest parentheses."""
    parts = [(depth, node) for depth, node in _nodes(expression, 0) if _is_expression(node)]
    part = max(parts, key=lambda each: each[0])[1] if parts else expression
    operand = part.children[0]
    # More than one operand is an error there, and a name is taken for text.
    is_read = len(part.children) == 1 and (isinstance(operand, str) or operand.data != "scoped_name")
    return part if is_read else expression


def _nodes(expression: Node, depth: int) -> Iterator[tuple[int, Node]]:
    """Yield the operands of an expression, those in parentheses too, and how deep each lies in its tree."""
    operands, operators = expression.children[::2], expression.children[1::2]
    symbols = ["".join(each.children) for each in operators]
    for operand, own in zip(operands, _depths(symbols), strict=True):
        node = operand
        if not isinstance(node, str) and node.data == "unary_expr":
            node = node.children[1]
        below = depth + own + _UNARY_AND_PRIMARY
        yield below, node
        if _is_expression(node):
            yield from _nodes(node, below + 1)


def _depths(symbols: list[str]) -> list[int]:
    """Return how deep each operand lies below the operators between them: their tree leans to the left."""
    depths = [0] * (len(symbols) + 1)
    groups = [range(len(depths))]
    for level in _OPERATORS:
        inner: list[range] = []
        for group in groups:
            breaks = [index + 1 for index in group[:-1] if symbols[index] in level]
            starts, ends = [group.start, *breaks], [*breaks, group.stop]
            for position, (start, end) in enumerate(zip(starts, ends, strict=True)):
                inner.append(range(start, end))
                for index in range(start, end):
                    depths[index] += len(starts) - position
        groups = inner
    return depths


def _is_decimal(node: Node) -> bool:
    return isinstance(node, str) and node.type == "INTEGER" and bool(_DECIMAL.fullmatch(node))  # type: ignore[attr-defined]


def _is_expression(node: Node) -> bool:
    return not isinstance(node, str) and node.data in ("const_expr", "bound")
