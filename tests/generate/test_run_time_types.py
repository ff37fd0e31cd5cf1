"""Types made at run time are those that generated code has."""

from __future__ import annotations

from rosidl_adapter_proto import TypeRegistry, adapter_for
from rosidl_adapter_proto.adapter import TypeAdapter
from tests.generate.conftest import Generated
from tests.run_time import check_attributes


def test_types_at_run_time_are_those_of_generated_code(ros_install: Generated) -> None:
    registry = TypeRegistry(ros_install.catalog, events=True)
    names = ros_install.messages()
    assert len(names) > 250
    for name in names:
        schema, adapter = registry[name], ros_install.adapter(name)
        assert schema.message_class is adapter.custom_type
        assert schema.type_name == adapter.type_name
        assert schema.type_hash == adapter.type_hash
        # An adapter does not know default values as ROS writes them.
        for own, generated in zip(
            schema.type_description["type_description"]["fields"],
            adapter.type_description()["type_description"]["fields"],
            strict=True,
        ):
            assert {**own, "default_value": ""} == {**generated, "default_value": ""}


def test_groups_at_run_time_are_those_of_generated_code(ros_install: Generated) -> None:
    registry = TypeRegistry(ros_install.catalog, events=True)
    groups = [name for name in ros_install.interfaces if name.namespace != "msg"]
    assert len(groups) >= 30
    for name in groups:
        schema, adapter = registry[name], ros_install.adapter(name)
        assert schema.type_hash == adapter.type_hash
        for part, part_schema in schema.parts.items():
            assert part_schema.type_hash == getattr(adapter, part).type_hash


def test_adapters_at_run_time_are_like_generated_ones(ros_install: Generated) -> None:
    """How they convert is tested with the round trips."""
    registry = TypeRegistry(ros_install.catalog, events=True)
    for name in {*ros_install.messages(), *ros_install.interfaces}:
        made, generated = adapter_for(str(name), registry), ros_install.adapter(name)
        assert issubclass(generated, TypeAdapter) == issubclass(made, TypeAdapter)
        check_attributes(made, generated)
