"""Looking for plugins: rosbag2's factory tests (`test_converter_factory.cpp`), and what can be wrong."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import pytest

from rosidl_adapter_proto.converters import ConverterRegistry
from rosidl_adapter_proto.converters.registry import BUILT_IN
from rosidl_adapter_proto.errors import ConverterError
from tests.converters import plugins
from tests.converters.plugins import JsonConverter, JsonDeserializer, JsonSerializer

Installed = Callable[..., None]
HERE = "tests.converters.plugins"


# What rosbag2 tests, with its plugins `a` (both directions) and `s` (a serializer).


@pytest.fixture
def factory(installed: Installed) -> ConverterRegistry:
    installed(
        "converter-test-plugins", a_converter=f"{HERE}:JsonConverter", s_converter=f"{HERE}:JsonSerializer"
    )
    return ConverterRegistry()


def test_a_converter_plugin_is_both_deserializer_and_serializer(factory: ConverterRegistry) -> None:
    deserializer, serializer = factory.load_deserializer("a"), factory.load_serializer("a")
    assert type(deserializer) is type(serializer) is JsonConverter
    assert deserializer is not serializer


def test_nothing_if_the_plugin_does_not_exist(factory: ConverterRegistry) -> None:
    assert factory.load_deserializer("wrong_format") is None
    assert factory.load_serializer("wrong_format") is None


def test_a_serializer_plugin(factory: ConverterRegistry) -> None:
    assert type(factory.load_serializer("s")) is JsonSerializer


def test_a_serializer_plugin_is_no_deserializer(factory: ConverterRegistry) -> None:
    assert factory.load_deserializer("s") is None


# The order, and where plugins come from.


def test_the_class_for_one_direction_comes_first(installed: Installed) -> None:
    installed("both", json_converter=f"{HERE}:JsonConverter")
    installed("one", json_converter=f"{HERE}:JsonDeserializer")
    registry = ConverterRegistry()
    assert type(registry.load_deserializer("json")) is JsonDeserializer
    assert type(registry.load_serializer("json")) is JsonConverter


def test_two_classes_for_one_direction_each(installed: Installed) -> None:
    installed("reading", json_converter=f"{HERE}:JsonDeserializer")
    registry = ConverterRegistry()
    registry.register("json_converter", JsonSerializer)
    assert type(registry.load_deserializer("json")) is JsonDeserializer
    assert type(registry.load_serializer("json")) is JsonSerializer


def test_registered_plugins_belong_to_one_registry() -> None:
    registry = ConverterRegistry()
    registry.register("json_converter", JsonConverter)
    assert type(registry.load_deserializer("json")) is JsonConverter
    assert ConverterRegistry().load_deserializer("json") is None


def test_a_plugin_that_is_named() -> None:
    registry = ConverterRegistry()
    registry.load(f"{HERE}:JsonDeserializer")
    assert type(registry.load_deserializer("json")) is JsonDeserializer
    assert registry.load_serializer("json") is None


def test_a_registry_in_another_process(installed: Installed) -> None:
    registry = ConverterRegistry()
    registry.register("a_converter", JsonDeserializer)
    registry.load(f"{HERE}:JsonConverter")
    assert registry.load_deserializer("installed") is None
    installed("my-plugins", installed_converter=f"{HERE}:JsonConverter")
    there = pickle.loads(pickle.dumps(registry))
    assert type(there.load_deserializer("a")) is JsonDeserializer
    assert type(there.load_serializer("json")) is JsonConverter
    assert type(there.load_deserializer("installed")) is JsonConverter


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in(name: str) -> None:
    deserializer = ConverterRegistry().load_deserializer(name)
    assert type(deserializer) is BUILT_IN[name]


# What can be wrong.

BROKEN = {
    "no_such_module:Class": "ModuleNotFoundError: No module named 'no_such_module'",
    f"{HERE}:Absent": f"AttributeError: module '{HERE}' has no attribute 'Absent'",
    f"{HERE}:NOT_A_CLASS": "it is no class, but function",
    HERE: "it is no class, but module",
    f"{HERE}:NotAConverter": "it is no subclass of SerializationFormatSerializer, SerializationFormatDeserializer"
    " or SerializationFormatConverter",
    f"{HERE}:Unfinished": "the class lacks serialize",
    f"{HERE}:Failing": "ValueError: no licence",
    "tests.converters.leaving_plugin:Class": "SystemExit: 1",
}


@pytest.mark.parametrize("reference", BROKEN)
def test_a_broken_plugin(reference: str, installed: Installed) -> None:
    installed("my-plugins", broken_converter=reference, json_converter=f"{HERE}:JsonConverter")
    registry = ConverterRegistry()
    text = (
        f"broken_converter ({reference}, entry point of my-plugins 1.0) cannot be used: {BROKEN[reference]}"
    )

    for load in (registry.load_deserializer, registry.load_serializer):
        with pytest.raises(ConverterError) as error:
            load("broken")
        assert str(error.value) == text
    assert registry.load_deserializer("json") is not None
    assert [each.error for each in registry.plugins() if each.error] == [text]


@pytest.mark.parametrize(
    ("name", "others"),
    [
        ("json", ["JsonConverter", "JsonConverter"]),
        ("json", ["JsonDeserializer", "JsonDeserializer"]),
        ("cdr", ["JsonConverter"]),
        ("cdr", ["JsonDeserializer"]),
    ],
)
def test_a_duplicate_name(name: str, others: list[str], installed: Installed) -> None:
    places = [f"{HERE}:{each} (entry point of plugin-{number} 1.0)" for number, each in enumerate(others)]
    for number, each in enumerate(others):
        installed(f"plugin-{number}", **{f"{name}_converter": f"{HERE}:{each}"})
    if name in BUILT_IN:
        places.insert(0, "rosidl_adapter_proto.converters.cdr:CdrConverter (built in)")
    registry = ConverterRegistry()

    with pytest.raises(ConverterError) as error:
        registry.load_deserializer(name)
    text = str(error.value)
    # Entry points are found in no particular order.
    assert text.startswith(f"{name}_converter is there more than once: ")
    assert text.endswith("; one format has one converter")
    assert sorted(text.partition(": ")[2].rpartition(";")[0].split(" and ")) == sorted(places)
    assert {each.error for each in registry.plugins() if each.serialization_format == name} == {text}
    assert registry.load_deserializer("protobuf") is not None


def test_an_entry_point_of_another_name(installed: Installed) -> None:
    installed("my-plugins", json=f"{HERE}:JsonConverter", _converter=f"{HERE}:JsonConverter")
    errors = {each.plugin.name: each.error for each in ConverterRegistry().plugins() if each.error}
    assert errors == {
        name: f"{name} ({HERE}:JsonConverter, entry point of my-plugins 1.0) cannot be found: "
        "its name is not <serialization format>_converter"
        for name in ("json", "_converter")
    }


@pytest.mark.parametrize(
    ("name", "plugin_class", "text"),
    [
        ("json", JsonConverter, "a plugin is called <serialization format>_converter, not 'json'"),
        (
            "_converter",
            JsonConverter,
            "a plugin is called <serialization format>_converter, not '_converter'",
        ),
        (
            "json_converter",
            plugins.Unfinished,
            f"json_converter ({HERE}:Unfinished, registered) cannot be used: the class lacks serialize",
        ),
        (
            "json_converter",
            7,
            "json_converter (7, registered) cannot be used: it is no class, but int",
        ),
    ],
)
def test_what_cannot_be_registered(name: str, plugin_class: Any, text: str) -> None:
    with pytest.raises(ConverterError) as error:
        ConverterRegistry().register(name, plugin_class)
    assert str(error.value) == text


@pytest.mark.parametrize(
    ("reference", "text"),
    [
        ("json", "plugin 'json' is not of the form module:Class"),
        (":Json", "plugin ':Json' is not of the form module:Class"),
        (
            f"{HERE}:Nameless",
            f"plugin ({HERE}:Nameless, given by name) does not say which format it is for; "
            'give the class serialization_format = "..."',
        ),
        (
            f"{HERE}:Absent",
            f"plugin ({HERE}:Absent, given by name) cannot be used: "
            f"AttributeError: module '{HERE}' has no attribute 'Absent'",
        ),
    ],
)
def test_what_cannot_be_named(reference: str, text: str) -> None:
    with pytest.raises(ConverterError) as error:
        ConverterRegistry().load(reference)
    assert str(error.value) == text
