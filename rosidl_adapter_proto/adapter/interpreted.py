"""Conversions of fields that are interpreted: functions that do what the lines of generated adapters do.

The decisions are those of `schema/conversion.py`, and the helpers are those that generated lines call. So results and
errors are the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rosidl_adapter_proto import adapter
from rosidl_adapter_proto.adapter.arrays import array_of, elements, fill_array, numbers, packed
from rosidl_adapter_proto.adapter.messages import fill_each, ros_message_array, ros_messages
from rosidl_adapter_proto.adapter.values import each, sequence
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
from rosidl_adapter_proto.schema.proto import ProtoField

Fill = Callable[[Any, Any, Sequence[bytes]], None]
"""Fills a field of a message (the second argument) from that of another (the first).

The third are the bytes of the packed fields, if the first is a protobuf message.
"""

Convert = Callable[[Any], Any]

Adapters = Mapping[TypeName, Any]


def fills(field: ProtoField, conversion: FieldConversion, adapters: Adapters) -> tuple[Fill, Fill]:
    """Return what fills a field of a protobuf message, and what fills that of a ROS message.

    Args:
        field: The field.
        conversion: How it is converted.
        adapters: The adapters of the messages that fields refer to.
    """
    name = field.name
    match conversion:
        case OneMessage():
            nested = adapters[conversion.nested]
            return _filling(name, nested.fill_custom), _filling(name, nested.fill_ros_message)
        case OneValue():
            value = conversion.value
            return _assigning(name, _converter(value.to_custom)), _assigning(name, _converter(value.to_ros))
        case Messages():
            return _messages(name, conversion, adapters[conversion.nested])
        case Numbers():
            return _numbers_to_custom(field, conversion), _numbers_to_ros(name, conversion)
        case Compact():
            to_ros = _or_zeros(_converter(conversion.values.to_ros), conversion)
            return _assigning(name, _converter(conversion.values.to_custom)), _assigning(name, to_ros)
        case Values():
            return _values(name, conversion)


def _converter(steps: Steps) -> Convert:
    """Return the function that applies steps to a value."""
    convert: Convert = _same
    for step in steps:
        convert = _then(convert, getattr(adapter, step.helper.value), step.arguments)
    return convert


def _same(value: Any) -> Any:
    return value


def _then(first: Convert, helper: Callable[..., Any], arguments: tuple[float, ...]) -> Convert:
    if first is _same:
        return helper if not arguments else lambda value: helper(value, *arguments)
    return lambda value: helper(first(value), *arguments)


def _filling(name: str, fill: Callable[[Any, Any], None]) -> Fill:
    return lambda source, message, _: fill(getattr(source, name), getattr(message, name))


def _assigning(name: str, convert: Convert) -> Fill:
    if convert is _same:
        return lambda source, message, _: setattr(message, name, getattr(source, name))
    return lambda source, message, _: setattr(message, name, convert(getattr(source, name)))


def _messages(name: str, conversion: Messages, nested: Any) -> tuple[Fill, Fill]:
    check, received = _converter(conversion.length.to_custom), _converter(conversion.length.to_ros)
    fill_nested, size = nested.fill_custom, conversion.size

    def fill_custom(source: Any, message: Any, _: Sequence[bytes]) -> None:
        fill_each(fill_nested, check(getattr(source, name)), getattr(message, name))

    def to_ros(values: Any) -> list[Any]:
        if size is not None:
            return ros_message_array(nested, values, size)
        return ros_messages(nested, received(values))

    return fill_custom, _assigning(name, to_ros)


def _store_bytes(message: Any, field: ProtoField, values: Any) -> None:
    setattr(message, field.name, values.tobytes())


def _store_fixed(message: Any, field: ProtoField, values: Any) -> None:
    type(message).MergeFromString(message, packed(field.number, values))


def _store_varints(message: Any, field: ProtoField, values: Any) -> None:
    getattr(message, field.name).extend(values.tolist())


_STORE: Mapping[Carrier, Callable[[Any, ProtoField, Any], None]] = {
    Carrier.BYTES: _store_bytes,
    Carrier.FIXED: _store_fixed,
    Carrier.VARINTS: _store_varints,
}
"""Puts an array of numbers into a protobuf message, for each way it may have them."""


def _numbers_to_custom(field: ProtoField, conversion: Numbers) -> Fill:
    name, typecode, store = field.name, conversion.typecode, _STORE[conversion.carrier]
    check = _converter(conversion.length.to_custom)

    def fill(source: Any, message: Any, _: Sequence[bytes]) -> None:
        store(message, field, numbers(check(getattr(source, name)), typecode))

    return fill


def _numbers_to_ros(name: str, conversion: Numbers) -> Fill:
    if conversion.size is not None:
        array = _array(name, conversion)
        return lambda source, message, arrays: fill_array(getattr(message, name), array(source, arrays))
    check, data, has_default = (
        _converter(conversion.length.to_ros),
        _data(name, conversion),
        conversion.has_default,
    )

    def fill(source: Any, message: Any, arrays: Sequence[bytes]) -> None:
        if check is not _same:
            check(getattr(source, name))
        target = getattr(message, name)
        if has_default:
            del target[:]
        target.frombytes(data(source, arrays))

    return fill


def _array(name: str, conversion: Numbers) -> Callable[[Any, Sequence[bytes]], Any]:
    """Return what reads the numbers of a protobuf message as an array."""
    typecode, index = conversion.typecode, conversion.packed_index
    if index is not None:
        return lambda source, arrays: array_of(arrays[index], typecode)
    if conversion.carrier is Carrier.BYTES:
        return lambda source, arrays: numbers(getattr(source, name), typecode)
    return lambda source, arrays: elements(getattr(source, name), typecode)


def _data(name: str, conversion: Numbers) -> Callable[[Any, Sequence[bytes]], bytes]:
    """Return what reads the bytes of the numbers of a protobuf message."""
    typecode, index = conversion.typecode, conversion.packed_index
    if index is not None:
        return lambda source, arrays: arrays[index]
    if conversion.carrier is Carrier.BYTES:
        return lambda source, arrays: getattr(source, name)
    return lambda source, arrays: elements(getattr(source, name), typecode).tobytes()


def _values(name: str, conversion: Values) -> tuple[Fill, Fill]:
    check, convert = _converter(conversion.length.to_custom), _for_each(conversion.value.to_custom)
    received, convert_to_ros = _converter(conversion.length.to_ros), _for_each(conversion.value.to_ros)

    def fill_custom(source: Any, message: Any, _: Sequence[bytes]) -> None:
        getattr(message, name).extend(convert(sequence(check(getattr(source, name)))))

    def to_ros(values: Any) -> list[Any]:
        return convert_to_ros(received(values))

    return fill_custom, _assigning(name, _or_zeros(to_ros, conversion))


def _for_each(steps: Steps) -> Callable[[Iterable[Any]], list[Any]]:
    """Return the function that makes a list of what steps make of each value."""
    if not steps:
        return list
    convert = _converter(steps)
    return lambda values: each(convert, values)


def _or_zeros(convert: Convert, conversion: Compact | Values) -> Convert:
    """Return what makes zeros of an array that protobuf has not."""
    size, zero = conversion.size, conversion.zero
    if size is None:
        return convert
    return lambda values: convert(values) or [zero] * size
