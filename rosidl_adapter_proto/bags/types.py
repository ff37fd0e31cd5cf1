"""The types of a recording: what its messages are in ROS and in protobuf, without generated code.

Definitions come from the recording itself. What it does not define comes from where `generate` finds definitions:
folders that the user names, what is installed, and the embedded store.
"""

from __future__ import annotations

import contextlib
from collections.abc import Hashable, Iterable
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from rosidl_adapter_proto.bags.descriptors import descriptor_set, recorded_class
from rosidl_adapter_proto.bags.model import CDR, PROTOBUF, ROS1, RecordedDefinition, Topic
from rosidl_adapter_proto.bags.warning_list import WarningList
from rosidl_adapter_proto.errors import BagError, DefinitionError, MissingDefinitionError, SchemaError
from rosidl_adapter_proto.generate.request import find_catalog
from rosidl_adapter_proto.interfaces.catalog import Catalog, interface_base
from rosidl_adapter_proto.interfaces.find import Definition, Package, store_source
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.interfaces.recorded import (
    ENCODINGS,
    ORIGIN,
    ROS1MSG,
    recorded_definitions,
    recorded_source,
    recorded_text,
    recorded_type_name,
)
from rosidl_adapter_proto.interfaces.store import distributions
from rosidl_adapter_proto.schema.pools import MessageClass
from rosidl_adapter_proto.schema.registry import Schema, TypeRegistry
from rosidl_adapter_proto.schema.typemap import type_of_proto_name
from rosidl_adapter_proto.transcode.codec import Transcoder

_KNOWN_HASH = "RIHS01_"
_NEVER_CHANGED = {TypeName("builtin_interfaces", "msg", name) for name in ("Time", "Duration")}
_ADVICE = "give the folder of its package with --include FOLDER, or the distribution it is from with --distro"


class RecordedTypes(NamedTuple):
    """What there is to generate of a recording.

    Attributes:
        definitions: The definitions in it.
        types: The types of its topics: messages, services and actions.
    """

    definitions: Package
    types: tuple[TypeName, ...]


class BagTypes:
    """Gives the schema of each topic of a recording.

    A schema is made when it is first asked for: what is wrong with a topic's type matters to nobody else. Each topic
    has its own definitions, since those of a merged recording may differ. Where they are the ones that are installed,
    its protobuf classes are those of generated code (`TypeRegistry`).

    Attributes:
        warnings: What is odd about the types that were asked for, for people.

    Args:
        topics: The topics of the recording.
        include: Folders that have what the recording does not define.
        distro: The distribution of the embedded store.
        elsewhere: What `include` and `distro` stand for, if it was found before: finding it takes long.

    Raises:
        DefinitionError: A folder has no definitions, or the store does not have the distribution.
        RequestError: There is no such folder.
    """

    def __init__(
        self,
        topics: Iterable[Topic],
        include: Iterable[Path] = (),
        distro: str | None = None,
        elsewhere: Catalog | None = None,
    ) -> None:
        self.warnings = WarningList()
        self._elsewhere = elsewhere or find_catalog(include, distro)
        self._schemas: dict[Hashable, Schema] = {}
        self._topics = tuple(topics)

    def schema(self, topic: Topic) -> Schema:
        """Return the schema of a topic.

        Of a protobuf topic, `message_class` is that of the recording, whose numbers may be others than those in
        `message` and `file`.

        Raises:
            BagError: There is no definition of its type, or only of another version than it was recorded with, or it is
                not valid; or the messages are protobuf ones without a ROS type, or with a descriptor that is not valid.
        """
        key = _key(topic)
        if key not in self._schemas:
            self._schemas[key] = self._schema(topic)
        return self._schemas[key]

    def message_class(self, topic: Topic) -> MessageClass:
        """Return the protobuf class of the messages of a topic; a protobuf topic needs no ROS type for that.

        Raises:
            BagError: As for `schema`.
        """
        if topic.serialization_format != PROTOBUF:
            return self.schema(topic).message_class
        with contextlib.suppress(BagError):
            return self.schema(topic).message_class
        try:
            return _recorded_class(topic)
        except BagError as error:
            raise _problem(topic, error) from None

    def origin(self, topic: Topic) -> str:
        """Return where the definition of a topic's type comes from, for people; errors are those of `schema`."""
        return ", ".join(dict.fromkeys(each.origin for each in _definitions_of(self.schema(topic))))

    def ros_definition(self, topic: Topic) -> RecordedDefinition:
        """Return the ROS definition of a topic's type: that of the recording as it is, if there is one."""
        recorded = _recorded(topic)
        return recorded if self._definitions(topic) else ros_definition(self.schema(topic))

    def recorded_types(self) -> RecordedTypes:
        """Return what there is to generate of the recording; protobuf messages that are no ROS types are left out.

        Raises:
            BagError: Two topics have other definitions of the same type; or, of a topic, as for `schema`.
        """
        known: dict[TypeName, tuple[Definition, str]] = {}
        types: dict[TypeName, None] = {}
        for topic in self._topics:
            if not _is_ros_type(topic):
                continue
            schema = self.schema(topic)
            types[interface_base(TypeName.parse(schema.type_name))] = None
            for name, definition in self._definitions(topic).items():
                other, user = known.setdefault(name, (definition, topic.name))
                if not _is_same(definition, other):
                    raise BagError(
                        f"{name} is not the same in topics {user} and {topic.name}: code can only have one version"
                    )
        return RecordedTypes({name: each for name, (each, _) in known.items()}, tuple(types))

    def _schema(self, topic: Topic) -> Schema:
        try:
            name = _ros_type(topic)
            own = self._definitions(topic)
            schema = self._registry(name, own)[name]
            if (
                name not in own
                and topic.type_hash.startswith(_KNOWN_HASH)
                and schema.type_hash != topic.type_hash
            ):
                schema = _of_its_version(topic, name) or schema
            self._check_version(topic, schema, own)
            return self._with_recorded_class(schema, topic)
        except MissingDefinitionError as error:
            raise _problem(topic, f"{error}; {_ADVICE}") from None
        except (BagError, DefinitionError, SchemaError) as error:
            raise _problem(topic, error) from None

    def _check_version(self, topic: Topic, schema: Schema, own: Package) -> None:
        """Compare a definition with the version that was recorded: with another one, all data would be wrong."""
        foreign = [each for each in _definitions_of(schema) if each.name not in own]
        origins = ", ".join(f"{each.name} from {each.origin}" for each in foreign)
        if not topic.type_hash.startswith(_KNOWN_HASH):
            if any(each.origin != ORIGIN for each in foreign):
                self.warnings.add(
                    f"{schema.type_name}: the recording neither defines all of it nor says which version it has: "
                    f"{origins}"
                )
        elif schema.type_hash != topic.type_hash:
            difference = f"was recorded with the type hash {topic.type_hash}, but has {schema.type_hash}"
            if foreign:
                raise BagError(f"it {difference} with {origins}: {_ADVICE}")
            self.warnings.add(
                f"{schema.type_name} {difference} with the definition in the recording, which is used"
            )

    def _with_recorded_class(self, schema: Schema, topic: Topic) -> Schema:
        """Return a schema whose class is that of the recording: the same one, if descriptors are the same."""
        if topic.serialization_format != PROTOBUF or topic.definition == protobuf_definition(schema):
            return schema
        if topic.definition == RecordedDefinition(PROTOBUF, descriptor_set(schema.descriptor)):
            return schema  # others, such as earlier versions of this, do not tell what is only of ROS
        if topic.definition.encoding != PROTOBUF:
            self.warnings.add(
                f"{schema.type_name}: the recording has no protobuf descriptor; the one that `generate` makes is used"
            )
            return schema
        recorded = replace(schema, _message_class=_recorded_class(topic))
        try:
            Transcoder(recorded.type_description, recorded.descriptor)
        except SchemaError as error:
            what = str(error).partition(";")[0]
            raise BagError(
                f"its protobuf descriptor does not fit its ROS definition: {what}; --include FOLDER gives another one"
            ) from None
        return recorded

    def _definitions(self, topic: Topic) -> Package:
        """Return the definitions that the recording has for a topic; none if it has none that could be read."""
        name = _ros_type(topic)
        definitions = _recorded_definitions(topic, name)
        is_blank = not _recorded(topic).data.strip()
        return {} if is_blank and not self._is_empty_message(topic, name, definitions) else definitions

    def _is_empty_message(self, topic: Topic, name: TypeName, definitions: Package) -> bool:
        """Tell whether a text without fields is the definition of a message without fields, or only left out."""
        if definitions and topic.type_hash.startswith(_KNOWN_HASH):
            return Catalog((recorded_source(definitions),)).hash(name) == topic.type_hash
        return interface_base(name) not in self._elsewhere.packages.get(name.package, {})

    @cached_property
    def _all_definitions(self) -> Package:
        """The definitions of ROS 2 of all topics; what is not valid is left out, and told where it is asked for."""
        found: dict[TypeName, Definition] = {}
        for topic in self._topics:
            if _recorded(topic).encoding == ROS1MSG:  # types of ROS 1 may have the names of others in ROS 2
                continue
            with contextlib.suppress(BagError, DefinitionError):
                found = {**self._definitions(topic), **found}
        return found

    def _registry(self, name: TypeName, own: Package) -> TypeRegistry:
        """Return the registry of a type with its own definitions, or with those of other topics if it has none."""
        definitions = own or (self._all_definitions if interface_base(name) in self._all_definitions else {})
        catalog = Catalog((recorded_source(definitions), *self._elsewhere.sources))
        is_event = name.namespace != "msg" and name.name.endswith("_Event")
        return TypeRegistry(catalog, events=is_event)


def _of_its_version(topic: Topic, name: TypeName) -> Schema | None:
    """Return a type as it is in the distribution of ROS where it has the hash it was recorded with, if there is one."""
    for distribution in distributions():
        catalog = Catalog((store_source(distribution),))
        with contextlib.suppress(DefinitionError):
            if catalog.hash(name) == topic.type_hash:
                return TypeRegistry(catalog)[name]
    return None


def protobuf_definition(schema: Schema) -> RecordedDefinition:
    """Return the descriptor of a message as recordings have it: its file and all that it imports."""
    return RecordedDefinition(PROTOBUF, descriptor_set(schema.descriptor, schema.type_description))


def ros_definition(schema: Schema) -> RecordedDefinition:
    """Return the ROS definition of a type and of all that it refers to, as recordings have it."""
    return RecordedDefinition(*recorded_text(schema.registry.definitions(schema.type_name)))


def _problem(topic: Topic, reason: object) -> BagError:
    return BagError(f"topic {topic.name} ({topic.type_name or topic.schema_name}): {reason}")


def _is_same(one: Definition, other: Definition) -> bool:
    return (one.text, one.format, one.dialect) == (other.text, other.format, other.dialect)


def _key(topic: Topic) -> Hashable:
    """Return all of a topic that decides its schema."""
    return (
        topic.type_name,
        topic.serialization_format,
        topic.definition,
        topic.ros_definition,
        topic.schema_name,
        topic.type_hash,
    )


def _recorded(topic: Topic) -> RecordedDefinition:
    """Return the ROS definition that the recording has for a topic, wherever: its format may be what the user says."""
    both = (topic.definition, topic.ros_definition)
    return next((each for each in both if each.encoding in ENCODINGS), RecordedDefinition())


def _recorded_definitions(topic: Topic, name: TypeName) -> Package:
    recorded = _recorded(topic)
    if recorded.encoding not in ENCODINGS:  # unknown, as rosbag2 says where it has found none
        return {}
    return recorded_definitions(
        recorded.data, recorded.encoding, str(name), f"definition of topic {topic.name}"
    )


def _definitions_of(schema: Schema) -> list[Definition]:
    """Return the definitions that a type is made of, but those that are the same in every version of ROS."""
    definitions = schema.registry.definitions(schema.type_name)
    return [each for name, each in definitions.items() if name not in _NEVER_CHANGED] or [
        *definitions.values()
    ]


def _ros_type(topic: Topic) -> TypeName:
    """Return the ROS type of a topic.

    Raises:
        BagError: It has none.
    """
    if not _is_ros_type(topic) and topic.serialization_format != PROTOBUF:
        raise BagError(f"its messages are {topic.serialization_format} of no ROS type: they cannot be read")
    if topic.serialization_format != PROTOBUF or "/" in topic.type_name:
        return recorded_type_name(topic.type_name)
    name = type_of_proto_name(topic.schema_name)
    if name is None:
        raise BagError(
            "its messages are protobuf messages of no ROS type: they can be read, but not converted"
        )
    return name


def _is_ros_type(topic: Topic) -> bool:
    """Tell whether a topic has a ROS type, as all of those have that ROS itself has serialized."""
    is_ros = "/" in topic.type_name or topic.serialization_format in (CDR, ROS1)
    return is_ros or type_of_proto_name(topic.schema_name) is not None


def _recorded_class(topic: Topic) -> MessageClass:
    """Return the class of the messages of a protobuf topic.

    Raises:
        BagError: The recording has no descriptor, or one that is not valid.
    """
    if topic.definition.encoding != PROTOBUF or not topic.definition.data:
        raise BagError(f"the recording has no protobuf descriptor of {topic.schema_name or topic.type_name}")
    return recorded_class(topic.definition.data, topic.schema_name)
