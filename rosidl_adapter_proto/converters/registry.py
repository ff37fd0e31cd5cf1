"""Finds converter plugins at run time, as rosbag2's `SerializationFormatConverterFactory` does.

A plugin of the format `x` has the name `x_converter`, whoever brings it: this package, an entry point of an installed
distribution, or the program itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from rosidl_adapter_proto.converters.cdr import CdrConverter
from rosidl_adapter_proto.converters.interfaces import (
    SerializationFormatDeserializer,
    SerializationFormatSerializer,
)
from rosidl_adapter_proto.converters.protobuf import ProtobufConverter
from rosidl_adapter_proto.converters.ros1 import Ros1Deserializer
from rosidl_adapter_proto.errors import ConverterError

GROUP = "rosidl_adapter_proto.converters"
"""The group of entry points that plugins are in."""

SUFFIX = "_converter"

BUILT_IN: Mapping[str, type[Any]] = {
    "cdr": CdrConverter,
    "protobuf": ProtobufConverter,
    "ros1": Ros1Deserializer,
    "rosbag_v2": Ros1Deserializer,
}
"""What is there without any plugin, by format. MCAP says `ros1`, and rosbag2_bag_v2 `rosbag_v2`."""


@dataclass(frozen=True, eq=False)
class Plugin:
    """A class that is said to convert, and who says so. It is not imported before it is needed.

    Attributes:
        name: What it is called, such as `json_converter`.
        reference: Where the class is, such as `my_package.json:JsonConverter`.
        origin: Who brings it, for people, such as `entry point of my-package 1.0`.
        find: Imports whatever is there.
    """

    name: str
    reference: str
    origin: str
    find: Callable[[], object] = field(repr=False)

    def __str__(self) -> str:
        return f"{self.name} ({self.reference}, {self.origin})"

    @property
    def plugin_class(self) -> type[Any]:
        """The class, which is imported.

        Raises:
            ConverterError: It cannot be imported, or is no converter.
        """
        try:
            found = self.find()
        except (Exception, SystemExit) as error:  # modules of others may do anything
            raise self._broken(f"{type(error).__name__}: {error}") from error
        if not isinstance(found, type):
            raise self._broken(f"it is no class, but {type(found).__name__}")
        if not issubclass(found, (SerializationFormatSerializer, SerializationFormatDeserializer)):
            raise self._broken(
                "it is no subclass of SerializationFormatSerializer, SerializationFormatDeserializer"
                " or SerializationFormatConverter"
            )
        if missing := sorted(getattr(found, "__abstractmethods__", ())):
            raise self._broken(f"the class lacks {' and '.join(missing)}")
        return found

    def make(self) -> Any:
        """Return a new object of the class.

        Raises:
            ConverterError: There is none; the message says whose plugin it is and what is wrong.
        """
        plugin_class = self.plugin_class
        try:
            return plugin_class()
        except Exception as error:  # and so may their constructors
            raise self._broken(f"{type(error).__name__}: {error}") from error

    def _broken(self, reason: str) -> ConverterError:
        return ConverterError(f"{self} cannot be used: {reason}")


@dataclass(frozen=True)
class PluginStatus:
    """What a plugin is good for.

    Attributes:
        plugin: The plugin.
        deserializes: Whether its format is read with it.
        serializes: Whether its format is written with it.
        error: Why it cannot be used; empty if it can.
    """

    plugin: Plugin
    deserializes: bool
    serializes: bool
    error: str = ""

    @property
    def serialization_format(self) -> str:
        """The format, such as `json`."""
        return self.plugin.name.removesuffix(SUFFIX)


class ConverterRegistry:
    """Gives what reads and what writes a serialization format, by its name.

    For each direction, a class for this direction alone comes first, then one for both (rosbag2's order, where formats
    of installed middleware come last). Built-in formats have no other plugins. Two classes that could equally be
    meant, and a class that cannot be used, are errors when their format is asked for, and only then.

    A registry can be used from many threads. In another process, it has what was registered here and is installed
    there.
    """

    def __init__(self) -> None:
        self._registered: list[Plugin] = []

    def __reduce__(self) -> tuple[Callable[..., ConverterRegistry], tuple[Any, ...]]:
        return _with_registered, tuple((each.name, each.plugin_class) for each in self._registered)

    def register(
        self,
        name: str,
        plugin_class: type[SerializationFormatSerializer] | type[SerializationFormatDeserializer],
    ) -> None:
        """Add a plugin from code.

        Args:
            name: Its name, `<format>_converter`.
            plugin_class: A class of one of the three interfaces.

        Raises:
            ConverterError: The name is not of that form, or the class is no converter.
        """
        if not _is_plugin_name(name):
            raise ConverterError(f"a plugin is called <serialization format>{SUFFIX}, not {name!r}")
        plugin = _plugin(name, plugin_class, "registered")
        _ = plugin.plugin_class  # it is looked at now, where it was given
        self._registered.append(plugin)

    def load(self, reference: str) -> None:
        """Import a plugin, whose class says of which format it is, and add it.

        Args:
            reference: Where the class is, such as `my_package.json:JsonConverter`.

        Raises:
            ConverterError: It cannot be imported, is no converter, or does not name its format.
        """
        module, colon, name = reference.partition(":")
        if not (module and colon and name):
            raise ConverterError(f"plugin {reference!r} is not of the form module:Class")
        plugin = Plugin("plugin", reference, "given by name", EntryPoint("", reference, GROUP).load)
        plugin_class = plugin.plugin_class
        if not plugin_class.serialization_format:
            raise ConverterError(
                f'{plugin} does not say which format it is for; give the class serialization_format = "..."'
            )
        self.register(plugin_class.serialization_format + SUFFIX, plugin_class)

    def load_deserializer(self, serialization_format: str) -> SerializationFormatDeserializer | None:
        """Return a new object that reads a format; None if there is no such plugin.

        Raises:
            ConverterError: Several plugins could be meant, or one of the format cannot be used.
        """
        plugin = self._find(serialization_format, SerializationFormatDeserializer)
        return None if plugin is None else plugin.make()

    def load_serializer(self, serialization_format: str) -> SerializationFormatSerializer | None:
        """Return a new object that writes a format; None if there is no such plugin.

        Raises:
            ConverterError: Several plugins could be meant, or one of the format cannot be used.
        """
        plugin = self._find(serialization_format, SerializationFormatSerializer)
        return None if plugin is None else plugin.make()

    def plugins(self) -> list[PluginStatus]:
        """Return every plugin and what it is good for, by name. All of them are imported for that."""
        return [self._status(each) for each in sorted(self._plugins, key=lambda each: each.name)]

    @property
    def _plugins(self) -> Sequence[Plugin]:
        return (*_BUILT_IN, *self._installed, *self._registered)

    @cached_property
    def _installed(self) -> Sequence[Plugin]:
        found = entry_points(group=GROUP)
        return tuple(Plugin(each.name, each.value, _origin(each), each.load) for each in found)

    def _status(self, plugin: Plugin) -> PluginStatus:
        serialization_format = plugin.name.removesuffix(SUFFIX)
        try:
            if not _is_plugin_name(plugin.name):
                raise ConverterError(
                    f"{plugin} cannot be found: its name is not <serialization format>{SUFFIX}"
                )
            plugin.make()
            reads, writes = (self._find(serialization_format, each) is plugin for each in _DIRECTIONS)
        except ConverterError as error:
            return PluginStatus(plugin, False, False, str(error))
        return PluginStatus(plugin, reads, writes)

    def _find(self, serialization_format: str, interface: type[Any]) -> Plugin | None:
        """Return the plugin for one direction."""
        name = serialization_format + SUFFIX
        found = [each for each in self._plugins if each.name == name]
        if serialization_format in BUILT_IN and len(found) > 1:
            raise _ambiguous(found)
        fitting = [each for each in found if issubclass(each.plugin_class, interface)]
        for candidates in (
            [each for each in fitting if not _serves_both(each.plugin_class)],
            [each for each in fitting if _serves_both(each.plugin_class)],
        ):
            if len(candidates) > 1:
                raise _ambiguous(candidates)
            if candidates:
                return candidates[0]
        return None


def _with_registered(*plugins: tuple[str, type[Any]]) -> ConverterRegistry:
    registry = ConverterRegistry()
    for name, plugin_class in plugins:
        registry.register(name, plugin_class)
    return registry


_DIRECTIONS = (SerializationFormatDeserializer, SerializationFormatSerializer)


def _is_plugin_name(name: str) -> bool:
    return name.endswith(SUFFIX) and name != SUFFIX


def _serves_both(plugin_class: type[Any]) -> bool:
    return all(issubclass(plugin_class, each) for each in _DIRECTIONS)


def _plugin(name: str, plugin_class: type[Any], origin: str) -> Plugin:
    """Return the plugin of a class that is here already."""
    is_class = isinstance(plugin_class, type)
    reference = f"{plugin_class.__module__}:{plugin_class.__qualname__}" if is_class else repr(plugin_class)
    return Plugin(name, reference, origin, lambda: plugin_class)


_BUILT_IN = tuple(_plugin(name + SUFFIX, each, "built in") for name, each in BUILT_IN.items())


def _origin(entry_point: EntryPoint) -> str:
    distribution = entry_point.dist
    assert distribution is not None, "entry_points() finds them in distributions"
    return f"entry point of {distribution.name} {distribution.version}"


def _ambiguous(plugins: Sequence[Plugin]) -> ConverterError:
    return ConverterError(
        f"{plugins[0].name} is there more than once: "
        f"{' and '.join(f'{each.reference} ({each.origin})' for each in plugins)}; one format has one converter"
    )
