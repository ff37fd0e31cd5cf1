"""The exceptions of the project: one for each layer, all under `Error`.

A message says what is wrong, where (file, line and column, or the path of the field) and what to do.
"""

from __future__ import annotations

from typing import Any


class Error(Exception):
    """The base of every error that this project raises on purpose."""


class RequestError(Error):
    """What was asked for is not possible: an argument of a command, or a setting of a configuration, is wrong."""


class DefinitionError(Error):
    """An interface definition cannot be found, read or understood."""


class MissingDefinitionError(DefinitionError):
    """There is no definition of a type, or of one that it refers to."""


class SchemaError(Error):
    """An interface cannot be mapped to protobuf, or a lock file disagrees with it."""


class GenerateError(Error):
    """Files cannot be generated or written."""


class ConverterError(Error):
    """There is no converter for a serialization format, or what brings one is wrong."""


class BagError(Error):
    """A bag cannot be read, converted or written."""


class PluginError(Error):
    """A WebAssembly plugin cannot be built or read, breaks its contract, or fails while it runs."""


class PlaceError(Error):
    """A place on another machine, or a process, failed while a bag was read or written: another try may go well.

    It is no `BagError`, so that nobody takes a broken connection for a damaged bag.
    """


class ConversionError(Error):
    """A value does not fit the type on the other side.

    Attributes:
        type_name: The type that was being converted, such as `sensor_msgs/msg/Image`.
        field_path: Where in it, such as `header.stamp.sec` or `points[3].x`; empty for the message itself.
        reason: What is wrong there.
    """

    def __init__(self, type_name: str, field_path: str, reason: str) -> None:
        self.type_name = type_name
        self.field_path = field_path
        self.reason = reason
        super().__init__(type_name, field_path, reason)

    @property
    def where(self) -> str:
        """The type and the field in it, such as `sensor_msgs/msg/Image.header.stamp.sec`."""
        return f"{self.type_name}.{self.field_path}" if self.field_path else self.type_name

    def __str__(self) -> str:
        return f"{self.where}: {self.reason}"

    def __reduce__(self) -> tuple[type[ConversionError], tuple[Any, ...]]:
        return type(self), (self.type_name, self.field_path, self.reason)


def wrong_message(type_name: str, expected: str, found: object) -> ConversionError:
    """Return the error for an object that is not the protobuf message of a type."""
    found_class = type(found)
    descriptor = getattr(found_class, "DESCRIPTOR", None)
    other = " (of another version of the type)" if getattr(descriptor, "full_name", None) == expected else ""
    return ConversionError(
        type_name,
        "",
        f"expected a protobuf message {expected}, not {found_class.__module__}.{found_class.__qualname__}{other}",
    )
