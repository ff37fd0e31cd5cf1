"""Types at run time. What they have in common with generated code is tested in programs of their own.

protobuf's default pool keeps all that was ever put into it, so each test has packages that no other one has.
"""

from __future__ import annotations

import fnmatch
import gc
import json
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from google.protobuf import descriptor_pool
from google.protobuf.descriptor_pb2 import FileDescriptorProto

import rosidl_adapter_proto
from rosidl_adapter_proto import Schema, TypeRegistry
from rosidl_adapter_proto.errors import DefinitionError, SchemaError
from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, installed_sources
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.schema.numbering import SequentialNumbering, compute_proto_field_number
from tests.folders import write_package
from tests.programs import run


def numbers(schema: Schema) -> dict[str, int]:
    return {each.name: each.number for each in schema.descriptor.fields}


# Schemas


def test_a_message() -> None:
    text = (
        "# What was seen.\nuint8 LOST=3\nstring NAME='a'\nstd_msgs/Header header\nfloat64[] x\nint8 small 5\n"
    )
    registry = TypeRegistry.from_texts({"registry_message/msg/Track": text})
    schema = registry["registry_message/msg/Track"]
    assert schema is registry[TypeName("registry_message", "msg", "Track")]
    assert schema.type_name == "registry_message/msg/Track"
    assert schema.type_hash.startswith("RIHS01_")
    assert schema.type_description["type_description"]["type_name"] == schema.type_name
    assert [each["type_name"] for each in schema.type_description["referenced_type_descriptions"]] == [
        "builtin_interfaces/msg/Time",
        "std_msgs/msg/Header",
    ]
    assert schema.file.path == "registry_message/msg/Track.proto"
    assert schema.message is schema.file.messages[0]
    assert schema.constants == {"LOST": 3, "NAME": "a"}
    assert schema.parts == {}
    assert schema.descriptor.full_name == "registry_message.msg.pb.Track"
    assert numbers(schema) == {each: compute_proto_field_number(each) for each in ("header", "x", "small")}
    message = schema.message_class(x=[1.0, 2.0], small=-1)
    assert schema.message_class.FromString(message.SerializeToString()) == message
    assert repr(schema) == (f"Schema(type_name='registry_message/msg/Track', type_hash={schema.type_hash!r})")


def test_a_service() -> None:
    registry = TypeRegistry.from_texts(
        {"registry_service/srv/Set": "bool data\n---\nuint8 A=1\nstring text\n"}
    )
    schema = registry["registry_service/srv/Set"]
    assert list(schema.parts) == ["request", "response"]
    assert schema.request is registry["registry_service/srv/Set_Request"]
    assert schema.response is registry["registry_service/srv/Set_Response"]
    assert list(numbers(schema.request)) == ["data"]
    assert (schema.constants, schema.response.constants) == ({}, {"A": 1})
    assert schema.file is schema.request.file
    assert schema.file.service is not None
    fields = schema.type_description["type_description"]["fields"]
    assert [each["name"] for each in fields] == ["request_message", "response_message", "event_message"]


def test_an_action() -> None:
    text = "int32 order\n---\nint32[] sequence\n---\nint32[] partial\n"
    registry = TypeRegistry.from_texts({"registry_action/action/Count": text})
    schema = registry["registry_action/action/Count"]
    assert {part: each.type_name.rpartition("/")[2] for part, each in schema.parts.items()} == {
        "goal": "Count_Goal",
        "result": "Count_Result",
        "feedback": "Count_Feedback",
        "send_goal": "Count_SendGoal",
        "get_result": "Count_GetResult",
        "feedback_message": "Count_FeedbackMessage",
    }
    assert all(getattr(schema, part) is each for part, each in schema.parts.items())
    assert list(numbers(schema.goal)) == ["order"]
    assert list(numbers(schema.send_goal.request)) == ["goal_id", "goal"]
    assert list(numbers(schema.get_result.response)) == ["status", "result"]
    goal = schema.send_goal.request.message_class(goal=schema.goal.message_class(order=3))
    assert goal.goal.order == 3  # type: ignore[attr-defined]


def test_what_a_schema_does_not_have() -> None:
    texts = {"registry_kinds/msg/Track": "int8 x", "registry_kinds/srv/Set": "---"}
    registry = TypeRegistry.from_texts({**texts, "registry_kinds/action/Go": "---\n---"})
    message, service, action = (
        registry[f"registry_kinds/{each}"] for each in ("msg/Track", "srv/Set", "action/Go")
    )
    for schema, name, text in (
        (message, "request", "registry_kinds/msg/Track has no request: it is a message"),
        (service, "goal", "registry_kinds/srv/Set has no goal: its parts are request, response"),
        (service, "message_class", "registry_kinds/srv/Set is no message and has no protobuf class; "
            "take that of a part: request, response"),
        (action, "descriptor", "registry_kinds/action/Go is no message and has no protobuf class; take that of a part: "
            "goal, result, feedback, send_goal, get_result, feedback_message"),
    ):  # fmt: skip
        with pytest.raises(SchemaError) as caught:
            getattr(schema, name)
        assert str(caught.value) == text


def test_events_are_there_if_asked_for() -> None:
    texts = {"registry_events/srv/Set": "---"}
    registry = TypeRegistry.from_texts({"registry_events/srv/Set": "---"}, events=True)
    assert list(numbers(registry["registry_events/srv/Set_Event"])) == ["info", "request", "response"]
    with pytest.raises(DefinitionError) as caught:
        TypeRegistry.from_texts(texts)["registry_events/srv/Set_Event"]
    assert str(caught.value) == (
        "registry_events/srv/Set_Event is the event of a service: it needs a registry with events=True"
    )


def test_public_names() -> None:
    assert rosidl_adapter_proto.TypeRegistry is TypeRegistry
    assert rosidl_adapter_proto.Schema is Schema


# Where definitions come from


def test_what_is_installed() -> None:
    assert TypeRegistry()["std_msgs/msg/Header"].message_class(frame_id="map")


def test_folders(tmp_path: Path) -> None:
    first = write_package(
        tmp_path / "registry_folder", {"msg/A.msg": "registry_other/B b\nstd_msgs/Header h"}
    )
    second = write_package(tmp_path / "registry_other", {"msg/B.msg": "int8 x"})
    registry = TypeRegistry.from_folders(first, str(second))
    assert list(numbers(registry["registry_folder/msg/A"])) == ["b", "h"]
    assert registry["registry_other/msg/B"].message_class is not None
    (tmp_path / "nothing").mkdir()
    with pytest.raises(DefinitionError, match=r"^no interface definitions in .*/nothing"):
        TypeRegistry.from_folders(tmp_path / "nothing")


def test_texts_may_be_some_of_a_package() -> None:
    registry = TypeRegistry.from_texts({"std_msgs/msg/RegistryTest": "String text\nHeader header"})
    assert list(numbers(registry["std_msgs/msg/RegistryTest"])) == ["text", "header"]
    assert list(numbers(registry["std_msgs/msg/String"])) == ["data"]


def test_names_in_a_registry() -> None:
    registry = TypeRegistry.from_texts({"registry_names/srv/Set": "---"})
    assert {"registry_names/srv/Set", "std_msgs/msg/String"} <= set(registry)
    assert "registry_names/srv/Set_Request" not in set(registry)
    for name, is_there in {
        "registry_names/srv/Set": True,
        "registry_names/srv/Set_Request": True,
        "registry_names/srv/Set_Goal": False,
        "registry_names/msg/Set": False,
        "nothing/msg/Set": False,
        "Set": False,
    }.items():
        assert (name in registry) == is_there
    assert TypeName("registry_names", "srv", "Set") in registry


@pytest.mark.parametrize(
    ("name", "error"),
    [
        (
            "registry_unknown/msg/Trak",
            "type 'registry_unknown/msg/Trak' was not found in package 'registry_unknown' of the given texts; "
            "did you mean registry_unknown/msg/Track?",
        ),
        (
            "registry_unknwon/msg/Track",
            "package 'registry_unknwon' was not found; did you mean registry_unknown?; *",
        ),
        ("Track", "'Track' is not of the form package/namespace/Name"),
        (
            "registry_unknown/Track",
            "'registry_unknown/Track' is not of the form package/namespace/Name; "
            "did you mean registry_unknown/msg/Track?",
        ),
        ("registry_unknown/Trak", "'registry_unknown/Trak' is not of the form package/namespace/Name"),
        (
            "registry_unknown/msg/Needy",
            "registry_lost/msg/A was not found, but registry_unknown/msg/Needy.a (*",
        ),
        ("registry_unknown/msg/Bad", "registry_unknown/msg/Bad:1:1: *"),
        ("registry_unknown/msg/Bad_", "registry_unknown/msg/Bad_: 'Bad_' is not a valid message name; *"),
        (
            "registry_unknown/msg/Selfish",
            "a message cannot contain itself: registry_unknown/msg/Selfish.a (*",
        ),
        ("registry_unknown/msg/One", "messages cannot contain each other:\n  registry_unknown/msg/One.a (*"),
    ],
)
def test_what_cannot_be_had(name: str, error: str) -> None:
    texts = {
        "Track": "int8 x",
        "Needy": "registry_lost/A a",
        "Bad": "int8",
        "Bad_": "int8 x",
        "Selfish": "Selfish a",
        "One": "Two a",
        "Two": "One a",
    }
    registry = TypeRegistry.from_texts({f"registry_unknown/msg/{each}": text for each, text in texts.items()})
    for _ in range(2):
        with pytest.raises(DefinitionError) as caught:
            registry[name]
        assert fnmatch.fnmatchcase(str(caught.value), error)
    # A mistake in one definition is no matter of the others, those of the same package included.
    assert list(numbers(registry["registry_unknown/msg/Track"])) == ["x"]


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("Track", "'Track' is not of the form package/namespace/Name"),
        ("a/message/Track", "a/message/Track: what stands in the middle has to be msg, srv or action"),
    ],
)
def test_names_that_texts_cannot_have(name: str, error: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        TypeRegistry.from_texts({name: "int8 x"})
    assert str(caught.value) == error


@pytest.mark.parametrize(
    ("texts", "error"),
    [
        (
            "float64 x",
            "texts must be a mapping from type names to definitions, such as "
            "{'my_msgs/msg/Track': 'float64 x'}, not str",
        ),
        (
            {"registry_kind/msg/Track": b"float64 x"},
            "the definition of 'registry_kind/msg/Track' must be a text, not bytes",
        ),
        ({5: "float64 x"}, "the name of a type must be a text, such as 'sensor_msgs/msg/Imu', not int"),
    ],
)
def test_texts_of_another_kind(texts: Any, error: str) -> None:
    with pytest.raises(TypeError) as caught:
        TypeRegistry.from_texts(texts)
    assert str(caught.value) == error


def test_two_interfaces_that_define_the_same_name(tmp_path: Path) -> None:
    idl = "module registry_twice { module srv { struct Do_Request { long x; }; }; };"
    package = write_package(tmp_path / "registry_twice", {"srv/Do.srv": "---", "srv/Do_Request.idl": idl})
    registry = TypeRegistry.from_folders(package)
    with pytest.raises(SchemaError, match=r"^registry_twice\.srv\.pb\.Do_Request is defined by both "):
        registry["registry_twice/srv/Do"]
    assert registry["std_msgs/msg/String"].message_class is not None  # others are not affected


# Numbers


def test_numbers_of_a_lock_file(tmp_path: Path) -> None:
    lock = tmp_path / "rosidl-proto.lock"
    numbering = SequentialNumbering(str(lock), {})
    write_package(tmp_path / "registry_lock", {"msg/A.msg": "int8 gone\nint8 b\nint8 a"})
    generated = Catalog((folder_source(tmp_path / "registry_lock"),))
    numbering.numbers(generated.message(TypeName("registry_lock", "msg", "A")))
    lock.write_text(numbering.lock_text())

    texts = {"registry_lock/msg/A": "int8 a\nint8 b"}
    for file in (lock, str(lock)):
        registry = TypeRegistry.from_texts(texts, lock_file=file)
        assert numbers(registry["registry_lock/msg/A"]) == {"a": 3, "b": 2}
    assert lock.read_text() == numbering.lock_text()
    with pytest.raises(SchemaError, match=r"^registry_lock/msg/A\.a: .* has number 3 for it with type int8"):
        TypeRegistry.from_texts({"registry_lock/msg/A": "string a"}, lock_file=lock)["registry_lock/msg/A"]


def test_fields_that_a_lock_file_does_not_have(tmp_path: Path) -> None:
    """A number that nothing keeps would be another one in the next program."""
    lock = tmp_path / "rosidl-proto.lock"
    content = {"registry_new/msg/A": {"fields": {"a": "1 int32 (int8)"}, "removed": {}}}
    lock.write_text(json.dumps({"version": 2, "messages": content}))
    texts = {"registry_new/msg/A": "int8 a\nint8 new", "registry_new/msg/B": "int8 x"}
    registry = TypeRegistry.from_texts(texts, lock_file=lock)
    for name, field in (("registry_new/msg/A", "new"), ("registry_new/msg/B", "x")):
        for _ in range(2):
            with pytest.raises(SchemaError) as caught:
                _ = registry[name]
            assert str(caught.value) == (
                f"{name}.{field}: {lock} has no number for it; generate code of {name} with this lock file first"
            )


def test_lock_files_that_cannot_be_read(tmp_path: Path) -> None:
    lock = tmp_path / "rosidl-proto.lock"
    with pytest.raises(SchemaError, match=f"^cannot read {lock}: .*No such file"):
        TypeRegistry(lock_file=lock)
    lock.write_text("{}")
    with pytest.raises(SchemaError, match=f"^{lock} is damaged: 'version' is missing"):
        TypeRegistry(lock_file=lock)


# Protobuf classes


def test_classes_are_in_the_default_pool() -> None:
    schema = TypeRegistry.from_texts({"registry_pool/msg/A": "int8 x"})["registry_pool/msg/A"]
    assert schema.descriptor.file.pool is descriptor_pool.Default()  # type: ignore[no-untyped-call, unused-ignore]
    again = TypeRegistry.from_texts({"registry_pool/msg/A": "# the same\nint8 x"})["registry_pool/msg/A"]
    assert again is not schema
    assert again.message_class is schema.message_class


def test_versions_of_a_type_side_by_side() -> None:
    name, user = "registry_versions/msg/A", "registry_versions/msg/User"
    versions = [
        TypeRegistry.from_texts({name: text, user: "A a\nstd_msgs/Header header"})
        for text in ("int8 x", "string x", "string x\nstring y")
    ]
    first, second, third = (each[user].message_class for each in versions)
    assert first(a={"x": 1}).a.x == 1  # type: ignore[attr-defined]
    assert second(a={"x": "a"}).a.x == "a"  # type: ignore[attr-defined]
    assert third(a={"y": "a"}, header={"frame_id": "map"}).header.frame_id == "map"  # type: ignore[attr-defined]
    for registry in versions:
        assert registry[user].descriptor.fields_by_name["a"].message_type is registry[name].descriptor
        assert isinstance(registry[user].message_class().a, registry[name].message_class)  # type: ignore[attr-defined]


def test_registries_with_the_same_version_share_its_classes() -> None:
    for text in ("int8 x", "int16 y", "int32 z"):
        one, other = (TypeRegistry.from_texts({"registry_shared/msg/A": text}) for _ in range(2))
        assert one["registry_shared/msg/A"].message_class is other["registry_shared/msg/A"].message_class


def test_a_class_outlives_its_registry() -> None:
    """In releases of protobuf before 4.22, nothing but a reference to it keeps the class of a nested message."""
    for text in ("int8 x", "string x"):
        texts = {"registry_gone/msg/A": text, "registry_gone/msg/User": "A a\nstd_msgs/Header header"}
        user = TypeRegistry.from_texts(texts)["registry_gone/msg/User"].message_class
        gc.collect()
        message: Any = user(header={"frame_id": "map"}, a={})
        assert message.header.frame_id == "map"
        assert message.a.SerializeToString() == b""


def test_a_file_of_another_name_with_the_same_message() -> None:
    foreign = FileDescriptorProto(name="foreign.proto", package="registry_foreign.msg.pb", syntax="proto3")
    foreign.message_type.add(name="A")
    pool = descriptor_pool.Default()  # type: ignore[no-untyped-call, unused-ignore]
    pool.AddSerializedFile(foreign.SerializeToString())
    schema = TypeRegistry.from_texts({"registry_foreign/msg/A": "int8 x"})["registry_foreign/msg/A"]
    assert schema.descriptor.file.pool is not pool
    assert schema.message_class(x=3).x == 3  # type: ignore[attr-defined]


def test_deep_nesting() -> None:
    depth = 99
    package = f"registry_depth{depth}"
    texts = {f"{package}/msg/M{index}": f"M{index + 1} m" for index in range(depth)}
    registry = TypeRegistry.from_texts({**texts, f"{package}/msg/M{depth}": "int8 x"})
    schema = registry[f"{package}/msg/M0"]
    assert len(schema.type_description["referenced_type_descriptions"]) == depth
    descriptor: Any = schema.descriptor
    for _ in range(depth):
        (field,) = descriptor.fields
        descriptor = field.message_type
    assert descriptor.full_name == f"{package}.msg.pb.M{depth}"


def test_many_threads_get_the_same_schemas() -> None:
    texts = {f"registry_threads/msg/M{index}": f"M{index + 1} m" for index in range(50)}
    registry = TypeRegistry.from_texts({**texts, "registry_threads/msg/M50": "int8 x"})

    def ask(start: int) -> list[Schema]:
        order = [(start + 7 * step) % 51 for step in range(51)]
        found = {index: registry[f"registry_threads/msg/M{index}"] for index in order}
        return [found[index] for index in range(51)]

    with ThreadPoolExecutor(16) as pool:
        first, *others = pool.map(ask, range(16))
    assert all(one is other for each in others for one, other in zip(first, each, strict=True))


# Beside generated code

NAMES = (
    "tracker/msg/Track",
    "tracker/srv/Reset_Request",
    "tracker/action/Move_SendGoal_Request",
    "std_msgs/msg/Header",
)

ORDERS = """
import pickle, sys
from importlib import import_module
from rosidl_adapter_proto import TypeRegistry

order, definitions, python, *names = sys.argv[1:]

def generated():
    sys.path.insert(0, python)
    classes = []
    for package, namespace, name in (each.split("/") for each in names):
        classes.append(getattr(import_module(f"rosidl_proto.{package}.{namespace}"), name))
    return classes

def made():
    return [registry[name].message_class for name in names]

registry = TypeRegistry.from_folders(definitions)
if order == "generated code is found later":
    second, first = made(), generated()
else:
    if order == "generated code is found first":
        sys.path.insert(0, python)
    second = made() if order == "generated code is found first" else None
    first = generated()
    second = second or made()
for one, other in zip(first, second):
    message = one()
    assert type(pickle.loads(pickle.dumps(message))) is one, one
    print(one is other)
"""


@pytest.fixture(scope="module")
def tracker(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package, and generated code of it, in a folder for each."""
    folder = tmp_path_factory.mktemp("tracker")
    definitions = {"msg/Track.msg": "std_msgs/Header header\nint32 x", "srv/Reset.srv": "Track track\n---"}
    package = write_package(
        folder / "tracker", {**definitions, "action/Move.action": "tracker/Track to\n---\n---\nfloat64 done"}
    )
    catalog = Catalog((folder_source(package), *installed_sources()))
    generate(Request(("tracker",)), catalog, folder / "generated")
    return folder


@pytest.mark.parametrize(
    "order",
    ["generated code is imported first", "generated code is found first", "generated code is found later"],
)
def test_classes_are_those_of_generated_code(order: str, tracker: Path) -> None:
    paths = (tracker / "tracker", tracker / "generated/python")
    said = run(sys.executable, "-c", ORDERS, order, *paths, *NAMES, folder=tracker)
    assert said.split() == ["True"] * len(NAMES)


OTHER_VERSION = """
import sys
from rosidl_adapter_proto import TypeRegistry

imported_first, python = sys.argv[1:]
sys.path.insert(0, python)
if imported_first == "True":
    from rosidl_proto.tracker.msg import Track
texts = {"tracker/msg/Track": "std_msgs/Header header\\nstring y"}
made = TypeRegistry.from_texts(texts)["tracker/msg/Track"].message_class
from rosidl_proto.tracker.msg import Track
from rosidl_proto.tracker.srv import Reset_Request

assert made is not Track
assert [field.name for field in made.DESCRIPTOR.fields] == ["header", "y"]
assert Reset_Request(track=Track(x=3)).track.x == 3
print(made(y="a", header={"frame_id": "map"}).y)
"""


@pytest.mark.parametrize("imported_first", [True, False])
def test_another_version_than_that_of_generated_code(imported_first: bool, tracker: Path) -> None:
    """Neither is in the way of the other, whichever comes first."""
    python = tracker / "generated/python"
    assert run(sys.executable, "-c", OTHER_VERSION, str(imported_first), python, folder=tracker) == "a\n"


OTHER_ROOT = """
import pickle, sys
from rosidl_adapter_proto import TypeRegistry

first, definitions, python = sys.argv[1:]
if first == "the same version":
    made = TypeRegistry.from_folders(definitions, python_root="tracker_root")["tracker/msg/Track"]
elif first == "another version":
    texts = {"builtin_interfaces/msg/Time": "int64 t", "tracker/msg/Track": "std_msgs/Header header"}
    made = TypeRegistry.from_texts(texts)["tracker/msg/Track"]
elif first == "events":
    made = TypeRegistry.from_folders(definitions, events=True)["tracker/srv/Reset_Event"]
sys.path.insert(0, python)
from tracker_root.tracker.msg import Track
from tracker_root.tracker.srv import Reset_Request

if first == "generated code":
    made = TypeRegistry.from_folders(definitions)["tracker/msg/Track"]
for message in (Track(x=3), Reset_Request(track=Track(x=4))):
    assert pickle.loads(pickle.dumps(message)) == message
print(made.message_class is Track)
"""


@pytest.mark.parametrize(
    ("first", "is_shared"),
    [("generated code", True), ("the same version", True), ("another version", False), ("events", False)],
)
def test_generated_code_below_another_root(first: str, is_shared: bool, tracker: Path) -> None:
    catalog = Catalog((folder_source(tracker / "tracker"), *installed_sources()))
    output = tracker / "other_root"
    generate(Request(("tracker",)), catalog, output, Options(python_root="tracker_root"))
    said = run(
        sys.executable, "-c", OTHER_ROOT, first, tracker / "tracker", output / "python", folder=tracker
    )
    assert said == f"{is_shared}\n"


def test_generated_code_with_other_numbers(tracker: Path) -> None:
    catalog = Catalog((folder_source(tracker / "tracker"), *installed_sources()))
    lock, output = tracker / "lock", tracker / "sequential"
    generate(Request(("tracker",)), catalog, output, Options(numbering="sequential", lock_file=lock))
    program = """
import sys
from pathlib import Path
from rosidl_adapter_proto import TypeRegistry

definitions, lock, python = sys.argv[1:]
sys.path.insert(0, python)
from rosidl_proto.tracker.msg import Track
hashed = TypeRegistry.from_folders(definitions)["tracker/msg/Track"]
locked = TypeRegistry.from_folders(definitions, lock_file=Path(lock))["tracker/msg/Track"]
print(locked.message_class is Track, hashed.message_class is Track)
print(*(each.number for each in locked.descriptor.fields))
"""
    said = run(sys.executable, "-c", program, tracker / "tracker", lock, output / "python", folder=tracker)
    assert said.splitlines() == ["True False", "1 2"]


def test_generated_code_that_cannot_be_imported(tracker: Path) -> None:
    """What is wrong with it is said, and not passed over."""
    package = tracker / "broken/rosidl_proto/tracker/msg"
    package.mkdir(parents=True)
    (package / "Track_pb2.py").write_text("import not_there")
    program = """
import sys
from rosidl_adapter_proto import TypeRegistry
sys.path.insert(0, sys.argv[1])
TypeRegistry.from_texts({"tracker/msg/Track": "int8 x"})["tracker/msg/Track"]
"""
    said = run(sys.executable, "-c", program, tracker / "broken", folder=tracker, code=1)
    assert "ModuleNotFoundError: No module named 'not_there'" in said


EVERYTHING = """
from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import store_source
from rosidl_adapter_proto.interfaces.store import distributions

for distribution in (None, *distributions()):
    catalog = Catalog((store_source(distribution),)) if distribution else None
    registry = TypeRegistry(catalog)
    schemas = [registry[name] for name in registry]
    for schema in (part for schema in schemas for part in (schema.parts.values() or [schema])):
        for each in schema.parts.values() or [schema]:
            assert [field.name for field in each.descriptor.fields] == [field.name for field in each.message.fields]
            each.message_class().SerializeToString()
    print(len(schemas) > 100)
"""


def test_every_version_of_everything_in_one_process(tmp_path: Path) -> None:
    assert set(run(sys.executable, "-c", EVERYTHING, folder=tmp_path).split()) == {"True"}


def test_messages_that_are_nested_too_deep() -> None:
    texts = {f"registry_deep/msg/M{index}": f"M{index + 1} m" for index in range(100)}
    registry = TypeRegistry.from_texts({**texts, "registry_deep/msg/M100": "int8 x"})
    assert registry["registry_deep/msg/M1"].message is not None
    for _ in range(2):
        with pytest.raises(SchemaError) as caught:
            _ = registry["registry_deep/msg/M0"]
        assert str(caught.value) == (
            "registry_deep/msg/M0.m (registry_deep/msg/M0:1:4) nests messages more than 100 deep, which protobuf does "
            "not read; flatten registry_deep/msg/M1 or what is in it"
        )


def test_bounds_that_cdr_cannot_count() -> None:
    registry = TypeRegistry.from_texts({"registry_long/msg/Long": f"int8[<={2**32}] x"})
    with pytest.raises(SchemaError, match=r"^registry_long/msg/Long\.x .*: the bound of a sequence must be "):
        _ = registry["registry_long/msg/Long"]
