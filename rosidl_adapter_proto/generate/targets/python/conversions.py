"""Conversions as lines of Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from rosidl_adapter_proto import adapter
from rosidl_adapter_proto.adapter.contract import is_plain_field
from rosidl_adapter_proto.generate.targets.python.layout import quoted
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.schema.conversion import (
    Carrier,
    Compact,
    FieldConversion,
    Messages,
    Numbers,
    OneMessage,
    OneValue,
    Steps,
    Values,
)
from rosidl_adapter_proto.schema.proto import ProtoField, ProtoMessage

Lines = tuple[str, ...]


class Writer:
    """Writes the conversions of a module.

    In the lines, `source` is the message that is read and `message` the one that is filled; `arrays` has the bytes of
    the packed fields.

    Attributes:
        adapter_names: What the adapters of other messages are called in the module.
        helpers: The functions of `rosidl_adapter_proto.adapter` that the lines so far call.
    """

    def __init__(self, adapter_names: Mapping[TypeName, str]) -> None:
        """Begin a module."""
        self.adapter_names = adapter_names
        self.helpers: set[str] = set()

    def lines(
        self, message: ProtoMessage, field: ProtoField, conversion: FieldConversion
    ) -> tuple[Lines, Lines]:
        """Return the lines that convert a field of a message, to protobuf and to ROS."""
        match conversion:
            case OneMessage():
                return self._one_message(field, conversion)
            case OneValue():
                return self._one_value(field, conversion)
            case Messages():
                return self._messages(field, conversion)
            case Numbers():
                return self._numbers(message, field, conversion)
            case Compact():
                return self._compact(field, conversion)
            case Values():
                return self._values(field, conversion)

    def _one_message(self, field: ProtoField, conversion: OneMessage) -> tuple[Lines, Lines]:
        nested = self.adapter_names[conversion.nested]
        arguments = f"({_read('source', field)}, {_read('message', field)})"
        return (f"{nested}.fill_custom{arguments}",), (f"{nested}.fill_ros_message{arguments}",)

    def _one_value(self, field: ProtoField, conversion: OneValue) -> tuple[Lines, Lines]:
        source, value = _read("source", field), conversion.value
        to_custom = self._after(value.to_custom, source)
        return (_assign(field, to_custom),), (_assign(field, self._after(value.to_ros, source)),)

    def _messages(self, field: ProtoField, conversion: Messages) -> tuple[Lines, Lines]:
        nested, source = self.adapter_names[conversion.nested], _read("source", field)
        checked = self._after(conversion.length.to_custom, source)
        to_custom = self._call(adapter.fill_each, f"{nested}.fill_custom", checked, _read("message", field))
        if conversion.size is not None:
            messages = self._call(adapter.ros_message_array, nested, source, conversion.size)
        else:
            received = self._after(conversion.length.to_ros, source)
            messages = self._call(adapter.ros_messages, nested, received)
        return (to_custom,), (_assign(field, messages),)

    def _numbers(self, message: ProtoMessage, field: ProtoField, conversion: Numbers) -> tuple[Lines, Lines]:
        source, target = _read("source", field), _read("message", field)
        checked = self._after(conversion.length.to_custom, source)
        values = self._call(adapter.numbers, checked, quoted(conversion.typecode))
        match conversion.carrier:
            case Carrier.BYTES:
                to_custom = _assign(field, f"{values}.tobytes()")
            case Carrier.FIXED:
                packed = self._call(adapter.packed, field.number, values)
                to_custom = method(message, "MergeFromString", packed)
            case Carrier.VARINTS:
                to_custom = f"{target}.extend({values}.tolist())"
        if conversion.size is not None:
            array = self._array(source, conversion)
            return (to_custom,), (self._call(adapter.fill_array, target, array),)
        check = (self._after(conversion.length.to_ros, source),) if conversion.length.to_ros else ()
        clear = (f"del {target}[:]",) if conversion.has_default else ()
        return (to_custom,), (*check, *clear, f"{target}.frombytes({self._data(source, conversion)})")

    def _array(self, source: str, conversion: Numbers) -> str:
        """Return the numbers of a protobuf message as an array."""
        typecode = quoted(conversion.typecode)
        if conversion.packed_index is not None:
            return self._call(adapter.array_of, self._packed_field(conversion.packed_index), typecode)
        if conversion.carrier is Carrier.BYTES:
            return self._call(adapter.numbers, source, typecode)
        return self._call(adapter.elements, source, typecode)

    def _data(self, source: str, conversion: Numbers) -> str:
        """Return the bytes of the numbers of a protobuf message."""
        if conversion.packed_index is not None:
            return self._packed_field(conversion.packed_index)
        if conversion.carrier is Carrier.BYTES:
            return source
        return f"{self._array(source, conversion)}.tobytes()"

    def _packed_field(self, index: int) -> str:
        self._name(adapter.packed_fields)  # the template calls it
        return f"arrays[{index}]"

    def _compact(self, field: ProtoField, conversion: Compact) -> tuple[Lines, Lines]:
        source, values = _read("source", field), conversion.values
        to_custom = self._after(values.to_custom, source)
        to_ros = _or_zeros(self._after(values.to_ros, source), conversion)
        return (_assign(field, to_custom),), (_assign(field, to_ros),)

    def _values(self, field: ProtoField, conversion: Values) -> tuple[Lines, Lines]:
        source, value, length = _read("source", field), conversion.value, conversion.length
        values = self._call(adapter.sequence, self._after(length.to_custom, source))
        to_custom = f"{_read('message', field)}.extend({self._each(value.to_custom, values)})"
        to_ros = _or_zeros(self._each(value.to_ros, self._after(length.to_ros, source)), conversion)
        return (to_custom,), (_assign(field, to_ros),)

    def _each(self, steps: Steps, values: str) -> str:
        """Return the list of what steps make of each value."""
        if not steps:
            return f"list({values})"
        if len(steps) == 1 and not steps[0].arguments:
            return self._call(adapter.each, self._name(getattr(adapter, steps[0].helper.value)), values)
        return self._call(adapter.each, f"lambda value: {self._after(steps, 'value')}", values)

    def _after(self, steps: Steps, value: str) -> str:
        """Return what steps make of a value."""
        for step in steps:
            value = self._call(getattr(adapter, step.helper.value), value, *step.arguments)
        return value

    def _call(self, helper: Callable[..., object], *arguments: object) -> str:
        return f"{self._name(helper)}({', '.join(map(str, arguments))})"

    def _name(self, helper: Callable[..., object]) -> str:
        self.helpers.add(helper.__name__)
        return helper.__name__


def method(message: ProtoMessage, name: str, *arguments: str) -> str:
    """Return the call of a method of a protobuf message, which a field of the same name would hide."""
    if any(each.name == name for each in message.fields):
        return f"type(message).{name}({', '.join(('message', *arguments))})"
    return f"message.{name}({', '.join(arguments)})"


def _or_zeros(values: str, conversion: Compact | Values) -> str:
    """Return the values of a field that ROS has in Python; of an array that protobuf has not, zeros."""
    if conversion.size is None:
        return values
    zero = conversion.zero
    if isinstance(zero, (str, bytes)):
        zero = quoted(zero).replace(r"\x00", r"\0")
    return f"{values} or [{zero}] * {conversion.size}"


def _read(owner: str, field: ProtoField) -> str:
    return f"{owner}.{field.name}" if is_plain_field(field.name) else f'getattr({owner}, "{field.name}")'


def _assign(field: ProtoField, value: str) -> str:
    if is_plain_field(field.name):
        return f"message.{field.name} = {value}"
    return f'setattr(message, "{field.name}", {value})'
