from __future__ import annotations

import json
from pathlib import Path

import pytest

from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.description import (
    FieldTypeDescription,
    describe,
    described_type,
    field_type_description,
    structs,
    type_hash,
)
from rosidl_adapter_proto.interfaces.find import prefix_sources
from rosidl_adapter_proto.interfaces.idl import parse_idl
from rosidl_adapter_proto.interfaces.model import (
    Action,
    ArrayType,
    BasicType,
    Field,
    FieldType,
    Message,
    SequenceType,
    Service,
    StringType,
    TypeName,
    type_parts,
)
from rosidl_adapter_proto.interfaces.scalars import SCALARS, Scalar
from tests import oracle

INSTALLED = oracle.installed_definitions(".json")


@pytest.fixture(scope="module")
def ros() -> Catalog:
    return Catalog(tuple(prefix_sources()))


def test_there_are_installed_descriptions(ros_prefix: Path) -> None:
    assert len(INSTALLED) > 190
    assert {path.parts[-2] for path in INSTALLED} == {"msg", "srv", "action"}


@pytest.mark.parametrize("path", INSTALLED, ids=lambda path: str(oracle.type_name(path)))
def test_installed_descriptions_and_hashes(path: Path, ros: Catalog) -> None:
    name = oracle.type_name(path)
    installed = json.loads(path.read_text("utf-8"))
    hashes = {each["type_name"]: each["hash_string"] for each in installed["type_hashes"]}
    assert ros.describe(name) == installed["type_description_msg"]
    # An interface and everything that ROS derives from it, and all that they refer to.
    assert {str(each.name) for each in structs(ros.definition(name).interface)} <= hashes.keys()
    assert {each: ros.hash(TypeName.parse(each)) for each in hashes} == hashes


OTHER = TypeName("pkg", "msg", "Other")


@pytest.mark.parametrize(
    ("field_type", "expected"),
    [
        # type_id, capacity, string_capacity, nested_type_name
        (OTHER, (1, 0, 0, "pkg/msg/Other")),
        *(
            (BasicType(name), (number, 0, 0, ""))
            for number, name in enumerate(
                (
                    *("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"),
                    *("float", "double", "long double", "char", "wchar", "boolean", "octet"),
                ),
                2,
            )
        ),
        (StringType(), (17, 0, 0, "")),
        (StringType(wide=True), (18, 0, 0, "")),
        (StringType(bound=7), (21, 0, 7, "")),
        (StringType(True, 7), (22, 0, 7, "")),
        (ArrayType(OTHER, 3), (49, 3, 0, "pkg/msg/Other")),
        (ArrayType(BasicType("octet"), 3), (64, 3, 0, "")),
        (ArrayType(StringType(bound=7), 3), (69, 3, 7, "")),
        (SequenceType(OTHER, 3), (97, 3, 0, "pkg/msg/Other")),
        (SequenceType(StringType(True, 7), 3), (118, 3, 7, "")),
        (SequenceType(OTHER), (145, 0, 0, "pkg/msg/Other")),
        (SequenceType(StringType(True)), (162, 0, 0, "")),
    ],
)
def test_field_types(field_type: FieldType, expected: tuple[int, int, int, str]) -> None:
    description = field_type_description(field_type)
    assert tuple(description.values()) == expected
    assert described_type(description) == type_parts(field_type)


@pytest.mark.parametrize("scalar", SCALARS.values(), ids=SCALARS)
def test_type_ids_are_those_of_ros(scalar: Scalar) -> None:
    messages = pytest.importorskip("type_description_interfaces.msg", reason="needs the ROS wheels")
    constants = messages.FieldType
    name = {"octet": "BYTE"}.get(scalar.name, scalar.name.upper().replace(" ", "_"))
    assert scalar.type_id == getattr(constants, f"FIELD_TYPE_{name}")
    assert scalar.bounded_type_id == getattr(constants, f"FIELD_TYPE_BOUNDED_{name}", None)


@pytest.mark.parametrize(
    ("type_id", "reason"),
    [
        (0, "type id 0 is unknown (REP-2011); correct the type description"),
        (19, "type id 19 is unknown (REP-2011); correct the type description"),  # a string of fixed length
        (48, "type id 48 is unknown (REP-2011); correct the type description"),
        (193, "type id 193 is unknown (REP-2011); correct the type description"),
        (-47, "type id -47 is unknown (REP-2011); correct the type description"),
        (50, "type id 50 needs a capacity above 0 (REP-2011); correct the type description"),
        (98, "type id 98 needs a capacity above 0 (REP-2011); correct the type description"),
        (21, "type id 21 needs a string capacity above 0 (REP-2011); correct the type description"),
        (1, "'' is not of the form package/namespace/Name"),
    ],
)
def test_descriptions_that_stand_for_nothing(type_id: int, reason: str) -> None:
    description: FieldTypeDescription = {
        "type_id": type_id,
        "capacity": 0,
        "string_capacity": 0,
        "nested_type_name": "",
    }
    with pytest.raises(ValueError) as caught:
        described_type(description)
    assert str(caught.value) == reason


def test_structs() -> None:
    service, action = TypeName("pkg", "srv", "Do"), TypeName("pkg", "action", "Go")
    empty = (Field("structure_needs_at_least_one_member", BasicType("uint8")),)

    def names(found: tuple[Message, ...]) -> list[str]:
        return [str(each.name).rpartition("/")[2] for each in found]

    assert names(structs(Message(OTHER, empty))) == ["Other"]
    parts = [Message(service.sibling(each), empty) for each in ("_Request", "_Response")]
    assert names(structs(Service(service, *parts))) == ["Do", "Do_Request", "Do_Response", "Do_Event"]
    parts = [Message(action.sibling(each), empty) for each in ("_Goal", "_Result", "_Feedback")]
    assert names(structs(Action(action, *parts))) == [
        *("Go", "Go_Goal", "Go_Result", "Go_Feedback"),
        *("Go_SendGoal", "Go_SendGoal_Request", "Go_SendGoal_Response", "Go_SendGoal_Event"),
        *("Go_GetResult", "Go_GetResult_Request", "Go_GetResult_Response", "Go_GetResult_Event"),
        "Go_FeedbackMessage",
    ]


def test_referenced_types_are_described_once_in_order_of_name() -> None:
    a, b, c = (Message(TypeName("pkg", "msg", each), ()) for each in "ABC")
    top = Message(
        OTHER,
        (Field("x", c.name), Field("y", SequenceType(a.name)), Field("z", ArrayType(c.name, 2))),
    )
    a = Message(a.name, (Field("b", b.name),))
    known = {each.name: each for each in (top, a, b, c)}
    description = describe(OTHER, known.__getitem__)
    referenced = [each["type_name"] for each in description["referenced_type_descriptions"]]
    assert referenced == ["pkg/msg/A", "pkg/msg/B", "pkg/msg/C"]


def test_default_values_are_described_but_not_hashed() -> None:
    def described(default: object) -> tuple[str, str]:
        message = Message(OTHER, (Field("x", BasicType("int32"), default),))  # type: ignore[arg-type]
        description = describe(OTHER, {OTHER: message}.__getitem__)
        return description["type_description"]["fields"][0]["default_value"], type_hash(description)

    without, with_default = described(None), described(5)
    assert (without[0], with_default[0]) == ("", "5")
    assert without[1] == with_default[1]
    assert without[1].startswith("RIHS01_")
    assert [described(each)[0] for each in (True, 1.5, "a", (1, 2), ("a",))] == [
        *("True", "1.5", "a", "(1, 2)", "('a',)"),
    ]


# Definitions that OMG IDL has otherwise than ROS 2: the hash is that of ROS 2's own generator

ODD_MEMBERS = [
    "sequence<wstring<5>> a;",
    "sequence<wstring<5>, 7> a;",
    "sequence<string<5>> a;",
    "sequence<wstring<2 + 3>> a;",
    "long a[2+1];",
    "string<(1 + 2) * 3> a;",
    "sequence<long, 0x10 + 2> a;",
]


@pytest.mark.parametrize("member", ODD_MEMBERS)
def test_hashes_of_odd_definitions(member: str, tmp_path: Path) -> None:
    generator = pytest.importorskip("rosidl_generator_type_description", reason="needs the ROS wheels")
    text = f"module pkg {{ module msg {{ struct Foo {{ {member} }}; }}; }};"
    (tmp_path / "msg").mkdir()
    (tmp_path / "msg" / "Foo.idl").write_text(text)
    arguments = {
        "package_name": "pkg",
        "output_dir": str(tmp_path),
        "idl_tuples": [f"{tmp_path}:msg/Foo.idl"],
    }
    (tmp_path / "arguments.json").write_text(json.dumps(arguments))
    generator.generate_type_hash(str(tmp_path / "arguments.json"))
    installed = json.loads((tmp_path / "msg" / "Foo.json").read_text())
    foo = parse_idl(text, TypeName("pkg", "msg", "Foo"), "Foo.idl")
    assert isinstance(foo, Message)
    description = describe(foo.name, {foo.name: foo}.__getitem__)
    assert description == installed["type_description_msg"]
    assert [{"type_name": str(foo.name), "hash_string": type_hash(description)}] == installed["type_hashes"]
