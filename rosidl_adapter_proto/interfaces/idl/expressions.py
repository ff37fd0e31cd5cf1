"""The values of constant expressions (rules 7 to 19)."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

from rosidl_adapter_proto.interfaces.idl.file import MAX_NESTING, File, FullName, Node, placed
from rosidl_adapter_proto.interfaces.idl.literals import (
    LARGEST_INTEGER,
    LITERALS,
    SMALLEST_INTEGER,
    joined_surrogates,
    string_value,
)
from rosidl_adapter_proto.interfaces.idl.mistakes import Mistake, quoted, shown
from rosidl_adapter_proto.interfaces.idl.names import candidates, scoped_name
from rosidl_adapter_proto.interfaces.idl.rosidl_parser import (
    complemented_literal,
    parameter_part,
    size_literal,
)
from rosidl_adapter_proto.interfaces.model import ScalarValue, TypeName, ValueType
from rosidl_adapter_proto.interfaces.scalars import Family


def evaluated(
    file: File, scope: FullName, expression: Node, mask: int | None = None, depth: int = 0
) -> ScalarValue:
    """Return the value of a constant expression (rules 7 to 19).

    Args:
        mask: All bits of the unsigned type that the value is for, which `~` flips; None for other types.
        depth: How many parentheses there are around the expression.
    """
    if depth > MAX_NESTING:
        raise file.problem(f"parentheses are nested more than {MAX_NESTING} deep", expression)
    items = list(expression.children)
    items[::2] = [_operand(file, scope, each, mask, depth) for each in items[::2]]
    for functions in _BINARY_OPERATORS if len(items) > 1 else ():
        folded = items[:1]
        for operator_node, right in zip(items[1::2], items[2::2], strict=True):
            symbol = "".join(operator_node.children)
            if symbol in functions:
                with placed(file, operator_node):
                    folded[-1] = _combined(symbol, functions[symbol], folded[-1], right)
            else:
                folded += (operator_node, right)
        items = folded
    return items[0]  # type: ignore[no-any-return]


def constant_value(file: File, scope: FullName, expression: Node, mask: int | None) -> ScalarValue:
    """Return the value of a constant; `mask` is that of `evaluated`."""
    value = evaluated(file, scope, expression, mask)
    literal = complemented_literal(expression)
    return value if literal is None else file.as_in_ros(int(literal), value, expression)


def parameter_value(file: File, scope: FullName, expression: Node, mask: int | None) -> ScalarValue:
    """Return the value of an annotation's parameter; `mask` is that of `evaluated`."""
    value, part = evaluated(file, scope, expression, mask), parameter_part(expression)
    literal = complemented_literal(part)
    read = evaluated(file, scope, part, mask) if literal is None else int(literal)
    return file.as_in_ros(read, value, expression)


def positive(file: File, scope: FullName, expression: Node) -> int:
    """Return the value of an array size or a bound (rule 19)."""
    value = evaluated(file, scope, expression)
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise file.problem(f"expected a whole number above 0, not {shown(value)}", expression)
    read = int(size_literal(expression) or 0)
    return int(file.as_in_ros(read, value, expression)) if read else value


def complement_mask(type: ValueType) -> int | None:
    """Return all bits of an unsigned type, and None for any other (section 7.4.1.4.3.4)."""
    if isinstance(type, TypeName) or type.scalar.family not in (Family.INTEGER, Family.OCTET):
        return None
    return None if type.scalar.signed else type.scalar.range[1]


def named_value(file: File, scope: FullName, node: Node) -> ScalarValue | None:
    """Return the value of the constant or enumerator that a name stands for, or None if there is none."""
    for candidate in candidates(scope, node):
        if candidate in file.values:
            return file.values[candidate]
    # As `rosidl_adapter` writes the values of .msg files that are no numbers in IDL.
    return {"inf": math.inf, "nan": math.nan}.get("".join(node.children))


def _combined(
    symbol: str, function: Callable[[Any, Any], Any], left: ScalarValue, right: ScalarValue
) -> ScalarValue:
    whole = symbol not in ("*", "/", "+", "-")
    for each in (left, right):
        _require_number(symbol, each, whole)
    if symbol in ("<<", ">>") and int(right) not in range(_INTEGER_BITS):
        raise Mistake(f"a shift must be by 0 to 63, not by {right}")
    if symbol in ("/", "%") and not right:
        raise Mistake("a division by zero")
    result: ScalarValue = function(left, right)
    if isinstance(result, int) and not SMALLEST_INTEGER <= result <= LARGEST_INTEGER:
        raise Mistake(f"the result of '{symbol}' needs more than 64 bits")
    return result


def _require_number(symbol: str, value: ScalarValue, whole: bool) -> None:
    if isinstance(value, (bool, str)) or (whole and isinstance(value, float)):
        kind = "whole numbers" if whole else "numbers"
        raise Mistake(f"'{symbol}' works on {kind}, not on {shown(value)}")


def _quotient(left: float, right: float) -> float:
    """Divide as C does: integers towards zero."""
    if isinstance(left, float) or isinstance(right, float):
        return left / right
    quotient = abs(left) // abs(right)
    return quotient if (left < 0) == (right < 0) else -quotient


def _remainder(left: int, right: int) -> int:
    """Return the remainder that goes with `_quotient`: it has the sign of `left`."""
    return abs(left) % abs(right) * (-1 if left < 0 else 1)


_BINARY_OPERATORS: tuple[dict[str, Callable[[Any, Any], Any]], ...] = (
    {"*": operator.mul, "/": _quotient, "%": _remainder},  # rule 13
    {"+": operator.add, "-": operator.sub},  # rule 12
    {"<<": operator.lshift, ">>": operator.rshift},  # rule 11
    {"&": operator.and_},  # rule 10
    {"^": operator.xor},  # rule 9
    {"|": operator.or_},  # rule 8
)
"""The binary operators, those that bind strongest first."""

_INTEGER_BITS = 64


def _operand(file: File, scope: FullName, node: Node, mask: int | None, depth: int) -> ScalarValue:
    if isinstance(node, str):
        with placed(file, node, f"{quoted(node)}: "):
            return LITERALS[node.type](node)  # type: ignore[attr-defined]
    if node.data == "string_literals":
        with placed(file, node):
            return joined_surrogates("".join(string_value(each) for each in node.children))
    if node.data == "scoped_name":
        value = named_value(file, scope, node)
        if value is None:
            raise file.problem(f"unknown constant '{''.join(node.children)}'{_suggestion(file, node)}", node)
        return value
    if node.data == "unary_expr":
        return _unary(file, scope, node, mask, depth)
    return evaluated(file, scope, node, mask, depth + 1)


def _unary(file: File, scope: FullName, node: Node, mask: int | None, depth: int) -> ScalarValue:
    symbol, operand_node = node.children
    value: Any = _operand(file, scope, operand_node, mask, depth)
    with placed(file, symbol):
        _require_number(symbol, value, whole=symbol == "~")
    if symbol == "~":
        return ~value if mask is None else mask ^ value  # type: ignore[no-any-return]
    return -value if symbol == "-" else value  # type: ignore[no-any-return]


def _suggestion(file: File, node: Node) -> str:
    _, path = scoped_name(node)
    names = ("::".join(each) for each in file.values if each[-1] == path[-1])
    return next((f": write {each}" for each in names), ": define it above")
