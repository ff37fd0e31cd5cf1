"""Hypothesis strategies for values of every interface type, as ROS has them in Python."""

from __future__ import annotations

import array
from math import inf
from typing import Any

import numpy
from hypothesis import strategies as st

from rosidl_adapter_proto.adapter import TypeAdapter
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.model import (
    EMPTY_STRUCT_FIELD,
    ArrayType,
    BasicType,
    FieldType,
    Message,
    SequenceType,
    StringType,
    TypeName,
    ValueType,
)

# NUL ends a C string, so ROS cannot send it.
_CHARACTERS = st.characters(exclude_categories=["Cs"], exclude_characters="\0")
_LONGEST_SEQUENCE = 4


class RosMessages:
    """Strategies for ROS messages: objects of the ROS classes that the adapters name."""

    def __init__(self, catalog: Catalog, adapters: dict[TypeName, type[TypeAdapter[Any, Any]]]) -> None:
        self.catalog = catalog
        self.adapters = adapters
        self._made: dict[TypeName, st.SearchStrategy[Any]] = {}

    def message(self, name: TypeName) -> st.SearchStrategy[Any]:
        """Return a strategy for a message."""
        if name not in self._made:
            model = self.catalog.message(name)
            values = st.fixed_dictionaries(
                {each.name: self.value(each.type) for each in model.fields if each.name != EMPTY_STRUCT_FIELD}
            )
            ros_class = self.adapters[name].ros_message_type
            self._made[name] = values.map(lambda fields: ros_class(**fields))
        return self._made[name]

    def value(self, field_type: FieldType) -> st.SearchStrategy[Any]:
        """Return a strategy for the value of a field."""
        if not isinstance(field_type, (ArrayType, SequenceType)):
            return self.element(field_type)
        element = field_type.value_type
        if isinstance(field_type, ArrayType):
            values = st.lists(self.element(element), min_size=field_type.size, max_size=field_type.size)
        else:
            longest = min(field_type.bound or _LONGEST_SEQUENCE, _LONGEST_SEQUENCE)
            values = st.lists(self.element(element), max_size=longest)
        code = element.scalar.typecode if isinstance(element, BasicType) else None
        if code is not None:
            if isinstance(field_type, ArrayType):
                return values.map(lambda each: numpy.array(each, dtype=numpy.dtype(code)))
            return values.map(lambda each: array.array(code, each))
        return values

    def element(self, value_type: ValueType) -> st.SearchStrategy[Any]:
        """Return a strategy for a single value."""
        if isinstance(value_type, TypeName):
            return self.message(value_type)
        if isinstance(value_type, StringType):
            longest = min(value_type.bound or 8, 8)
            return st.text(_CHARACTERS, max_size=longest)
        if value_type.name == "boolean":
            return st.booleans()
        if value_type.name == "octet":
            return st.binary(min_size=1, max_size=1)
        if value_type.name in ("float", "double", "long double"):
            # NaN is not equal to itself, and ROS refuses the last float32 before infinity.
            if value_type.name == "float":
                return st.floats(-(2.0**127), 2.0**127, width=32) | st.sampled_from([inf, -inf])
            return st.floats(allow_nan=False)
        return st.integers(*value_type.scalar.range)


def message_names(catalog: Catalog, names: list[TypeName]) -> list[TypeName]:
    """Return every message of some interfaces, those of services and actions included."""
    from rosidl_adapter_proto.interfaces.model import messages

    found: list[Message] = []
    for name in names:
        found += messages(catalog.definition(name).interface, events=True)
    return [message.name for message in found]
