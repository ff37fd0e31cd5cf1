"""Round trips against the real ROS classes, for every type there is: ROS to protobuf to bytes and back.

The transcoder's way, through serialized messages, must give the same as the objects' way, and so must adapters that
are made at run time.
"""

from __future__ import annotations

import copy
import json
import pickle
from pathlib import Path
from typing import Any

from google.protobuf import json_format
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rosidl_adapter_proto import TypeRegistry, adapter_for
from rosidl_adapter_proto.interfaces.model import TypeName
from tests.generate.conftest import Generated
from tests.strategies import RosMessages

REGISTRY = TypeRegistry(events=True)


def check_round_trip(adapter: Any, message: Any) -> None:
    from rclpy.serialization import deserialize_message, serialize_message

    custom = adapter.convert_to_custom(message)
    again = adapter.custom_type.FromString(custom.SerializeToString())
    assert again == custom
    assert adapter.convert_to_ros_message(again) == message
    assert adapter.convert_to_custom(adapter.convert_to_ros_message(custom)) == custom
    assert adapter.from_cdr(serialize_message(message)) == custom
    assert deserialize_message(adapter.to_cdr(custom), adapter.ros_message_type) == message
    made = adapter_for(adapter.type_name, REGISTRY)
    assert made.convert_to_custom(message) == custom
    assert made.convert_to_ros_message(custom) == message
    assert made.from_cdr(made.to_cdr(custom)) == custom


def check_protobuf_use(adapter: Any, message: Any) -> None:
    custom = adapter.convert_to_custom(message)
    assert pickle.loads(pickle.dumps(custom)) == custom
    assert copy.deepcopy(custom) == custom
    assert json_format.ParseDict(json_format.MessageToDict(custom), adapter.custom_type()) == custom


def run_round_trips(adapter: Any, messages: st.SearchStrategy[Any]) -> None:
    @given(messages)
    @settings(max_examples=10, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    def run(message: Any) -> None:
        check_round_trip(adapter, message)
        examples.append(message)

    examples: list[Any] = []
    run()
    check_protobuf_use(adapter, examples[-1])


def test_every_type(ros_install: Generated, ros_messages: RosMessages) -> None:
    names = ros_install.messages()
    assert len(names) > 200

    for name in names:
        adapter = ros_install.adapter(name)

        run_round_trips(adapter, ros_messages.message(name))


def test_official_fixtures(ros_install: Generated) -> None:
    from test_msgs import message_fixtures, service_fixtures

    makers = [
        getattr(message_fixtures, name) for name in dir(message_fixtures) if name.startswith("get_msg_")
    ]
    found = [message for make in makers for message in make()]
    for make in (
        getattr(service_fixtures, name) for name in dir(service_fixtures) if name.startswith("get_srv_")
    ):
        found += [message for exchange in make() for message in exchange]
    assert len(found) > 30
    for message in found:
        *_, namespace, _ = type(message).__module__.split(".")
        adapter = ros_install.adapter(TypeName("test_msgs", namespace, type(message).__name__))
        check_round_trip(adapter, message)
        check_protobuf_use(adapter, message)


def test_new_equals_a_new_ros_message(ros_install: Generated) -> None:
    for name in ros_install.messages():
        adapter = ros_install.adapter(name)
        assert adapter.convert_to_ros_message(adapter.new()) == adapter.ros_message_type(), name


def test_constants_equal_those_of_ros(ros_install: Generated) -> None:
    checked = 0
    for name in ros_install.messages():
        adapter = ros_install.adapter(name)
        for constant in ros_install.catalog.message(name).constants:
            value = getattr(adapter.ros_message_type, constant.name)
            if isinstance(value, bytes):  # an octet
                value = ord(value)
            assert getattr(adapter, constant.name) == value, (name, constant.name)
            checked += 1
    assert checked > 100


def test_adapters_know_the_type_of_ros(ros_install: Generated) -> None:
    """Descriptions and hashes are those of the `.json` files that ROS installs."""
    checked = 0
    for name in ros_install.interfaces:
        file = Path(ros_install.catalog.definition(name).file).with_suffix(".json")
        content = json.loads(file.read_text())
        hashes = {each["type_name"]: each["hash_string"] for each in content["type_hashes"]}
        adapter = ros_install.adapter(name)
        assert adapter.type_hash == hashes[str(name)]
        if hasattr(adapter, "fields"):
            assert adapter.type_description() == without_defaults(content["type_description_msg"])
        checked += 1
    assert checked > 190


def without_defaults(description: dict[str, Any]) -> dict[str, Any]:
    for each in (description["type_description"], *description["referenced_type_descriptions"]):
        for field in each["fields"]:
            field["default_value"] = ""
    return description
