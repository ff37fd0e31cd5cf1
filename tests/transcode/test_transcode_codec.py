"""Codecs: protobuf messages to CDR and back."""

from __future__ import annotations

import inspect
import pickle
from typing import Any

import pytest
from google.protobuf.message import EncodeError
from google.protobuf.timestamp_pb2 import Timestamp
from google.protobuf.wrappers_pb2 import StringValue
from ros_types import describe, protobuf_class, struct_type

from rosidl_adapter_proto.errors import ConversionError, SchemaError
from rosidl_adapter_proto.transcode import Codec, TranscodeError, Transcoder, _core

TIME = struct_type("test/msg/Time", seconds="int64", nanos="int16")
DESCRIPTION = describe(TIME, "test/msg/Time")
Time: Any = protobuf_class(TIME, "test/msg/Time")
CDR = b"\0\1\0\0\1\0\0\0\0\0\0\0\2\0"


def test_both_ways() -> None:
    codec = Codec(DESCRIPTION, Time)
    assert codec.to_cdr(Time(seconds=1, nanos=2)) == CDR
    assert codec.from_cdr(CDR) == Time(seconds=1, nanos=2)
    assert codec.from_cdr(memoryview(bytearray(CDR))) == Time(seconds=1, nanos=2)
    assert Time.FromString(codec.transcoder.cdr_to_proto(CDR)) == Time(seconds=1, nanos=2)
    assert codec.message_class is Time


def test_errors() -> None:
    codec = Codec(DESCRIPTION, Time)
    with pytest.raises(
        TranscodeError, match=r"^test/msg/Time\.nanos at byte 12: 2 bytes are needed and 0 are left"
    ):
        codec.from_cdr(CDR[:12])
    with pytest.raises(TranscodeError, match=r"^test/msg/Time\.nanos at byte .*: 40000 does not fit int16"):
        codec.to_cdr(Time(nanos=40000))
    with pytest.raises(SchemaError):
        Codec(DESCRIPTION, Timestamp)


@pytest.mark.parametrize("message", [Timestamp(), Time, None, b""])
def test_message_of_another_class(message: Any) -> None:
    found = type(message)
    with pytest.raises(ConversionError) as caught:
        Codec(DESCRIPTION, Time).to_cdr(message)
    assert str(caught.value) == (
        "test/msg/Time: expected a protobuf message test.msg.pb.Time, "
        f"not {found.__module__}.{found.__qualname__}"
    )


class Huge:
    """Like a protobuf message that protobuf does not serialize."""

    DESCRIPTOR = Time.DESCRIPTOR
    FromString = Time.FromString
    error: Exception = EncodeError("Failed to serialize proto")

    def SerializeToString(self) -> bytes:
        raise self.error


def test_message_that_protobuf_does_not_serialize() -> None:
    codec: Codec[Any] = Codec(DESCRIPTION, Huge)
    with pytest.raises(ConversionError) as caught:
        codec.to_cdr(Huge())
    assert str(caught.value) == (
        "test/msg/Time: protobuf does not serialize it (Failed to serialize proto);"
        " a message has 2147483647 bytes at most, split it"
    )
    assert isinstance(caught.value.__cause__, EncodeError)


@pytest.mark.parametrize("error", [MemoryError(), KeyboardInterrupt(), ValueError("other")])
def test_other_errors_stay_what_they_are(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    monkeypatch.setattr(Huge, "error", error)
    codec: Codec[Any] = Codec(DESCRIPTION, Huge)
    with pytest.raises(type(error)) as caught:
        codec.to_cdr(Huge())
    assert caught.value is error


def test_chosen_fields() -> None:
    codec = Codec(DESCRIPTION, Time)
    for fields in (["nanos"], ("nanos",), iter(["nanos"]), {"nanos": 1}):
        assert codec.from_cdr(CDR, fields=fields) == Time(nanos=2)
    assert codec.from_cdr(CDR, ["seconds", "nanos"]) == Time(seconds=1, nanos=2)
    assert codec.from_cdr(CDR, fields=None) == codec.from_cdr(CDR, None) == Time(seconds=1, nanos=2)


@pytest.mark.parametrize("rest", [b"", b"\xff" * 50])
def test_the_rest_is_not_read(rest: bytes) -> None:
    codec = Codec(DESCRIPTION, Time)
    assert codec.from_cdr(CDR[:12] + rest, fields=["seconds"]) == Time(seconds=1)
    with pytest.raises(
        TranscodeError, match=r"^test/msg/Time\.seconds at byte 4: 8 bytes are needed and 7 are left"
    ):
        codec.from_cdr(CDR[:11], fields=["seconds"])


WRONG_FIELDS: dict[str, tuple[Any, type[Exception], str]] = {
    "unknown": (["second"], SchemaError, "test/msg/Time has no field 'second'; did you mean 'seconds'?"),
    "none": (
        [],
        SchemaError,
        "test/msg/Time: no field is chosen; name one, or give no fields for all of them",
    ),
    "one text": ("nanos", TypeError, "fields must be a list of names, such as ['nanos'], not a text"),
    "a number": (5, TypeError, "'int' object is not iterable"),
}


@pytest.mark.parametrize("case", WRONG_FIELDS)
def test_wrong_fields(case: str) -> None:
    fields, kind, text = WRONG_FIELDS[case]
    with pytest.raises(kind) as caught:
        Codec(DESCRIPTION, Time).from_cdr(CDR, fields=fields)
    assert str(caught.value) == text


def test_wrong_arguments() -> None:
    codec: Any = Codec(DESCRIPTION, Time)
    for call in (codec.from_cdr, lambda: codec.from_cdr(CDR, field=["nanos"])):
        with pytest.raises(TypeError, match=r"_from_cdr\(\) (missing 1 required|got an unexpected keyword)"):
            call()


def test_choices_are_remembered_and_forgotten() -> None:
    """Each is prepared once; many different ones do not take more and more memory."""
    codec = Codec(DESCRIPTION, Time)
    for _ in range(3):
        codec.from_cdr(CDR, fields=["nanos"])
    assert codec._of_fields.cache_info()[:2] == (2, 1)
    for count in range(1, 200):
        codec.from_cdr(CDR, fields=["nanos"] * count)
    assert codec._of_fields.cache_info().currsize == 64


def test_signatures_and_documentation() -> None:
    codec = Codec(DESCRIPTION, Time)
    for method, signature in (
        (codec.to_cdr, "(message, /)"),
        (codec.from_cdr, "(data, /, fields=None)"),
        (codec.transcoder.cdr_to_proto, "(data, /)"),
        (codec.transcoder.proto_to_cdr, "(data, /)"),
        (Codec.to_cdr, "(self, message, /)"),
    ):
        assert str(inspect.signature(method)) == signature
        assert method.__doc__ is not None and method.__doc__.startswith("Turn a ")


def test_codec_of_a_type() -> None:
    """`Codec[Time]` is for annotations, as with other generic classes."""
    assert Codec[Time](DESCRIPTION, Time).to_cdr(Time(seconds=1, nanos=2)) == CDR


def test_pickle() -> None:
    """A method can be handed to another process."""
    description = describe(struct_type("test/msg/Text", value="string"), "test/msg/Text")
    to_cdr = pickle.loads(pickle.dumps(Codec(description, StringValue).to_cdr))
    assert to_cdr(StringValue(value="a")) == b"\0\1\0\0\2\0\0\0a\0"


class Unfinished(Transcoder):
    """Does not call `__init__` of its base."""

    def __init__(self) -> None:
        pass


def test_odd_arguments() -> None:
    with pytest.raises(TypeError, match=r"^__init__ of the base class has not been called$"):
        Unfinished().cdr_to_proto(CDR)
    with pytest.raises(TypeError, match="doesn't apply to a 'int' object"):
        Transcoder.cdr_to_proto(5, CDR)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^serialize must return bytes$"):
        _core.packed_fields(lambda message: "text", Time(), 1)  # type: ignore[arg-type,return-value]
    with pytest.raises(TypeError):
        _core.packed_fields(Time.SerializeToString, Time(), "1")  # type: ignore[arg-type]
    with pytest.raises(OverflowError):
        _core.packed_fields(Time.SerializeToString, Time(), -1)
    with pytest.raises(ValueError, match="plan"):
        _core.Transcoder(b"no plan", "test/msg/Time", 100)
    for arguments in ((5, "x", 100), (b"", 5, 100), (b"", "x", "100"), (b"", "x", -1)):
        with pytest.raises(TypeError):
            _core.Transcoder(*arguments)
    with pytest.raises(TypeError):
        _core.Codec(5, Time)  # type: ignore[arg-type]
    with pytest.raises(AttributeError):
        Codec(DESCRIPTION, object)  # type: ignore[type-var]
