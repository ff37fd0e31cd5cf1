"""Adapters made at run time, as far as generated ones have nothing like it.

Conversions, errors and codecs are tested with those of generated adapters, here and in `tests/generate`.
"""

from __future__ import annotations

import gc
import sys
import weakref
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rosidl_adapter_proto import TypeRegistry, adapter_for
from rosidl_adapter_proto.adapter import ActionAdapter, ServiceAdapter, TypeAdapter
from rosidl_adapter_proto.errors import ConversionError, DefinitionError, SchemaError
from tests.folders import write_package
from tests.programs import run
from tests.run_time import check_attributes, made_at_run_time

# One process has only one version of a type in protobuf's default pool: each test has packages of its own.


def test_a_message_of_a_text() -> None:
    text = "uint8 LOST=3\nfloat64 x 1.5\nint32[] counts [1, 2]\nstring<=5 name\n"
    registry = TypeRegistry.from_texts({"runtime_message/msg/Track": text})
    adapter = adapter_for("runtime_message/msg/Track", registry)
    schema = registry["runtime_message/msg/Track"]

    assert issubclass(adapter, TypeAdapter)
    assert adapter.__name__ == "TrackAdapter"
    assert adapter.custom_type is schema.message_class
    assert adapter.type_name == "runtime_message/msg/Track"
    assert adapter.type_hash == schema.type_hash
    assert adapter.LOST == 3
    assert adapter.defaults == {"x": 1.5, "counts": [1, 2]}
    assert adapter.ros_class == "runtime_message.msg:Track"

    message = adapter.new(name="me")
    assert (message.x, list(message.counts), message.name) == (1.5, [1, 2], "me")
    assert adapter.from_cdr(adapter.to_cdr(message)) == message
    assert adapter.from_cdr(adapter.to_cdr(message), fields=["x"]) == adapter.custom_type(x=1.5)
    source = SimpleNamespace(x=2.5, counts=[3], name="other")
    assert adapter.convert_to_custom(source) == adapter.custom_type(x=2.5, counts=[3], name="other")
    with pytest.raises(ConversionError) as caught:
        adapter.convert_to_custom(SimpleNamespace(x=2.5, counts=[], name="others"), message)
    assert str(caught.value) == "runtime_message/msg/Track.name: 6 characters, more than the bound of 5"
    assert message == adapter.new(name="me")


def test_what_is_installed_or_embedded() -> None:
    adapter = adapter_for("sensor_msgs/msg/Imu")
    assert adapter is adapter_for("sensor_msgs/msg/Imu")
    assert [each.name for each in adapter.fields][:2] == ["header", "orientation"]
    assert adapter.fields[0].nested is adapter_for("std_msgs/msg/Header")
    data = adapter.to_cdr(adapter.new(header={"stamp": {"sec": 5}, "frame_id": "imu"}))
    chosen = adapter.from_cdr(data, fields=["header.stamp"])
    assert (chosen.header.stamp.sec, chosen.header.frame_id) == (5, "")


def test_services_and_actions() -> None:
    texts = {
        "runtime_groups/srv/Set": "bool on\n---\nbool ok\n",
        "runtime_groups/action/Go": "int32 to\n---\nint32 at\n---\nfloat32 part\n",
    }
    registry = TypeRegistry.from_texts(texts)
    service, action = (adapter_for(name, registry) for name in texts)

    assert issubclass(service, ServiceAdapter)
    assert service.request is adapter_for("runtime_groups/srv/Set_Request", registry)
    assert service.response.custom_type(ok=True).ok
    assert service.Request(on=True) == service.request.new(on=True)
    assert service.Response is service.response.custom_type
    assert service.ros_class == "runtime_groups.srv:Set"
    assert issubclass(action, ActionAdapter)
    assert action.send_goal is adapter_for("runtime_groups/action/Go_SendGoal", registry)
    assert action.send_goal.request.fields[1].nested is action.goal
    assert action.feedback_message.ros_class == "runtime_groups.action:Go.Impl.FeedbackMessage"
    parts = (action.goal, action.result, action.feedback)
    assert (action.Goal, action.Result, action.Feedback) == tuple(part.custom_type for part in parts)


def test_attributes_are_those_of_generated_adapters(generated_things: SimpleNamespace) -> None:
    """Also of what no interface out there has: constants and messages with names that are taken."""
    made = made_at_run_time(generated_things)
    for namespace in ("msg", "srv", "action"):
        generated = getattr(generated_things, namespace)
        adapters = [each for each in generated.__all__ if "Adapter" in each and each != "PartAdapter"]
        assert adapters
        for name in adapters:
            check_attributes(getattr(getattr(made, namespace), name), getattr(generated, name))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("Track", "'Track' is not of the form package/namespace/Name"),
        ("runtime_errors/msg/Trak", "did you mean runtime_errors/msg/Track?"),
        (
            "runtime_errors/msg/Broken",
            "runtime_missing/msg/Type was not found, but runtime_errors/msg/Broken.x ",
        ),
    ],
)
def test_types_that_cannot_be_had(name: str, text: str) -> None:
    texts = {"runtime_errors/msg/Track": "float64 x", "runtime_errors/msg/Broken": "runtime_missing/Type x"}
    with pytest.raises(DefinitionError) as caught:
        adapter_for(name, TypeRegistry.from_texts(texts))
    assert text in str(caught.value)


def test_arguments_of_another_kind() -> None:
    for arguments, text in (
        ((5,), "the name of a type must be a text, such as 'sensor_msgs/msg/Imu', not int"),
        (("std_msgs/msg/Header", {}), "registry must be a TypeRegistry, not dict"),
    ):
        with pytest.raises(TypeError) as caught:
            adapter_for(*arguments)
        assert str(caught.value) == text


def test_registries_have_adapters_of_their_own() -> None:
    """A hash knows nothing of constants and default values: two definitions with one class can have others."""
    name = "runtime_registries/msg/Track"
    one, other = (
        adapter_for(name, TypeRegistry.from_texts({name: text}))
        for text in ("uint8 A=1\nfloat64 x 1\n", "uint8 A=2\nfloat64 x 2\n")
    )
    assert one is not other
    assert one.custom_type is other.custom_type
    assert (one.A, one.new().x) == (1, 1.0)
    assert (other.A, other.new().x) == (2, 2.0)


ORDERS = """
import sys
from importlib import import_module
from rosidl_adapter_proto import TypeRegistry, adapter_for

order, definitions, python = sys.argv[1:]
sys.path.insert(0, python)
registry = TypeRegistry.from_folders(definitions)
import_generated = lambda: import_module("things_root.things.msg").EverythingAdapter
make = lambda: adapter_for("things/msg/Everything", registry)
steps = (import_generated, make) if order == "generated first" else (make, import_generated)
one, other = (step() for step in steps)
assert one.custom_type is other.custom_type
message = one.new(short="abc")
assert other.from_cdr(one.to_cdr(message)).short == one.from_cdr(other.to_cdr(message)).short == "abc"
print(other.new(short="abc") == message)
"""


@pytest.mark.parametrize("order", ["generated first", "made first"])
def test_the_class_is_that_of_generated_code(order: str, generated_things: SimpleNamespace) -> None:
    folder = generated_things.folder
    said = run(
        *(sys.executable, "-c", ORDERS, order, folder.parent / "things", folder / "python"), folder=folder
    )
    assert said == "True\n"


def test_versions_of_a_type_side_by_side(generated_things: SimpleNamespace) -> None:
    """Generated code has one version, an adapter made at run time another."""
    generated = generated_things.msg.PartAdapter_
    made = adapter_for("things/msg/Part", TypeRegistry.from_texts({"things/msg/Part": "string y\n"}))
    assert made.type_name == generated.type_name
    assert made.type_hash != generated.type_hash
    assert made.custom_type is not generated.custom_type
    assert made.from_cdr(made.to_cdr(made.custom_type(y="a"))).y == "a"
    assert generated.from_cdr(generated.to_cdr(generated.custom_type(x=1))).x == 1
    for refuse in (made.to_cdr, made.convert_to_ros_message):
        with pytest.raises(ConversionError) as caught:
            refuse(generated.custom_type(x=1))
        found = f"{generated.custom_type.__module__}.Part"
        assert str(caught.value) == (
            f"things/msg/Part: expected a protobuf message things.msg.pb.Part, not {found} "
            "(of another version of the type)"
        )
    with pytest.raises(ConversionError) as caught:
        made.to_cdr(made.custom_type)
    assert "another version" not in str(caught.value)


def test_types_that_cannot_be_transcoded(tmp_path: Path) -> None:
    """They convert all the same."""
    text = (
        "module runtime_long { module msg { struct Far { long double x; sequence<long double> more; }; }; };"
    )
    folder = write_package(tmp_path / "runtime_long", {"msg/Far.idl": text})
    adapter = adapter_for("runtime_long/msg/Far", TypeRegistry.from_folders(folder))
    assert adapter.convert_to_custom(SimpleNamespace(x=1.5, more=[2.5])).x == 1.5
    with pytest.raises(SchemaError) as caught:
        adapter.to_cdr(adapter.custom_type())
    assert str(caught.value) == (
        "runtime_long/msg/Far.x: long double has no one layout in CDR and cannot be transcoded; "
        "make the field a double"
    )


def test_many_threads_get_the_same_adapters() -> None:
    names = [f"runtime_threads/msg/M{number}" for number in range(8)]
    inner = ["int32 x\n", *(f"M{number}[2] inner\n" for number in range(7))]
    registry = TypeRegistry.from_texts(dict(zip(names, inner, strict=True)))

    def ask(start: int) -> list[Any]:
        asked = {name: adapter_for(name, registry) for name in (*names[start:], *names[:start])}
        return [asked[name] for name in names]

    with ThreadPoolExecutor(8) as threads:
        first, *others = threads.map(ask, range(8))
    assert all(one is other for each in others for one, other in zip(first, each, strict=True))


def test_an_adapter_outlives_its_registry() -> None:
    registry = TypeRegistry.from_texts({"runtime_outlives/msg/Track": "std_msgs/Header header\n"})
    adapter = adapter_for("runtime_outlives/msg/Track", registry)
    reference = weakref.ref(registry)
    del registry
    gc.collect()
    assert reference() is None
    message = adapter.new(header={"frame_id": "map"})
    assert adapter.from_cdr(adapter.to_cdr(message)).header.frame_id == "map"


def test_deep_messages() -> None:
    """As deep as messages may be: the default value of the innermost is there, and nothing runs out of stack."""
    texts = {f"runtime_deep/msg/M{index}": f"M{index + 1} m" for index in range(99)}
    registry = TypeRegistry.from_texts({**texts, "runtime_deep/msg/M99": "int8 x 5"})
    deep = adapter_for("runtime_deep/msg/M0", registry)
    message: Any = deep.new()
    assert deep.from_cdr(deep.to_cdr(message)) == message
    assert len(deep.type_description()["referenced_type_descriptions"]) == 99
    for _ in range(99):
        message = message.m
    assert message.x == 5


def test_wide_messages() -> None:
    """Each message has the next three times: there are 60 types, and more messages than can be made."""
    texts = {f"runtime_wide/msg/M{index}": f"M{index + 1} a\nM{index + 1}[2] b\n" for index in range(60)}
    registry = TypeRegistry.from_texts({**texts, "runtime_wide/msg/M60": "int8 x"})
    wide = adapter_for("runtime_wide/msg/M0", registry)
    assert not wide.has_defaults
    assert wide.new() == wide.custom_type()
    assert len(wide.type_description()["referenced_type_descriptions"]) == 60
