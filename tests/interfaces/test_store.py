from __future__ import annotations

import pytest

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces import store
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.closure import closure
from rosidl_adapter_proto.interfaces.find import prefix_sources, store_source
from rosidl_adapter_proto.interfaces.model import (
    ArrayType,
    BasicType,
    Constant,
    Field,
    Message,
    StringType,
    TypeName,
)

DISTRIBUTIONS = (
    *("noetic", "dashing", "eloquent", "foxy", "galactic", "humble", "iron", "jazzy", "kilted", "lyrical"),
)

# Types that were others in older or newer distributions than those of the ROS wheels.
CHANGED_SINCE = {
    "humble": {
        "rmw_dds_common/msg/Gid",
        "rmw_dds_common/msg/NodeEntitiesInfo",
        "rmw_dds_common/msg/ParticipantEntitiesInfo",
        "sensor_msgs/msg/Range",
    },
    "iron": set[str](),
    "jazzy": set[str](),
    "kilted": set[str](),
    "lyrical": {"lifecycle_msgs/msg/TransitionEvent"},
}


def test_distributions() -> None:
    found = store.distributions()
    assert found[: len(DISTRIBUTIONS)] == DISTRIBUTIONS
    assert store.newest_distribution() == found[-1]
    assert [each for each in found if store.is_ros1(each)] == ["noetic"]


@pytest.mark.parametrize("distribution", store.distributions())
def test_every_definition_is_read(distribution: str) -> None:
    catalog = Catalog((store_source(distribution),))
    for package in catalog.packages.values():
        for name, definition in package.items():
            assert isinstance(definition.interface, Message)
            assert definition.interface.name == name
    order = closure(catalog, catalog.packages)
    assert len(order) == len(set(order)) > 100
    assert set(order) == {name for package in catalog.packages.values() for name in package}


@pytest.mark.parametrize("distribution", CHANGED_SINCE)
def test_types_equal_those_of_ros(distribution: str, ros_prefix: object) -> None:
    ros, embedded = Catalog(tuple(prefix_sources())), Catalog((store_source(distribution),))
    common = [
        name
        for package in embedded.packages.values()
        for name in package
        if name in ros.packages.get(name.package, {})
    ]
    assert len(common) > 100
    assert {str(name) for name in common if embedded.hash(name) != ros.hash(name)} == CHANGED_SINCE[
        distribution
    ]


@pytest.mark.parametrize(
    ("distribution", "name", "fields", "constants"),
    [
        (
            "kilted",
            "std_msgs/msg/Empty",
            (Field("structure_needs_at_least_one_member", BasicType("uint8")),),
            (),
        ),
        ("kilted", "std_msgs/msg/Char", (Field("data", BasicType("uint8")),), ()),
        ("kilted", "std_msgs/msg/Byte", (Field("data", BasicType("octet")),), ()),
        (
            "kilted",
            "unique_identifier_msgs/msg/UUID",
            (Field("uuid", ArrayType(BasicType("uint8"), 16)),),
            (),
        ),
        (
            "kilted",
            "shape_msgs/msg/Plane",
            (Field("coef", ArrayType(BasicType("double"), 4)),),
            (),
        ),
        (
            "noetic",
            "std_msgs/msg/Header",
            (
                Field("seq", BasicType("uint32")),
                Field("stamp", TypeName("builtin_interfaces", "msg", "Time")),
                Field("frame_id", StringType()),
            ),
            (),
        ),
        (
            "noetic",
            "actionlib_msgs/msg/GoalID",
            (Field("stamp", TypeName("builtin_interfaces", "msg", "Time")), Field("id", StringType())),
            (),
        ),
    ],
)
def test_definitions(
    distribution: str, name: str, fields: tuple[Field, ...], constants: tuple[Constant, ...]
) -> None:
    type_name = TypeName.parse(name)
    assert Catalog((store_source(distribution),)).message(type_name) == Message(type_name, fields, constants)


def test_constants() -> None:
    catalog = Catalog((store_source("kilted"),))
    constants = catalog.message(TypeName("diagnostic_msgs", "msg", "DiagnosticStatus")).constants
    assert constants == tuple(
        Constant(name, BasicType("octet"), value)
        for value, name in enumerate(("OK", "WARN", "ERROR", "STALE"))
    )


@pytest.mark.parametrize("distribution", store.distributions())
def test_what_services_and_actions_need_is_there(distribution: str) -> None:
    packages = store_source(distribution).packages
    assert {"builtin_interfaces", "service_msgs", "unique_identifier_msgs"} <= packages.keys()


def test_an_unknown_distribution() -> None:
    with pytest.raises(DefinitionError) as caught:
        store_source("melodic")
    known = ", ".join(store.distributions())
    assert str(caught.value) == f"the embedded store has no distribution 'melodic'; it has {known}"
