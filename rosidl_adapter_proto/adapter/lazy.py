"""What adapters have from the moment it is first asked for: their ROS class and their codec."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

from rosidl_adapter_proto.adapter.contract import is_generated
from rosidl_adapter_proto.errors import Error

if TYPE_CHECKING:
    from rosidl_adapter_proto.adapter.base import TypeAdapter
    from rosidl_adapter_proto.transcode.codec import Codec, Transcoder

CONVERSIONS = (
    "convert_to_ros_message",
    "convert_to_custom",
    "fill_ros_message",
    "fill_custom",
    "to_cdr",
    "from_cdr",
)
"""The methods of an adapter that a codec does the work of, or takes the place of."""


class RosNotFoundError(Error, ImportError):
    """A ROS message class is needed, but its package cannot be imported."""


class _Lazy:
    """An attribute of a class that is made when it is first asked for, and from then on is what was made."""

    def __init__(self, make: Callable[[Any], Any]) -> None:
        self.make = make

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: object, owner: Any) -> Any:
        made = self.make(owner)
        setattr(owner, self.name, made)
        return made


def lazy(make: Callable[[Any], Any]) -> Any:
    """Return an attribute of a class that `make` makes of the class; for type checkers it is what is made."""
    return _Lazy(make)


class LazyAttributes:
    """The base of classes with lazy attributes.

    A class that derives from one of them makes its own, since its types and conversions can be others.
    """

    _lazy_attributes: ClassVar[dict[str, _Lazy]] = {}

    def __init_subclass__(cls, **arguments: Any) -> None:
        """Take what was made for the classes that this one derives from as not yet made."""
        super().__init_subclass__(**arguments)
        own = {name: value for name, value in vars(cls).items() if isinstance(value, _Lazy)}
        cls._lazy_attributes = {**cls._lazy_attributes, **own}
        for name, attribute in cls._lazy_attributes.items():
            if name not in vars(cls):
                setattr(cls, name, attribute)


def find_ros_class(adapter: Any) -> Any:
    """Import the ROS class of an adapter.

    Raises:
        RosNotFoundError: It cannot be imported.
    """
    module_name, _, path = adapter.ros_class.partition(":")
    found = import_of_ros(module_name, adapter)
    for name in path.split("."):
        try:
            found = getattr(found, name)
        except AttributeError:
            raise RosNotFoundError(
                f"{name_of(adapter)}: {module_name} has no {path}; "
                "the installed ROS package is of another version than the generated adapter"
            ) from None
    return found


def import_of_ros(module_name: str, adapter: Any) -> Any:
    """Import a module of ROS that an adapter needs.

    Raises:
        RosNotFoundError: It cannot be imported.
    """
    try:
        return importlib.import_module(module_name)
    except ImportError as error:
        raise RosNotFoundError(
            f"{name_of(adapter)}: cannot import {module_name} ({error}); "
            "source a ROS 2 installation that has it, or install it with pip"
        ) from error


def name_of(adapter: Any) -> str:
    """Return the ROS name of what an adapter converts; one that was written by hand may not say it."""
    return getattr(adapter, "type_name", None) or str(adapter.__qualname__)


def make_codec(adapter: type[TypeAdapter[Any, Any]]) -> Codec[Any] | None:
    """Make the codec of an adapter: none if a conversion was written by hand, of which a codec knows nothing."""
    if not all(is_generated(getattr(adapter, name)) for name in CONVERSIONS):
        return None
    from rosidl_adapter_proto.transcode.codec import Codec

    return Codec(adapter.type_description(), adapter.custom_type)


def take_transcoder(adapter: type[TypeAdapter[Any, Any]]) -> Transcoder | None:
    """Return the transcoder of an adapter's codec, if it has one."""
    return None if adapter.codec is None else adapter.codec.transcoder
