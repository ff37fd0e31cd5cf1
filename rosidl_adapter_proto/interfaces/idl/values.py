"""Values in the form that the model has them in for a type."""

from __future__ import annotations

import ast
import warnings
from collections.abc import Callable, Mapping

from rosidl_adapter_proto.interfaces.idl.mistakes import Mistake, shown
from rosidl_adapter_proto.interfaces.model import (
    ArrayType,
    FieldType,
    ScalarValue,
    SequenceType,
    StringType,
    TypeName,
    Value,
    ValueType,
)
from rosidl_adapter_proto.interfaces.scalars import Family, Scalar


def fitted(value: object, type: ValueType) -> ScalarValue:
    """Return a value in the form that the model has it in for a type.

    Raises:
        Mistake: The type cannot hold the value.
    """
    if isinstance(type, TypeName):
        raise Mistake(f"the message {type} cannot have a default value")
    bound = type.bound if isinstance(type, StringType) else None
    return FITTERS[type.scalar.family](value, type.scalar, bound)


def fitted_default(value: ScalarValue, type: FieldType) -> Value:
    """Return the default value that an annotation gives to a field.

    Raises:
        Mistake: The type cannot hold the value.
    """
    if not isinstance(type, (ArrayType, SequenceType)):
        return fitted(value, type)
    values = _tuple(value)
    if isinstance(type, ArrayType) and len(values) != type.size:
        raise Mistake(f"{len(values)} values for an array of {type.size}")
    if isinstance(type, SequenceType) and type.bound is not None and len(values) > type.bound:
        raise Mistake(f"{len(values)} values for a sequence of at most {type.bound}")
    return tuple(fitted(each, type.value_type) for each in values)


def _fitted_boolean(value: object, scalar: Scalar, bound: int | None) -> bool:
    if not isinstance(value, int) or value not in (0, 1):
        raise Mistake(f"{shown(value)} is not TRUE or FALSE")
    return bool(value)


def _fitted_integer(value: object, scalar: Scalar, bound: int | None) -> int:
    value, (low, high) = _number(value), scalar.range
    if not isinstance(value, int) or not low <= value <= high:
        raise Mistake(f"{shown(value)} does not fit {scalar.name}: use a whole number from {low} to {high}")
    return value


def _fitted_character(value: object, scalar: Scalar, bound: int | None) -> int:
    is_character = isinstance(value, str) and len(value) == 1
    return _fitted_integer(ord(str(value)) if is_character else value, scalar, bound)


def _fitted_float(value: object, scalar: Scalar, bound: int | None) -> float:
    try:
        return float(_number(value))
    except OverflowError:
        raise Mistake(f"{shown(value)} is too large") from None


def _fitted_string(value: object, scalar: Scalar, bound: int | None) -> str:
    if not isinstance(value, str):
        raise Mistake(f"{shown(value)} is not a string: put it in quotes")
    if bound is not None and len(value) > bound:
        raise Mistake(f"{shown(value)} is longer than {bound} characters")
    return value


FITTERS: Mapping[Family, Callable[[object, Scalar, int | None], ScalarValue]] = {
    Family.BOOLEAN: _fitted_boolean,
    Family.INTEGER: _fitted_integer,
    Family.FLOATING_POINT: _fitted_float,
    Family.OCTET: _fitted_integer,
    Family.CHARACTER: _fitted_character,
    Family.STRING: _fitted_string,
    Family.WSTRING: _fitted_string,
}
"""What fits a value to a type of each family, with its bound if it is a string."""


def _number(value: object) -> int | float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise Mistake(f"{shown(value)} is not a number")
    return value


def _tuple(value: ScalarValue) -> tuple[object, ...]:
    """Return the values of an array or sequence: `rosidl_adapter` writes them as a Python tuple."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            values = ast.literal_eval(value) if isinstance(value, str) else None
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError):
        values = None
    if not isinstance(values, (tuple, list)):
        raise Mistake(f'{shown(value)} is not of the form "(1, 2, 3)"')
    return tuple(values)
