from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.closure import closure
from rosidl_adapter_proto.interfaces.find import prefix_sources, store_source
from rosidl_adapter_proto.interfaces.model import (
    Action,
    ArrayType,
    BasicType,
    Constant,
    Field,
    FieldType,
    Interface,
    Message,
    SequenceType,
    Service,
    Shape,
    StringType,
    TypeName,
    Value,
)
from rosidl_adapter_proto.interfaces.msg import parse_action, parse_msg, parse_srv
from rosidl_adapter_proto.interfaces.scalars import SCALARS, Scalar
from rosidl_adapter_proto.schema.numbering import (
    HashNumbering,
    Numbering,
    SequentialNumbering,
    compute_proto_field_number,
)
from rosidl_adapter_proto.schema.proto import (
    ProtoField,
    ProtoFile,
    ProtoRpc,
    ProtoService,
    check_names,
    facts,
    proto_file,
)

FOO, DO, GO = (TypeName.parse(each) for each in ("pkg/msg/Foo", "pkg/srv/Do", "pkg/action/Go"))
PARSERS: dict[str, Callable[[str, TypeName, str], Interface]] = {
    "msg": parse_msg,
    "srv": parse_srv,
    "action": parse_action,
}


def mapped(
    text: str, name: TypeName = FOO, *, numbering: Numbering | None = None, events: bool = False
) -> ProtoFile:
    interface = PARSERS[name.namespace](text, name, f"{name.name}.{name.namespace}")

    def owner(needed: TypeName) -> TypeName:
        return name if needed.package == name.package and needed.name.startswith(f"{name.name}_") else needed

    return proto_file(interface, numbering or HashNumbering(), owner, events=events)


def fields_of(file: ProtoFile) -> dict[str, list[str]]:
    return {message.name: [_line(each) for each in message.fields] for message in file.messages}


def _line(field: ProtoField) -> str:
    return f"{'repeated ' * field.repeated}{field.type} {field.name}"


# Compared with the reference

REFERENCE: dict[str, dict[str, Any]] = json.loads(
    (Path(__file__).parents[1] / "data" / "reference_protos.json").read_text("utf-8")
)


def reference_facts(file: ProtoFile) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield what a file has in the form of the reference's data: facts by full name."""
    for message in file.messages:
        fields = {
            each.name: [each.number, "repeated " * each.repeated + each.type] for each in message.fields
        }
        yield f"{file.package}.{message.name}", {"fields": fields, "file": file.path}
    if file.service:
        rpcs = {each.name: [each.request, each.response] for each in file.service.rpcs}
        yield f"{file.package}.{file.service.name}", {"file": file.path, "rpcs": rpcs}


def mapped_facts(catalog: Catalog) -> dict[str, dict[str, Any]]:
    packages = {each.partition(".")[0] for each in REFERENCE} & set(catalog.packages)
    return {
        name: found
        for each in closure(catalog, sorted(packages))
        for name, found in reference_facts(
            proto_file(catalog.definition(each).interface, HashNumbering(), catalog.definition_name)
        )
    }


def test_the_reference_is_met(ros_prefix: Path) -> None:
    found = mapped_facts(Catalog(tuple(prefix_sources())))
    assert REFERENCE.keys() <= found.keys()
    assert {name: found[name] for name in REFERENCE} == REFERENCE


def test_the_reference_is_met_by_the_store() -> None:
    found = mapped_facts(Catalog((store_source("kilted"),)))
    common = REFERENCE.keys() & found.keys()
    assert len(common) > 30
    assert {name: found[name] for name in common} == {name: REFERENCE[name] for name in common}


# Files


def test_a_message() -> None:
    file = mapped("# A foo.\n\n# Its header.\nstd_msgs/Header header\nuint8[] data # [m]\nFoo[<=3] more\n")
    assert (file.path, file.package, file.numbering) == ("pkg/msg/Foo.proto", "pkg.msg.pb", "hash")
    assert file.imports == ("std_msgs/msg/Header.proto",)
    assert file.service is None
    assert file.source.name == FOO
    (message,) = file.messages
    assert (message.name, message.comment, message.source) == ("Foo", ("A foo.",), file.source)
    assert (message.reserved_numbers, message.reserved_names, message.has_json_conflict) == ((), (), False)
    assert isinstance(file.source, Message)
    assert proto_file(file.source, HashNumbering(), lambda name: name) == file
    assert (message.full_name, message.type_name, message.constants) == ("pkg.msg.pb.Foo", FOO, ())
    assert tuple(each.source for each in message.fields) == file.source.fields
    number = compute_proto_field_number
    assert [(each.name, each.repeated, each.type, each.number, each.comment) for each in message.fields] == [
        ("header", False, ".std_msgs.msg.pb.Header", number("header"), ("Its header.",)),
        ("data", False, "bytes", number("data"), ("Unit: m", "Values from 0 to 255.")),
        ("more", True, ".pkg.msg.pb.Foo", number("more"), ("At most 3 elements.",)),
    ]


INT8, UINT8, CHAR, WCHAR = (SCALARS[each] for each in ("int8", "uint8", "char", "wchar"))
BOUNDED = StringType(bound=5)


@pytest.mark.parametrize(
    ("field_type", "parts", "limits", "type_id"),
    [
        # shape, element, capacity, string bound
        (BasicType("int8"), (Shape.SINGLE, INT8, None, None), (-128, 127), 2),
        (ArrayType(BasicType("int8"), 3), (Shape.ARRAY, INT8, 3, None), (-128, 127), 50),
        (SequenceType(BasicType("uint8")), (Shape.SEQUENCE, UINT8, None, None), (0, 255), 147),
        (SequenceType(BasicType("uint8"), 3), (Shape.SEQUENCE, UINT8, 3, None), (0, 255), 99),
        (BasicType("char"), (Shape.SINGLE, CHAR, None, None), (0, 127), 13),
        (BasicType("wchar"), (Shape.SINGLE, WCHAR, None, None), (0, 65535), 14),
        (BasicType("uint32"), (Shape.SINGLE, SCALARS["uint32"], None, None), None, 7),
        (BasicType("int64"), (Shape.SINGLE, SCALARS["int64"], None, None), None, 8),
        (BasicType("float"), (Shape.SINGLE, SCALARS["float"], None, None), None, 10),
        (BasicType("boolean"), (Shape.SINGLE, SCALARS["boolean"], None, None), None, 15),
        (BOUNDED, (Shape.SINGLE, SCALARS["string"], None, 5), None, 21),
        (ArrayType(BOUNDED, 2), (Shape.ARRAY, SCALARS["string"], 2, 5), None, 69),
        (StringType(True), (Shape.SINGLE, SCALARS["wstring"], None, None), None, 18),
        (DO, (Shape.SINGLE, DO, None, None), None, 1),
        (SequenceType(DO, 9), (Shape.SEQUENCE, DO, 9, None), None, 97),
    ],
)
def test_what_is_known_of_a_field(
    field_type: FieldType,
    parts: tuple[Shape, Scalar | TypeName, int | None, int | None],
    limits: tuple[int, int] | None,
    type_id: int,
) -> None:
    field = only_field(Field("some_name", field_type))
    assert (field.shape, field.element, field.capacity, field.string_bound) == parts
    assert (field.limits, field.type_id, field.json_name) == (limits, type_id, "someName")


def only_field(field: Field) -> ProtoField:
    (message,) = proto_file(Message(FOO, (field,)), HashNumbering(), lambda name: name).messages
    (found,) = message.fields
    return found


@pytest.mark.parametrize(
    ("field_type", "default", "expected"),
    [
        (BasicType("int32"), 5, 5),
        (BasicType("octet"), 5, 5),
        (BasicType("char"), 97, 97),
        (BasicType("double"), 0.5, 0.5),
        (BasicType("boolean"), False, False),
        (StringType(), "ä", "ä"),
        (StringType(wide=True), "ä\N{GRINNING FACE}", b"\xe4\0\x3d\xd8\x00\xde"),
        (SequenceType(BasicType("int32")), (1, 2), (1, 2)),
        (SequenceType(BasicType("int32")), (), ()),
        (ArrayType(BasicType("boolean"), 2), (True, False), (True, False)),
        (SequenceType(StringType()), ("a", "b"), ("a", "b")),
        (SequenceType(StringType(wide=True)), ("a", ""), (b"a\0", b"")),
        (ArrayType(BasicType("int8"), 2), (-1, 1), b"\xff\1"),
        (SequenceType(BasicType("uint8")), (255, 1), b"\xff\1"),
        (SequenceType(BasicType("octet")), (), b""),
        (ArrayType(BasicType("char"), 2), (97, 98), "ab"),
        (SequenceType(BasicType("wchar")), (228,), "ä"),
        (BasicType("int32"), None, None),
    ],
)
def test_default_values_are_those_of_protobuf(
    field_type: FieldType, default: Value | None, expected: object
) -> None:
    found = only_field(Field("a", field_type, default)).default
    assert (type(found), found) == (type(expected), expected)


def test_an_empty_message() -> None:
    assert fields_of(mapped("")) == {"Foo": ["uint32 structure_needs_at_least_one_member"]}


def test_a_service() -> None:
    file = mapped("bool data\nother/Bar bar\n---\nstring message\n", DO)
    assert (file.path, file.package) == ("pkg/srv/Do.proto", "pkg.srv.pb")
    assert file.imports == ("other/msg/Bar.proto",)
    assert fields_of(file) == {
        "Do_Request": ["bool data", ".other.msg.pb.Bar bar"],
        "Do_Response": ["string message"],
    }
    assert file.service == ProtoService(
        "Do", (ProtoRpc("Call", ".pkg.srv.pb.Do_Request", ".pkg.srv.pb.Do_Response"),)
    )


def test_events_are_left_out_unless_asked_for() -> None:
    service = parse_srv("---", DO, "Do.srv")
    assert "Do_Event" not in fields_of(proto_file(service, HashNumbering(), lambda name: name))


def test_a_service_with_its_event() -> None:
    file = mapped("---", DO, events=True)
    assert file.imports == ("service_msgs/msg/ServiceEventInfo.proto",)
    assert fields_of(file)["Do_Event"] == [
        ".service_msgs.msg.pb.ServiceEventInfo info",
        "repeated .pkg.srv.pb.Do_Request request",
        "repeated .pkg.srv.pb.Do_Response response",
    ]


def test_an_action() -> None:
    file = mapped("int32 order\n---\nint32[] sequence\n---\nint32[] partial\n", GO)
    assert file.path == "pkg/action/Go.proto"
    assert file.imports == ("builtin_interfaces/msg/Time.proto", "unique_identifier_msgs/msg/UUID.proto")
    goal_id = ".unique_identifier_msgs.msg.pb.UUID goal_id"
    assert fields_of(file) == {
        "Go_Goal": ["sfixed32 order"],
        "Go_Result": ["repeated sfixed32 sequence"],
        "Go_Feedback": ["repeated sfixed32 partial"],
        "Go_SendGoal_Request": [goal_id, ".pkg.action.pb.Go_Goal goal"],
        "Go_SendGoal_Response": ["bool accepted", ".builtin_interfaces.msg.pb.Time stamp"],
        "Go_GetResult_Request": [goal_id],
        "Go_GetResult_Response": ["int32 status", ".pkg.action.pb.Go_Result result"],
        "Go_FeedbackMessage": [goal_id, ".pkg.action.pb.Go_Feedback feedback"],
    }
    request, response = ".pkg.action.pb.Go_{}_Request", ".pkg.action.pb.Go_{}_Response"
    assert file.service == ProtoService(
        "Go",
        tuple(
            ProtoRpc(each, request.format(each), response.format(each)) for each in ("SendGoal", "GetResult")
        ),
    )


def test_imports_are_sorted_and_have_no_repetitions() -> None:
    assert mapped("b/B b\na/A a\nb/B c\nBar d\nFoo e").imports == (
        "a/msg/A.proto",
        "b/msg/B.proto",
        "pkg/msg/Bar.proto",
    )


def test_a_part_of_another_interface_is_imported_with_it() -> None:
    message = Message(FOO, (Field("x", TypeName("pkg", "srv", "Do_Request")),))
    file = proto_file(message, HashNumbering(), lambda name: DO)
    assert file.imports == ("pkg/srv/Do.proto",)
    assert fields_of(file) == {"Foo": [".pkg.srv.pb.Do_Request x"]}


def test_removed_fields_are_reserved() -> None:
    numbering = SequentialNumbering.from_lock("lock", None)
    mapped("int8 b\nint8 a\nint8 c\nint8 d", numbering=numbering)
    file = mapped("int8 c", numbering=numbering)
    assert file.numbering == "sequential"
    (message,) = file.messages
    assert [each.number for each in message.fields] == [3]
    assert (message.reserved_numbers, message.reserved_names) == ((1, 2, 4), ("a", "b", "d"))


# Names


@pytest.mark.parametrize(
    ("names", "conflict"),
    [
        (("x_1", "x1"), True),
        (("a_b", "a__b"), True),
        (("foo_bar", "fooBar"), True),
        (("_a", "A"), True),
        (("x_1", "x_2"), False),
        (("foo_bar", "foobar"), False),
        (("a",), False),
    ],
)
def test_conflicts_of_json_names(names: tuple[str, ...], conflict: bool) -> None:
    message = Message(FOO, tuple(Field(each, BasicType("int8")) for each in names))
    (found,) = proto_file(message, HashNumbering(), lambda name: name).messages
    assert found.has_json_conflict == conflict


@pytest.mark.parametrize(
    ("package", "name", "field", "bad"),
    [
        ("pkg", "Foo", "1a", "1a"),
        ("pkg", "Foo", "a-b", "a-b"),
        ("pkg", "Foo", "grün", "grün"),
        ("pkg", "Foo", "", ""),
        ("pkg", "1Foo", "a", "1Foo"),
        ("my.pkg", "Foo", "a", "my.pkg"),
        ("my-pkg", "Foo", "a", "my-pkg"),
    ],
)
def test_names_that_protobuf_cannot_take(package: str, name: str, field: str, bad: str) -> None:
    message = Message(TypeName(package, "msg", name), (Field(field, BasicType("int8")),))
    with pytest.raises(SchemaError) as caught:
        proto_file(message, HashNumbering(), lambda name: name)
    assert str(caught.value) == (
        f"{package}/msg/{name}: protobuf cannot take the name {bad!r}; "
        "use letters, digits and underscores, beginning with a letter"
    )


LARGEST = 2**32 - 1


@pytest.mark.parametrize(
    ("type", "number", "what"),
    [
        ("int8[{}]", LARGEST + 1, "the length of an array"),
        ("int8[<={}]", 2**40, "the bound of a sequence"),
        ("string<={}", 2**64, "the bound of a string"),
        ("wstring<={}[2]", 2**32, "the bound of a string"),
    ],
)
def test_what_cdr_cannot_count(type: str, number: int, what: str) -> None:
    with pytest.raises(SchemaError) as caught:
        mapped(f"int8 a\n{type.format(number)} x")
    assert str(caught.value) == (
        f"pkg/msg/Foo.x (Foo.msg:2:{len(type.format(number)) + 2}): {what} must be at most 4294967295, since ROS "
        f"sends no more, not {number}"
    )
    (message,) = mapped(f"{type.format(LARGEST)} x").messages
    assert [each.name for each in message.fields] == ["x"]


def test_control_characters_in_comments() -> None:
    (message,) = mapped("int8 x # a\0b\x1b[1m] \x7f\tc\n  # \x01").messages
    assert message.fields[0].comment[:2] == ("a␀b␛ ␡ c", "␁")


def test_keywords_are_names() -> None:
    assert fields_of(mapped("int8 message\nint8 from\nint8 class")) == {
        "Foo": ["int32 message", "int32 from", "int32 class"]
    }


def test_two_files_that_define_the_same_name() -> None:
    # An .idl file in the folder srv may define a message.
    message = Message(DO.sibling("_Request"), (Field("a", BasicType("int8")),))
    files = [mapped("---", DO), proto_file(message, HashNumbering(), lambda name: name)]
    with pytest.raises(SchemaError) as caught:
        check_names(files)
    assert str(caught.value) == (
        "pkg.srv.pb.Do_Request is defined by both pkg/srv/Do.proto and pkg/srv/Do_Request.proto; "
        "rename one of the interfaces"
    )


def test_files_whose_names_differ() -> None:
    check_names(
        [mapped(""), mapped("---", DO), mapped("---\n---", GO), mapped("", TypeName("pkg", "msg", "Do"))]
    )
    check_names([mapped(""), mapped("")])


def test_names_of_everything_that_is_installed(ros_prefix: Path) -> None:
    catalog = Catalog(tuple(prefix_sources()))
    files = [
        proto_file(catalog.definition(each).interface, HashNumbering(), catalog.definition_name, events=True)
        for each in closure(catalog, catalog.packages, events=True)
    ]
    check_names(files)
    paths = [each.path for each in files]
    for index, file in enumerate(files):
        assert set(file.imports) <= set(paths[:index])


# Comments


@pytest.mark.parametrize(
    ("field_type", "default", "unit", "expected"),
    [
        (BasicType("int32"), None, None, []),
        (BasicType("int32"), None, "m/s", ["Unit: m/s"]),
        (BasicType("int8"), None, None, ["Values from -128 to 127."]),
        (BasicType("uint8"), None, None, ["Values from 0 to 255."]),
        (BasicType("octet"), None, None, ["Values from 0 to 255."]),
        (BasicType("int16"), None, None, ["Values from -32768 to 32767."]),
        (BasicType("uint16"), None, None, ["Values from 0 to 65535."]),
        (StringType(), None, None, []),
        (StringType(bound=5), None, None, ["At most 5 characters."]),
        (ArrayType(BasicType("double"), 9), None, None, ["Exactly 9 elements."]),
        (SequenceType(BasicType("double"), 9), None, None, ["At most 9 elements."]),
        (SequenceType(BasicType("double")), None, None, []),
        (
            SequenceType(StringType(bound=5), 9),
            ("a", 'b"'),
            None,
            ["At most 5 characters.", "At most 9 elements.", 'Default in ROS: ["a", "b\\""]'],
        ),
        (BasicType("int32"), 5, "m", ["Unit: m", "Default in ROS: 5"]),
        (BasicType("boolean"), True, None, ["Default in ROS: true"]),
        (BasicType("double"), 0.1, None, ["Default in ROS: 0.1"]),
        (BasicType("double"), math.nan, None, ["Default in ROS: NaN"]),
        (BasicType("double"), -math.inf, None, ["Default in ROS: -Infinity"]),
        (StringType(), "grün\n", None, ['Default in ROS: "grün\\n"']),
        (StringType(), "", None, ['Default in ROS: ""']),
    ],
)
def test_facts(field_type: FieldType, default: Value | None, unit: str | None, expected: list[str]) -> None:
    assert facts(Field("a", field_type, default, unit=unit)) == expected


def test_constants_stand_in_the_comment_of_the_message() -> None:
    text = '# A foo.\n\n# The first.\nint8 A=1 # really [m]\nstring B="x\\\\ny"\nbool C=true\nfloat64 D=-.5\n'
    (message,) = mapped(text).messages
    assert message.comment == (
        "A foo.",
        "",
        "Constants:",
        "  A = 1  (The first. really)",
        '  B = "x\\ny"',
        "  C = true",
        "  D = -0.5",
    )
    (message,) = mapped("int8 A=1").messages
    assert message.comment == ("Constants:", "  A = 1")


def test_comments_cannot_end_a_comment_of_protobuf() -> None:
    field = Field("a", StringType(), "\u2028", comment=("one\ntwo\r\nthree\u2028four", "", "five  ", ""))
    message = Message(FOO, (field,), (Constant("A", StringType(), "\u2029"),), ("", "six\vseven", ""))
    (found,) = proto_file(message, HashNumbering(), lambda name: name).messages
    assert found.fields[0].comment[:6] == ("one", "two", "three", "four", "", "five")
    assert found.comment[:2] == ("six", "seven")
    for line in (*found.comment, *found.fields[0].comment):
        assert len(line.splitlines()) <= 1


def test_the_same_definition_gives_the_same_file() -> None:
    for name, text in {FOO: "int8 a\nb/B b", DO: "---", GO: "---\n---"}.items():
        assert mapped(text, name) == mapped(text, name)


def test_every_kind_of_interface_keeps_its_source() -> None:
    kinds = {FOO: ("", Message), DO: ("---", Service), GO: ("---\n---", Action)}
    for name, (text, kind) in kinds.items():
        assert isinstance(mapped(text, name).source, kind)
