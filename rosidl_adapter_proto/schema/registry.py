"""Types at run time: ROS types and their protobuf classes, made from definitions without generated code.

Names, field numbers and descriptors are those that generated code has. Where the process holds generated code of the
same version of a type, its protobuf class is the same one.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from threading import RLock

from google.protobuf.descriptor import Descriptor, FileDescriptor
from google.protobuf.descriptor_pool import DescriptorPool

from rosidl_adapter_proto.errors import DefinitionError, SchemaError
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.closure import type_closure
from rosidl_adapter_proto.interfaces.description import TypeDescription, type_hash
from rosidl_adapter_proto.interfaces.find import (
    Definition,
    folder_source,
    installed_sources,
    prefixes,
    text_source,
)
from rosidl_adapter_proto.interfaces.model import Interface, ScalarValue, TypeName, parts
from rosidl_adapter_proto.schema import pools
from rosidl_adapter_proto.schema.descriptor import file_descriptor
from rosidl_adapter_proto.schema.numbering import HashNumbering, Numbering, SequentialNumbering
from rosidl_adapter_proto.schema.pools import File, MessageClass, message_class
from rosidl_adapter_proto.schema.proto import ProtoFile, ProtoMessage, check_names, check_nesting, proto_file
from rosidl_adapter_proto.schema.typemap import DEFAULT_PYTHON_ROOT


@dataclass(frozen=True, eq=False)
class Schema:
    """One type, as ROS and protobuf have it.

    A message has a protobuf class. A service and an action have parts instead, each with a schema of its own:
    `request` and `response`, or `goal`, `result`, `feedback`, `send_goal`, `get_result` and `feedback_message`.

    Attributes:
        type_name: Its ROS name, such as `sensor_msgs/msg/Imu`.
        type_hash: Its RIHS01 hash (REP-2011).
        type_description: Itself and everything that it refers to (REP-2011).
        file: The `.proto` file that it is in.
        message: The protobuf message, as plain data; None for a service or an action.
        parts: The parts of a service or an action by their names; empty for a message.
        registry: A registry whose classes are in the same descriptor pool: what a field refers to is in it. It is the
            one that was asked, but for what this says of code that comes later.
    """

    type_name: str
    type_hash: str
    type_description: TypeDescription = field(repr=False)
    registry: TypeRegistry = field(repr=False)
    file: ProtoFile = field(repr=False)
    message: ProtoMessage | None = field(repr=False, default=None)
    parts: Mapping[str, Schema] = field(repr=False, default_factory=dict)
    _message_class: MessageClass | None = field(repr=False, default=None)

    @property
    def message_class(self) -> MessageClass:
        """The protobuf class of a message.

        Raises:
            SchemaError: It is a service or an action.
        """
        if self._message_class is None:
            raise SchemaError(
                f"{self.type_name} is no message and has no protobuf class; take that of a part: "
                f"{', '.join(self.parts)}"
            )
        return self._message_class

    @property
    def descriptor(self) -> Descriptor:
        """The protobuf descriptor of a message; errors are those of `message_class`."""
        return self.message_class.DESCRIPTOR  # type: ignore[return-value, unused-ignore]  # upb's is like it

    @property
    def constants(self) -> Mapping[str, ScalarValue]:
        """The constants of a message by their names; a service and an action have none."""
        return {each.name: each.value for each in self.message.constants} if self.message else {}

    @property
    def request(self) -> Schema:
        """The request of a service."""
        return self._part("request")

    @property
    def response(self) -> Schema:
        """The response of a service."""
        return self._part("response")

    @property
    def goal(self) -> Schema:
        """The goal of an action."""
        return self._part("goal")

    @property
    def result(self) -> Schema:
        """The result of an action."""
        return self._part("result")

    @property
    def feedback(self) -> Schema:
        """The feedback of an action."""
        return self._part("feedback")

    @property
    def send_goal(self) -> Schema:
        """The service of an action that sends a goal."""
        return self._part("send_goal")

    @property
    def get_result(self) -> Schema:
        """The service of an action that waits for the result of a goal."""
        return self._part("get_result")

    @property
    def feedback_message(self) -> Schema:
        """The message of the feedback topic of an action."""
        return self._part("feedback_message")

    def _part(self, name: str) -> Schema:
        if name not in self.parts:
            known = f"its parts are {', '.join(self.parts)}" if self.parts else "it is a message"
            raise SchemaError(f"{self.type_name} has no {name}: {known}")
        return self.parts[name]


class TypeRegistry:
    """Gives the schema of any type by its ROS name, such as `registry["sensor_msgs/msg/Imu"]`.

    A schema is made when it is first asked for, together with what it refers to, and is the same object from then on.
    Parts of services and actions have names too, such as `std_srvs/srv/SetBool_Request`. A registry can be used from
    many threads.

    Protobuf classes are those of generated code, which is imported where it is found, or are in the same descriptor
    pool. A registry that has another version of a type has a pool of its own instead, and all its classes are in that:
    another version than generated code has, than what is installed, or than an earlier registry. Which it is is decided
    when a type is first asked for; all definitions that are not installed ones count.

    What is installed is not read as a whole for that. If generated code of another version is found or imported later,
    types that refer to it, and what is in them, come from a second registry beside this one (`Schema.registry`).

    Args:
        catalog: Where definitions come from: by default what is installed (`AMENT_PREFIX_PATH` and the environment of
            this Python), and the embedded store.
        lock_file: Where sequential field numbers are kept, which `rosidl-proto generate` has written and which is
            only read here; without it, numbers are hashes of the names.
        events: Whether services have their `_Event` messages, as in code generated with `--events`.
        python_root: The namespace package of generated code, as in code generated with `--python-root`.

    Raises:
        DefinitionError: Definitions cannot be found.
        SchemaError: The lock file cannot be read or is damaged.
    """

    def __init__(
        self,
        catalog: Catalog | None = None,
        *,
        lock_file: Path | str | None = None,
        events: bool = False,
        python_root: str = DEFAULT_PYTHON_ROOT,
    ) -> None:
        if catalog is None:
            catalog = self._installed = Catalog(tuple(installed_sources()))
        self._catalog = catalog
        self._lock_text = None if lock_file is None else _lock_text(lock_file)
        self._numbering = _numbering(lock_file, self._lock_text)
        self._events = events
        self._python_root = python_root
        self._pool: DescriptorPool | None = None
        self._lock = RLock()
        self._files: dict[TypeName, File] = {}
        self._schemas: dict[TypeName, Schema] = {}

    @classmethod
    def from_folders(
        cls,
        *folders: Path | str,
        lock_file: Path | str | None = None,
        events: bool = False,
        python_root: str = DEFAULT_PYTHON_ROOT,
    ) -> TypeRegistry:
        """Return a registry of the packages in some folders; what they do not have is what is installed.

        Args:
            folders: Package folders, or folders that have package folders at any depth; the first that has a package
                wins.
            lock_file: As for a registry.
            events: As for a registry.
            python_root: As for a registry.

        Raises:
            DefinitionError: A folder has no definitions.
            SchemaError: The lock file cannot be read or is damaged.
        """
        sources = (*(folder_source(Path(each)) for each in folders), *installed_sources())
        return cls(Catalog(sources), lock_file=lock_file, events=events, python_root=python_root)

    @classmethod
    def from_texts(
        cls,
        texts: Mapping[str, str],
        *,
        lock_file: Path | str | None = None,
        events: bool = False,
        python_root: str = DEFAULT_PYTHON_ROOT,
    ) -> TypeRegistry:
        """Return a registry of types that are given as text; what the texts do not have is what is installed.

        Args:
            texts: Definitions in the form of `.msg`, `.srv` and `.action` files, by the names of their types.
            lock_file: As for a registry.
            events: As for a registry.
            python_root: As for a registry.

        Raises:
            DefinitionError: A name is not of the form `package/namespace/Name`.
            SchemaError: The lock file cannot be read or is damaged.
            TypeError: The texts are no mapping, or one of them is no text.
        """
        if not isinstance(texts, Mapping):
            raise TypeError(
                "texts must be a mapping from type names to definitions, such as "
                f"{{'my_msgs/msg/Track': 'float64 x'}}, not {type(texts).__name__}"
            )
        for name, text in texts.items():
            if not isinstance(text, str):
                raise TypeError(f"the definition of {name!r} must be a text, not {type(text).__name__}")
        given = text_source({_parsed(name): text for name, text in texts.items()})
        return cls(
            Catalog((given, *installed_sources())),
            lock_file=lock_file,
            events=events,
            python_root=python_root,
        )

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a definition of a type; it may still turn out not to be valid."""
        try:
            type_name = name if isinstance(name, TypeName) else _parsed(str(name))
            return self._catalog.owner(type_name) is not None
        except DefinitionError:
            return False

    def __iter__(self) -> Iterator[str]:
        """Yield the name of every interface; parts of services and actions are not among them."""
        return (str(name) for package in self._catalog.packages.values() for name in package)

    def __getitem__(self, name: str | TypeName) -> Schema:
        """Return the schema of a type.

        Raises:
            DefinitionError: There is no such type (the message names similar ones), something that it refers to is
                missing, or a definition is not valid.
            SchemaError: A type cannot be mapped to protobuf, or the lock file disagrees with it or does not have it.
            TypeError: The name is no text.
        """
        type_name = name if isinstance(name, TypeName) else _parsed(name, self._catalog)
        with self._lock:
            if type_name not in self._schemas:
                self._schemas[type_name] = self._schema(type_name)
            return self._schemas[type_name]

    def definitions(self, name: str | TypeName) -> Mapping[TypeName, Definition]:
        """Return the definitions that a type is made of: its own, and those of all that it refers to.

        Args:
            name: The type; a part of a service or an action has the definition of the whole.

        Raises:
            DefinitionError: As for the schema of the type.
        """
        type_name = name if isinstance(name, TypeName) else _parsed(name, self._catalog)
        names = type_closure(self._catalog, type_name, events=self._events)
        return {each: self._catalog.definition(each) for each in reversed(names)}

    def _schema(self, name: TypeName) -> Schema:
        owner = self._catalog.definition_name(name)
        files = self._with_imports(owner)
        file = files[-1].proto
        message = next((each for each in file.messages if each.type_name == name), None)
        group = parts(file.source).get(name, {})
        if message is None and not group:
            raise DefinitionError(f"{name} is the event of a service: it needs a registry with events=True")
        descriptor = self._load(files)
        if descriptor is None:
            return self._beside[name]
        made = None
        if message is not None:
            made = message_class(descriptor.message_types_by_name[name.name], owner, self._python_root)
        description = self._catalog.describe(name)
        return Schema(
            str(name),
            type_hash(description),
            description,
            self,
            file,
            message,
            {part: self[part_name] for part, part_name in group.items()},
            made,
        )

    def _with_imports(self, name: TypeName) -> list[File]:
        """Return the file of an interface behind those that it imports."""
        names = type_closure(self._catalog, name, events=self._events)
        new = {each: self._file(each) for each in names if each not in self._files}
        check_names(each.proto for each in (*self._files.values(), *new.values()))
        found = [(new.get(each) or self._files[each]) for each in names]
        check_nesting(each.proto for each in found)
        self._files.update(new)
        return found

    def _load(self, files: Sequence[File]) -> FileDescriptor | None:
        """Return the last of some files in the pool of this registry; None if that cannot have them."""
        default = pools.default_pool()
        with pools.lock:
            if self._pool is None:
                self._pool = self._chosen_pool(files)
            if self._pool is default and not self._may_share(files):
                return None
            try:
                return pools.load(self._pool, files, self._python_root)
            except pools.RefusedError as error:
                if self._pool is default:
                    return None
                name = files[-1].interface
                raise SchemaError(f"{name}: protobuf does not take what it becomes: {error}") from None

    def _chosen_pool(self, files: Sequence[File]) -> DescriptorPool:
        """Return the default pool if it can have the first files and all that was given, else one for this registry."""
        default = pools.default_pool()
        if not self._may_share(files) or any(self._is_other_version(each.name) for each in self._given):
            return self._own_pool()
        try:
            pools.load(default, files, self._python_root)
        except pools.RefusedError:  # a message of that name is in another file
            return self._own_pool()
        if not self._has_options:
            for each in self._given:
                pools.promise(each.name, _text(each))
        return default

    def _own_pool(self) -> DescriptorPool:
        """Return the pool of registries that are given the same."""
        given = sorted((str(each.name), each.format, each.dialect.name, _text(each)) for each in self._given)
        origins = tuple(each.origin for each in self._catalog.sources)
        return pools.own_pool((tuple(given), origins, self._events, self._lock_text, self._python_root))

    def _may_share(self, files: Sequence[File]) -> bool:
        """Tell whether the default pool has some files, or may get them."""
        for each in files:  # generated code could not be imported where another version of what it needs is
            found = pools.in_default_pool(each.interface)
            if found is not None and found.serialized_pb != each.serialized:
                return False
        if any(self._is_other_version(each.interface) for each in files):
            return False
        # Files with events or other numbers are only there if generated code is the same: others may come without.
        return not self._has_options or all(pools.in_default_pool(each.interface) for each in files)

    def _is_other_version(self, name: TypeName) -> bool:
        """Tell whether a file is another one than generated code has or, without it, will have.

        Where a definition is not valid, that is said when somebody asks for it: it is no version of anything.
        """
        try:
            if pools.in_default_pool(name) is None:
                pools.import_generated_code(name, self._python_root)
            if (there := pools.in_default_pool(name)) is not None:
                return there.serialized_pb != self._file(name).serialized
            definition = self._catalog.definition(name)
            if self._has_options:
                return False
            if pools.is_promised_otherwise(name, definition.text):
                return True
            installed = self._installed.packages.get(name.package, {}).get(name)
            if installed is None or installed.text == definition.text:
                return False
            return self._file_of(installed.interface).serialized != self._file(name).serialized
        except (DefinitionError, SchemaError):
            return False

    @cached_property
    def _given(self) -> Sequence[Definition]:
        """The definitions that are not installed ones; all, if files are other ones than generated code has."""
        installed = set() if self._has_options else {each.origin for each in self._installed.sources}
        packages = dict.fromkeys(
            name
            for source in self._catalog.sources
            if source.origin not in installed
            for name in source.packages
        )
        found = (each for name in packages for each in self._catalog.packages[name].values())
        return [each for each in found if each.origin not in installed]

    @cached_property
    def _installed(self) -> Catalog:
        return _installed(tuple(prefixes()), os.environ.get("ROS_DISTRO"))

    @cached_property
    def _beside(self) -> TypeRegistry:
        """The registry of types that the default pool cannot have since other generated code came into it."""
        beside = TypeRegistry(self._catalog, events=self._events, python_root=self._python_root)
        beside._lock, beside._numbering, beside._lock_text = self._lock, self._numbering, self._lock_text
        beside._pool = self._own_pool()
        return beside

    @property
    def _has_options(self) -> bool:
        """Whether files are other ones than generated code has by default."""
        return self._events or self._lock_text is not None

    def _file(self, name: TypeName) -> File:
        return self._files.get(name) or self._file_of(self._catalog.definition(name).interface)

    def _file_of(self, interface: Interface) -> File:
        proto = proto_file(interface, self._numbering, self._catalog.definition_name, events=self._events)
        return File(proto, file_descriptor(proto).SerializeToString(deterministic=True))


def _lock_text(lock_file: Path | str) -> str:
    try:
        return Path(lock_file).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SchemaError(f"cannot read {lock_file}: {error}") from None


def _numbering(lock_file: Path | str | None, text: str | None) -> Numbering:
    if text is None:
        return HashNumbering()
    return SequentialNumbering.from_lock(str(lock_file), text, is_complete=True)


@lru_cache(maxsize=1)
def _installed(prefixes: tuple[Path, ...], distribution: str | None) -> Catalog:
    """Return what is installed, which takes long to find, for as long as that is looked for in the same places."""
    return Catalog(tuple(installed_sources()))


def _text(definition: Definition) -> str:
    try:
        return definition.text
    except DefinitionError as error:  # it is no version of anything
        return str(error)


def _parsed(name: str, catalog: Catalog | None = None) -> TypeName:
    """Return the type of a name; of the short form `package/Name`, the error has what the catalog has of that name."""
    if not isinstance(name, str):
        raise TypeError(
            f"the name of a type must be a text, such as 'sensor_msgs/msg/Imu', not {type(name).__name__}"
        )
    try:
        return TypeName.parse(name)
    except ValueError as error:
        package, _, rest = name.partition("/")
        known = catalog.packages.get(package, {}) if catalog else {}
        full = " or ".join(str(each) for each in known if each.name == rest)
        raise DefinitionError(f"{error}; did you mean {full}?" if full else str(error)) from None
