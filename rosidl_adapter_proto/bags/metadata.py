"""metadata.yaml: what rosbag2 says about a bag, in every version since 1.

The fields and the version in which each came are those of rosbag2's own reader (`rosbag2_storage/yaml.hpp`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import PurePosixPath

from rosidl_adapter_proto.bags.model import Topic
from rosidl_adapter_proto.bags.qos import numbered_qos, qos_text
from rosidl_adapter_proto.bags.yaml_text import Node, read_yaml
from rosidl_adapter_proto.errors import BagError

METADATA_FILE = "metadata.yaml"
NEWEST_VERSION = 9
WRITTEN_VERSION = 8
"""What is written: version 9 has nothing that 8 has not, and rosbag2 of Humble and Iron cannot read it."""

ROSBAG2 = "rosbag2"
SERIALIZED_METADATA = "serialized_metadata"
"""What a storage calls the metadata that rosbag2 keeps inside it, and the one value of that."""

MAXIMUM_SIZE = 16 * 2**20
"""The largest metadata.yaml that is read, in bytes."""

_ROOT = "rosbag2_bagfile_information"


@dataclass(frozen=True)
class TopicInformation:
    """A topic of a bag, and how many messages it has."""

    topic: Topic
    message_count: int


@dataclass(frozen=True)
class FileInformation:
    """A file of a bag. Times are in nanoseconds since 1970, durations in nanoseconds."""

    path: str
    start_time: int
    duration: int
    message_count: int


@dataclass(frozen=True)
class BagMetadata:
    """What metadata.yaml says of a bag.

    Attributes:
        storage: The name of the storage in rosbag2, such as `mcap`.
        paths: The files in the order in which they were recorded, relative to the folder of the bag, with `/`.
        topics: The topics and their counts; QoS profiles are numbers.
        files: More about the files; empty before version 5.
        start_time: When the first message was recorded, in nanoseconds since 1970.
        duration: From the first message to the last, in nanoseconds.
        message_count: The number of all messages.
        compression_format: What files or messages are compressed with by rosbag2, such as `zstd`; may be empty.
        compression_mode: `FILE` or `MESSAGE`; empty if rosbag2 compresses nothing.
        custom_data: Whatever a recorder was told to keep.
        ros_distro: The ROS distribution that recorded it, such as `jazzy`; empty if unknown.
        version: The version of metadata.yaml that said this.
    """

    storage: str
    paths: tuple[str, ...]
    topics: tuple[TopicInformation, ...] = ()
    files: tuple[FileInformation, ...] = ()
    start_time: int = 0
    duration: int = 0
    message_count: int = 0
    compression_format: str = ""
    compression_mode: str = ""
    custom_data: Mapping[str, str] = field(default_factory=dict)
    ros_distro: str = ""
    version: int = WRITTEN_VERSION

    @property
    def compresses_messages(self) -> bool:
        """Whether each message is compressed by itself."""
        return self.compression_mode == "MESSAGE"


def read_metadata(data: bytes, path: str) -> BagMetadata:
    """Return what metadata.yaml says, or the text inside a file of a bag, which has the same form.

    Args:
        data: Its content.
        path: The file, for people.

    Raises:
        BagError: It is no metadata of a version that is known here; the message says where it is wrong.
    """
    if len(data) > MAXIMUM_SIZE:
        raise BagError(f"{path}: too large for metadata of a bag: more than {MAXIMUM_SIZE} bytes")
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        raise BagError(f"{path}: not UTF-8 at byte {error.start}") from None
    root = _Mapping(read_yaml(text, path), path, "")
    # The text in a storage file is not wrapped, that of metadata.yaml is.
    return _metadata(root.mapping(_ROOT) if _ROOT in root.values else root)


def write_metadata(metadata: BagMetadata) -> str:
    """Return the text of metadata.yaml, in version 8."""
    return _dump({_ROOT: _values(metadata)})


def write_inner_metadata(metadata: BagMetadata) -> str:
    """Return the text that a storage keeps inside its file: what `write_metadata` gives, without its outermost name."""
    return _dump(_values(metadata))


class _Mapping:
    """A mapping of the text, whose values are taken by name, with errors that say where they stand."""

    def __init__(self, node: Node, path: str, place: str) -> None:
        self.path = path
        self.place = place
        if not isinstance(node, dict):
            raise BagError(f"{path}: {place or 'the text'}: expected names and values")
        self.values = node

    def error(self, name: str, reason: str) -> BagError:
        return BagError(f"{self.path}: {self.where(name)}: {reason}")

    def where(self, name: str) -> str:
        return f"{self.place}.{name}" if self.place else name

    def value(self, name: str) -> Node:
        if name not in self.values:
            raise self.error(name, "missing")
        return self.values[name]

    def mapping(self, name: str) -> _Mapping:
        return _Mapping(self.value(name), self.path, self.where(name))

    def list(self, name: str) -> list[Node]:
        value = self.value(name)
        if value in ("", "~", "null"):
            return []
        if not isinstance(value, list):
            raise self.error(name, "expected a list")
        return value

    def text(self, name: str, default: str | None = None) -> str:
        if default is not None and name not in self.values:
            return default
        value = self.value(name)
        if not isinstance(value, str):
            raise self.error(name, "expected a text")
        return value

    def integer(self, name: str, default: int | None = None) -> int:
        text = self.text(name, None if default is None else str(default))
        digits = text.removeprefix("-")
        if not (digits.isascii() and digits.isdigit() and len(digits) <= 20):
            raise self.error(name, f"expected a whole number, not {text[:40]!r}")
        return int(text)

    def nanoseconds(self, name: str, unit: str) -> int:
        return self.mapping(name).integer(unit) if name in self.values else 0


def _metadata(root: _Mapping) -> BagMetadata:
    version = root.integer("version")
    if not 1 <= version <= NEWEST_VERSION:
        known = f"1 to {NEWEST_VERSION}"
        raise root.error(
            "version", f"{version} is not known ({known}); name a file of the bag instead of its folder"
        )
    topics = root.list("topics_with_message_count")
    files = root.list("files") if version >= 5 and "files" in root.values else []
    return BagMetadata(
        version=version,
        storage=root.text("storage_identifier"),
        paths=tuple(
            _path(root, index, path, version) for index, path in enumerate(root.list("relative_file_paths"))
        ),
        topics=tuple(_topic(root, index, topic, version) for index, topic in enumerate(topics)),
        files=tuple(_file(root, index, file) for index, file in enumerate(files)),
        start_time=root.nanoseconds("starting_time", "nanoseconds_since_epoch"),
        duration=root.nanoseconds("duration", "nanoseconds"),
        message_count=root.integer("message_count", 0),
        compression_format=root.text("compression_format", ""),
        compression_mode=root.text("compression_mode", "").upper(),
        custom_data=_custom_data(root),
        ros_distro=root.text("ros_distro", ""),
    )


def _path(root: _Mapping, index: int, node: Node, version: int) -> str:
    path = (
        PurePosixPath(node.replace("\\", "/"))
        if isinstance(node, str) and "\0" not in node
        else PurePosixPath()
    )
    if not path.name:
        raise root.error(f"relative_file_paths[{index}]", "expected the name of a file")
    # Up to version 3, paths begin with the name that the folder had; files of a bag are always in its folder.
    inside = version >= 4 and not path.is_absolute() and ".." not in path.parts
    return str(path) if inside else path.name


def _topic(root: _Mapping, index: int, node: Node, version: int) -> TopicInformation:
    entry = _Mapping(node, root.path, root.where(f"topics_with_message_count[{index}]"))
    values = entry.mapping("topic_metadata")
    topic = Topic(
        name=values.text("name"),
        type_name=values.text("type"),
        serialization_format=values.text("serialization_format"),
        qos_profiles=_qos(values, version),
        type_hash=values.text("type_description_hash", ""),
    )
    return TopicInformation(topic, entry.integer("message_count", 0))


def _qos(values: _Mapping, version: int) -> str:
    name = "offered_qos_profiles"
    if name not in values.values:
        return ""
    if version < 9:
        return numbered_qos(values.text(name))
    return qos_text(values.list(name), f"{values.path}: {values.where(name)}")


def _file(root: _Mapping, index: int, node: Node) -> FileInformation:
    file = _Mapping(node, root.path, root.where(f"files[{index}]"))
    return FileInformation(
        path=file.text("path"),
        start_time=file.nanoseconds("starting_time", "nanoseconds_since_epoch"),
        duration=file.nanoseconds("duration", "nanoseconds"),
        message_count=file.integer("message_count", 0),
    )


def _custom_data(root: _Mapping) -> Mapping[str, str]:
    if root.values.get("custom_data", "~") in ("", "~", "null"):
        return {}
    custom = root.mapping("custom_data")
    return {name: custom.text(name) for name in custom.values}


def _values(metadata: BagMetadata) -> dict[str, object]:
    return {
        "version": WRITTEN_VERSION,
        "storage_identifier": metadata.storage,
        "duration": {"nanoseconds": metadata.duration},
        "starting_time": {"nanoseconds_since_epoch": metadata.start_time},
        "message_count": metadata.message_count,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": information.topic.name,
                    "type": information.topic.type_name,
                    "serialization_format": information.topic.serialization_format,
                    "offered_qos_profiles": numbered_qos(information.topic.qos_profiles),
                    "type_description_hash": information.topic.type_hash,
                },
                "message_count": information.message_count,
            }
            for information in metadata.topics
        ],
        "compression_format": metadata.compression_format,
        "compression_mode": metadata.compression_mode,
        "relative_file_paths": list(metadata.paths),
        "files": [
            {
                "path": file.path,
                "starting_time": {"nanoseconds_since_epoch": file.start_time},
                "duration": {"nanoseconds": file.duration},
                "message_count": file.message_count,
            }
            for file in metadata.files
        ],
        "custom_data": dict(metadata.custom_data),
        "ros_distro": metadata.ros_distro,
    }


def _dump(values: dict[str, object]) -> str:
    import yaml

    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # which takes a tenth of the time
    text: str = yaml.dump(values, Dumper=dumper, sort_keys=False, allow_unicode=True, width=2**31 - 1)
    return text
