"""What generated adapters stand on: their base classes and the helpers that their conversions call.

This module imports nothing but protobuf and the standard library, so that importing a generated package is cheap.
ROS classes and numpy are imported when they are first needed.
"""

from __future__ import annotations

import importlib
import sys
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence, Sized
from functools import cache, lru_cache, partial
from math import isfinite
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, NoReturn, TypeVar

from google.protobuf import descriptor_pool
from google.protobuf.message import Message

from rosidl_adapter_proto.errors import ConversionError, Error, wrong_message

if TYPE_CHECKING:
    from google.protobuf.descriptor import FileDescriptor
    from typing_extensions import Buffer

    from rosidl_adapter_proto.interfaces.description import IndividualTypeDescription, TypeDescription
    from rosidl_adapter_proto.transcode import Codec, Transcoder

CustomT = TypeVar("CustomT", bound=Message)
RosT = TypeVar("RosT")
RequestT = TypeVar("RequestT", bound=Message)
ResponseT = TypeVar("ResponseT", bound=Message)
GoalT = TypeVar("GoalT", bound=Message)
ResultT = TypeVar("ResultT", bound=Message)
FeedbackT = TypeVar("FeedbackT", bound=Message)
SizedT = TypeVar("SizedT", bound=Sized)

CONVERSION_ERRORS = (ConversionError, TypeError, ValueError, OverflowError, AttributeError, AssertionError)
"""What a value that does not fit can raise while it is converted; the setters of ROS messages assert."""

LARGEST_FLOAT32 = 3.4028235677973366e38
"""Halfway between the largest float32 and the next power of two: from here on a float becomes infinite."""


class RosNotFoundError(Error, ImportError):
    """A ROS message class is needed, but its package cannot be imported."""


class _RosClass:
    """Imports the ROS class of an adapter when it is first asked for, and then makes way for it."""

    def __init__(self, attribute: str) -> None:
        self.attribute = attribute

    def __get__(self, instance: object, owner: Any) -> Any:
        module_name, _, path = owner.ros_class.partition(":")
        try:
            ros_class: Any = importlib.import_module(module_name)
        except ImportError as error:
            raise RosNotFoundError(
                f"{owner.type_name}: cannot import {module_name} ({error}); "
                "source a ROS 2 installation that has it, or install it with pip"
            ) from error
        for name in path.split("."):
            try:
                ros_class = getattr(ros_class, name)
            except AttributeError:
                raise RosNotFoundError(
                    f"{owner.type_name}: {module_name} has no {path}; "
                    "the installed ROS package is of another version than the generated adapter"
                ) from None
        setattr(owner, self.attribute, ros_class)
        return ros_class


class _Codec:
    """Makes the codec of an adapter when it is first asked for, and then makes way for it."""

    def __get__(self, instance: object, owner: type[TypeAdapter[Any, Any]]) -> Codec[Any]:
        from rosidl_adapter_proto.transcode import Codec

        owner.codec = Codec(owner.type_description(), owner.custom_type)
        # From now on these are the native methods themselves, unless somebody has put others in their place.
        native = {"to_cdr": owner.codec.to_cdr, "from_cdr": owner.codec.from_cdr}
        for name, method in native.items():
            _native_types.add(type(method))
            if vars(owner).get(name) is vars(TypeAdapter)[name]:
                setattr(owner, name, method)
        return owner.codec


class _Transcoder:
    """Takes the transcoder of an adapter from its codec."""

    def __get__(self, instance: object, owner: type[TypeAdapter[Any, Any]]) -> Transcoder:
        owner.transcoder = owner.codec.transcoder
        return owner.transcoder


_native_types: set[type] = set()


class FieldInfo(NamedTuple):
    """The type of a field, as `type_description_interfaces/msg/FieldType` has it (REP-2011).

    Attributes:
        name: The field's name.
        type_id: The type, a `FIELD_TYPE_*` constant.
        capacity: Length of an array, bound of a bounded sequence, else 0.
        string_capacity: Bound of a bounded string, else 0.
        nested: Adapter of the message type, if it is one.
    """

    name: str
    type_id: int
    capacity: int = 0
    string_capacity: int = 0
    nested: type[TypeAdapter[Any, Any]] | None = None


class TypeAdapter(Generic[CustomT, RosT]):
    """Converts between a protobuf message and a ROS message (REP-2007, for Python).

    Generated classes derive from it; none is ever instantiated.

    Attributes:
        custom_type: The protobuf message class.
        ros_message_type: The ROS message class, imported when it is first asked for.
        type_name: The ROS name of the type, such as `std_msgs/msg/String`.
        type_hash: The RIHS01 hash of the type (REP-2011).
        fields: The fields of the ROS message, in order.
        defaults: Default values other than zero, in terms of protobuf.
        has_defaults: Whether the type or one inside it has any.
        codec: Turns protobuf messages into serialized ROS messages and back, made when it is first asked for.
        transcoder: Turns serialized messages from one format into the other; that of the codec.
        ros_class: Where the ROS message class is: `module:Class`.
    """

    custom_type: type[CustomT]
    ros_message_type: Any = _RosClass("ros_message_type")
    type_name: ClassVar[str]
    type_hash: ClassVar[str]
    fields: ClassVar[tuple[FieldInfo, ...]]
    defaults: ClassVar[Mapping[str, Any]] = {}
    has_defaults: ClassVar[bool] = False
    if TYPE_CHECKING:
        codec: ClassVar[Codec[Any]]
        transcoder: ClassVar[Transcoder]
    else:
        codec = _Codec()
        transcoder = _Transcoder()
    ros_class: ClassVar[str]

    def __init_subclass__(cls, **arguments: Any) -> None:
        """Let a class that derives from an adapter in use have a transcoder of its own."""
        super().__init_subclass__(**arguments)
        for name in ("codec", "transcoder", "ros_message_type", "to_cdr", "from_cdr"):
            if name in vars(cls) or (name == "ros_message_type" and "ros_class" not in vars(cls)):
                continue
            inherited = next(vars(base)[name] for base in cls.__mro__[1:] if name in vars(base))
            is_method = name in ("to_cdr", "from_cdr")
            if not is_method or inherited is vars(TypeAdapter)[name] or type(inherited) in _native_types:
                setattr(cls, name, vars(TypeAdapter)[name])

    @staticmethod
    def convert_to_ros_message(source: CustomT, destination: RosT | None = None) -> RosT:
        """Convert a protobuf message to a ROS message.

        Args:
            source: The protobuf message. Fields that its class does not know are ignored.
            destination: A ROS message to overwrite; a new one is made if it is None.

        Returns:
            The destination, or the new ROS message.

        Raises:
            ConversionError: A value does not fit; the destination is left as it was.
            RosNotFoundError: The ROS message class cannot be imported.
        """
        raise NotImplementedError

    @staticmethod
    def convert_to_custom(source: RosT, destination: CustomT | None = None) -> CustomT:
        """Convert a ROS message to a protobuf message.

        Args:
            source: The ROS message, or any object with the same fields.
            destination: A protobuf message to overwrite; a new one is made if it is None.

        Returns:
            The destination, or the new protobuf message.

        Raises:
            ConversionError: A value does not fit; the destination is left as it was.
        """
        raise NotImplementedError

    @staticmethod
    def fill_ros_message(source: CustomT, message: RosT) -> None:
        """Fill a newly made ROS message; it is left half filled on an error."""
        raise NotImplementedError

    @staticmethod
    def fill_custom(source: RosT, message: CustomT) -> None:
        """Fill an empty protobuf message; it is left half filled on an error."""
        raise NotImplementedError

    @classmethod
    def to_cdr(cls, source: CustomT) -> bytes:
        """Return a protobuf message as ROS sends it: little-endian CDR with its encapsulation header.

        No ROS message is made on the way, and ROS need not be installed.

        Raises:
            ConversionError: A value does not fit; it is a `TranscodeError`, which has the place in the bytes as well.
        """
        return cls.codec.to_cdr(source)

    @classmethod
    def from_cdr(cls, data: Buffer) -> CustomT:
        """Return the protobuf message of a serialized ROS message: plain CDR of either byte order.

        Raises:
            ConversionError: The bytes are not a valid message of the type; it is a `TranscodeError`.
        """
        message: CustomT = cls.codec.from_cdr(data)
        return message

    @classmethod
    def new(cls, /, **fields: Any) -> CustomT:
        """Make a protobuf message with the default values of the ROS definition, which proto3 cannot carry.

        Args:
            fields: Values of fields, as the protobuf class takes them; they come before default values.
        """
        message = cls.custom_type(**{**cls.defaults, **fields})
        for info in cls.fields:
            nested = info.nested
            if nested is None or not nested.has_defaults or info.name in fields:
                continue
            if info.type_id == _NESTED:
                getattr(message, info.name).CopyFrom(nested.new())
            elif info.type_id == _NESTED_ARRAY:
                getattr(message, info.name).extend(nested.new() for _ in range(info.capacity))
        return message

    @classmethod
    def type_description(cls) -> TypeDescription:
        """Return the type description (REP-2011), in the form of the `.json` files of ROS, without default values."""
        found: dict[str, type[TypeAdapter[Any, Any]]] = {}
        waiting: list[type[TypeAdapter[Any, Any]]] = [cls]
        while waiting:
            for info in waiting.pop().fields:
                if info.nested is not None and info.nested.type_name not in found:
                    found[info.nested.type_name] = info.nested
                    waiting.append(info.nested)
        return {
            "type_description": _individual_description(cls),
            "referenced_type_descriptions": [_individual_description(found[name]) for name in sorted(found)],
        }


# type_description_interfaces/msg/FieldType
_NESTED, _NESTED_ARRAY = 1, 49


def _individual_description(adapter: type[TypeAdapter[Any, Any]]) -> IndividualTypeDescription:
    return {
        "type_name": adapter.type_name,
        "fields": [
            {
                "name": info.name,
                "type": {
                    "type_id": info.type_id,
                    "capacity": info.capacity,
                    "string_capacity": info.string_capacity,
                    "nested_type_name": info.nested.type_name if info.nested else "",
                },
                "default_value": "",
            }
            for info in adapter.fields
        ],
    }


class ServiceAdapter(Generic[RequestT, ResponseT]):
    """The adapters of a service.

    Attributes:
        request: Adapter of the request.
        response: Adapter of the response.
        type_name: The ROS name of the service, such as `std_srvs/srv/SetBool`.
        type_hash: The RIHS01 hash of the service.
        ros_service_type: The ROS service class, imported when it is first asked for.
        ros_class: Where the ROS service class is: `module:Class`.
    """

    request: type[TypeAdapter[RequestT, Any]]
    response: type[TypeAdapter[ResponseT, Any]]
    type_name: ClassVar[str]
    type_hash: ClassVar[str]
    ros_service_type: Any = _RosClass("ros_service_type")
    ros_class: ClassVar[str]


class ActionAdapter(Generic[GoalT, ResultT, FeedbackT]):
    """The adapters of an action.

    Attributes:
        goal: Adapter of the goal.
        result: Adapter of the result.
        feedback: Adapter of the feedback.
        send_goal: Adapters of the service that sends a goal.
        get_result: Adapters of the service that waits for a result.
        feedback_message: Adapter of what travels on the feedback topic.
        type_name: The ROS name of the action, such as `example_interfaces/action/Fibonacci`.
        type_hash: The RIHS01 hash of the action.
        ros_action_type: The ROS action class, imported when it is first asked for.
        ros_class: Where the ROS action class is: `module:Class`.
    """

    goal: type[TypeAdapter[GoalT, Any]]
    result: type[TypeAdapter[ResultT, Any]]
    feedback: type[TypeAdapter[FeedbackT, Any]]
    send_goal: type[ServiceAdapter[Any, Any]]
    get_result: type[ServiceAdapter[Any, Any]]
    feedback_message: type[TypeAdapter[Any, Any]]
    type_name: ClassVar[str]
    type_hash: ClassVar[str]
    ros_action_type: Any = _RosClass("ros_action_type")
    ros_class: ClassVar[str]


# --- What generated conversions call ---


def conversion_error(type_name: str, field: str, error: Exception) -> ConversionError:
    """Return the error for a field of a type, where `error` was raised while that field was converted."""
    if not isinstance(error, ConversionError):
        return ConversionError(type_name, field, str(error))
    inner = error.field_path
    separator = "." if field and inner and not inner.startswith("[") else ""
    return ConversionError(type_name, f"{field}{separator}{inner}", error.reason)


def check_custom(source: object, adapter: type[TypeAdapter[Any, Any]]) -> None:
    """Refuse to read anything but a message of the adapter's protobuf class."""
    if not isinstance(source, adapter.custom_type):
        raise wrong_message(adapter.type_name, adapter.custom_type.DESCRIPTOR.full_name, source)


def finish_custom(message: CustomT, destination: CustomT | None) -> CustomT:
    """Return a converted message, or overwrite the destination with it."""
    if destination is None:
        return message
    destination.CopyFrom(message)
    return destination


def finish_ros_message(message: Any, destination: Any, adapter: type[TypeAdapter[Any, Any]]) -> Any:
    """Return a converted ROS message, or overwrite the fields of the destination with its fields."""
    if destination is None:
        return message
    if not isinstance(destination, adapter.ros_message_type):
        raise ConversionError(
            adapter.type_name,
            "",
            f"expected a ROS message as destination, not {type(destination).__qualname__}",
        )
    for info in adapter.fields:
        if hasattr(message, info.name):  # an empty message has no fields in Python
            setattr(destination, info.name, getattr(message, info.name))
    return destination


def in_range(value: int, lowest: int, highest: int) -> int:
    """Return an integer that is not outside the range."""
    if lowest <= value <= highest:
        return value
    raise ValueError(f"{value} is not in the range from {lowest} to {highest}")


def float32(value: float) -> float:
    """Return a number that a float32 can hold."""
    if -LARGEST_FLOAT32 < value < LARGEST_FLOAT32 or not isfinite(value):
        return value
    raise ValueError(f"{value} is too large for a float32")


def at_most(values: SizedT, bound: int, what: str = "element") -> SizedT:
    """Return values that are not more than the bound."""
    if len(values) > bound:
        raise ValueError(f"{_count(len(values), what)}, more than the bound of {bound}")
    return values


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"


def exactly(values: SizedT, size: int) -> SizedT:
    """Return values that are as many as the array is long."""
    if len(values) != size:
        raise ValueError(f"{_count(len(values), 'element')}, but the array has {size}")
    return values


def absent_or_exactly(values: SizedT, size: int) -> SizedT:
    """Return the values of an array in protobuf: none, which stands for zeros, or all."""
    if len(values) not in (0, size):
        raise ValueError(f"{_count(len(values), 'element')}, but the array has {size} (or none, for zeros)")
    return values


def text(value: str, bound: int) -> str:
    """Return a string of at most `bound` characters."""
    return at_most(value, bound, "character")


def each(convert: Callable[[Any], Any], values: Iterable[Any]) -> list[Any]:
    """Convert each element; an error names its index."""
    converted: list[Any] = []
    try:
        for value in values:
            converted.append(convert(value))
    except CONVERSION_ERRORS as error:
        raise conversion_error("", f"[{len(converted)}]", error) from None
    return converted


def sequence(values: Iterable[Any]) -> Iterable[Any]:
    """Return the values of a sequence; a single string, or what has no order, is none."""
    if isinstance(values, _NO_SEQUENCES):
        raise TypeError(f"expected a sequence, not {type(values).__name__}")
    return values


_NO_SEQUENCES = (str, bytes, bytearray, memoryview, set, frozenset, Mapping)


def ros_string(value: str) -> str:
    """Return a string that ROS can hold: NUL ends a string there."""
    if "\0" in value:
        raise ValueError(f"a string of ROS cannot hold NUL, as at character {value.index(chr(0))}")
    return value


def string(value: object) -> str:
    """Return a string; anything else is an error."""
    if isinstance(value, str):
        return value
    raise TypeError(f"expected str, not {type(value).__name__}")


def boolean(value: Any) -> bool:
    """Return a bool; anything else, other than 0 and 1, is an error."""
    if value is True or value is False or value in (0, 1):  # the latter for numpy.bool_
        return bool(value)
    raise TypeError(f"expected bool, not {value!r}")


def octet(value: bytes | int) -> int:
    """Return the number of a ROS octet, which is a single byte in Python; some libraries have a number already."""
    return ord(value) if isinstance(value, bytes) else in_range(value, 0, 0xFF)


def ros_octet(value: int) -> bytes:
    """Return the single byte that is a ROS octet in Python."""
    return bytes((in_range(value, 0, 0xFF),))


def octets(values: Sequence[bytes | int]) -> bytes:
    """Return ROS octets, each a single byte in Python, as one bytes object."""
    if isinstance(values, (bytes, bytearray, memoryview)):
        return bytes(values)
    return bytes(each(octet, values))


def ros_octets(values: bytes) -> list[bytes]:
    """Return the bytes one by one, as ROS has octets in Python."""
    return [values[index : index + 1] for index in range(len(values))]


def character(value: str, largest: int) -> int:
    """Return the code of a character that is not above `largest`."""
    return in_range(ord(value), 0, largest)


def ros_character(value: int, largest: int) -> str:
    """Return the character of a code that is not above `largest`."""
    return chr(in_range(value, 0, largest))


def characters(values: Iterable[str], largest: int) -> str:
    """Return characters as one string."""
    return "".join(chr(code) for code in each(lambda value: character(value, largest), values))


def ros_characters(values: str, largest: int) -> list[str]:
    """Return the characters of a string one by one."""
    return each(lambda value: chr(character(value, largest)), values)


def wide(value: str) -> bytes:
    """Return a wide string as its UTF-16 code units, little-endian."""
    return string(value).encode("utf-16-le")


def ros_wide(value: bytes) -> str:
    """Return the wide string of UTF-16 code units."""
    return value.decode("utf-16-le")


# The ROS array type of each numeric type: what array.array and numpy call it.
_NUMPY_TYPES = {
    "b": "|i1",
    "B": "|u1",
    "h": "<i2",
    "H": "<u2",
    "i": "<i4",
    "I": "<u4",
    "q": "<i8",
    "Q": "<u8",
    "f": "<f4",
    "d": "<f8",
}


_BYTES = (bytes, bytearray, memoryview)


def numbers(values: Any, typecode: str) -> Any:
    """Return numbers as an array (`array.array` or numpy) of the C type that `typecode` names in `array`."""
    if type(values) is array and values.typecode == typecode:
        return values
    dtype = getattr(values, "dtype", None)
    if dtype is not None and dtype.str == _NUMPY_TYPES[typecode] and values.ndim == 1:
        return values
    if isinstance(values, _NO_SEQUENCES) and not (typecode in "bB" and isinstance(values, _BYTES)):
        raise TypeError(f"expected a sequence of numbers, not {type(values).__name__}")
    if dtype is not None and dtype.kind == "c":
        raise TypeError("expected real numbers, not complex ones")
    if typecode == "f":
        return array("f", each(float32, values))
    try:
        return array(typecode, values)
    except OverflowError:
        _raise_first_that_does_not_fit(values, typecode)


def _raise_first_that_does_not_fit(values: Iterable[int], typecode: str) -> NoReturn:
    bits = 8 * array(typecode).itemsize
    lowest, highest = (-(1 << bits - 1), (1 << bits - 1) - 1) if typecode.islower() else (0, (1 << bits) - 1)
    each(lambda value: in_range(value, lowest, highest), values)
    raise OverflowError(f"a value is not in the range from {lowest} to {highest}")


def packed(field_number: int, values: Any) -> bytes:
    """Return a packed repeated field of fixed-width numbers as it is on the wire (protobuf encoding, "Packed")."""
    data: bytes = values.tobytes()
    return _packed_prefix(field_number, len(data)) + data if data else b""


@lru_cache(maxsize=4096)  # most arrays have the same length again and again
def _packed_prefix(field_number: int, length: int) -> bytes:
    return _varint(field_number << 3 | 2) + _varint(length)


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def packed_fields(message: Message, *field_numbers: int) -> tuple[bytes, ...]:
    """Return the little-endian bytes of packed fixed-width number fields of a message.

    Serializing the whole message and finding them in it takes less time than asking protobuf for a single one.
    """
    message_class: Any = type(message)
    return _native_packed_fields(message_class)(message, *field_numbers)


@cache
def _native_packed_fields(message_class: Any) -> Callable[..., tuple[bytes, ...]]:
    native = importlib.import_module("rosidl_adapter_proto.transcode._core")
    return partial(native.packed_fields, message_class.SerializeToString)


def array_of(data: bytes, typecode: str) -> Any:
    """Return little-endian bytes as a numpy array of the C type of `typecode`."""
    return _numpy().frombuffer(data, _NUMPY_TYPES[typecode])


def elements(field: Any, typecode: str) -> Any:
    """Return a repeated number field as an array (`array.array` or numpy) of the C type of `typecode`."""
    # Newer protobuf runtimes give numpy the whole array at once; for others array.array is faster than numpy.
    if hasattr(field, "__array__") and typecode not in "hH":
        return _numpy().asarray(field, dtype=_NUMPY_TYPES[typecode])
    return numbers(field, typecode)


@cache
def _numpy() -> Any:
    return importlib.import_module("numpy")


def fill_array(destination: Any, values: Any) -> None:
    """Overwrite a numpy array of a ROS message with the elements of a field; with zeros if it has none."""
    if len(values) == 0:
        destination.fill(0)
    else:
        destination[:] = (
            values if len(values) == len(destination) else absent_or_exactly(values, len(destination))
        )


def fill_each(fill: Callable[[Any, Any], None], values: Iterable[Any], field: Any) -> None:
    """Append a message to a repeated field for each ROS message."""
    try:
        for value in values:
            fill(value, field.add())
    except CONVERSION_ERRORS as error:
        raise conversion_error("", f"[{len(field) - 1}]", error) from None


def ros_messages(adapter: type[TypeAdapter[Any, RosT]], values: Sequence[Any]) -> list[RosT]:
    """Return a new ROS message for each message of a repeated field."""
    make, fill = adapter.ros_message_type, adapter.fill_ros_message

    def convert(value: Any) -> RosT:
        message: RosT = make()
        fill(value, message)
        return message

    return each(convert, values)


def ros_message_array(adapter: type[TypeAdapter[Any, RosT]], values: Sequence[Any], size: int) -> list[RosT]:
    """Return the ROS messages of an array; of zeros, if the field is absent."""
    if len(values) == 0:
        values = [adapter.custom_type()] * size
    return ros_messages(adapter, absent_or_exactly(values, size))


# --- What generated modules call when they are imported ---

_registered: dict[str, str] = {}


def add_descriptor_file(name: str, serialized: bytes, module_file: str) -> FileDescriptor:
    """Add a `.proto` file's descriptor to the default pool of this process.

    Args:
        name: The path of the `.proto` file, as imports name it.
        serialized: Its FileDescriptorProto.
        module_file: The module that brings it.

    Raises:
        ImportError: Another file of the same name is in the pool already.
    """
    pool = descriptor_pool.Default()  # type: ignore[no-untyped-call, unused-ignore]
    try:
        descriptor: FileDescriptor = pool.AddSerializedFile(serialized)
    except TypeError as error:
        raise _different_file(name, module_file, str(error)) from None
    # The pure-Python runtime keeps what was there first without a word.
    if descriptor is None:
        descriptor = pool.FindFileByName(name)
    if descriptor.serialized_pb != serialized:
        raise _different_file(name, module_file, "the contents differ")
    _registered.setdefault(name, module_file)
    return descriptor


def _different_file(name: str, module_file: str, detail: str) -> ImportError:
    other = _registered.get(name) or _module_of(name) or "another module"
    return ImportError(
        f"{module_file} and {other} bring different versions of {name} into one process ({detail}); "
        "generate both from the same definitions, with the same options"
    )


def _module_of(proto_name: str) -> str | None:
    for module in list(sys.modules.values()):
        descriptor = getattr(module, "__dict__", {}).get("DESCRIPTOR")
        if getattr(descriptor, "name", None) == proto_name:
            return getattr(module, "__file__", None) or module.__name__
    return None


def lazy_exports(
    package: str, modules: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package that imports its modules when a name is first asked for.

    Args:
        package: The name of the package.
        modules: The module, relative to the package, of each exported name.
    """

    def load(name: str) -> Any:
        module = modules.get(name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(importlib.import_module(f"{package}.{module}"), name)
        setattr(sys.modules[package], name, value)
        return value

    return load, lambda: sorted({*vars(sys.modules[package]), *modules})
