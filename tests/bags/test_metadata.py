"""metadata.yaml of every version, read and written, with rosbags as the oracle."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rosidl_adapter_proto.bags.metadata import (
    BagMetadata,
    FileInformation,
    TopicInformation,
    read_metadata,
    write_inner_metadata,
    write_metadata,
)
from rosidl_adapter_proto.bags.model import Topic
from rosidl_adapter_proto.bags.qos import numbered_qos
from rosidl_adapter_proto.bags.yaml_text import MAXIMUM_NODE_COUNT, read_yaml
from rosidl_adapter_proto.errors import BagError
from tests.bags.databases import NAMED_QOS, QOS, database
from tests.bags.databases import STRING_HASH as HASH


def text_of(version: int) -> str:
    """Return metadata.yaml as rosbag2 wrote it in a version."""
    quoted = QOS.replace("\n", "\\n")
    block = NAMED_QOS.replace("\n", "\n          ")
    qos = {True: f'offered_qos_profiles: "{quoted}"', False: ""}[4 <= version < 9]
    if version >= 9:
        qos = f"offered_qos_profiles:\n          {block}"
    prefix = "my_bag/" if version < 4 else ""
    lines = [
        "rosbag2_bagfile_information:",
        f"  version: {version}",
        "  storage_identifier: sqlite3",
        *(
            ["  relative_file_paths:", f"    - {prefix}my_bag_4.db3", f"    - {prefix}my_bag_5.db3"]
            if version < 4
            else []
        ),
        "  duration:",
        "    nanoseconds: 4531096768",
        "  starting_time:",
        "    nanoseconds_since_epoch: 1585866235112411371",
        "  message_count: 20",
        "  topics_with_message_count:",
        "    - topic_metadata:",
        "        name: /topic",
        "        type: std_msgs/msg/String",
        "        serialization_format: cdr",
        *([f"        {qos}"] if qos else []),
        *([f"        type_description_hash: {HASH}"] if version >= 7 else []),
        "      message_count: 20",
        *(['  compression_format: ""', '  compression_mode: ""'] if version >= 3 else []),
        *(["  relative_file_paths:", "    - my_bag_4.db3", "    - my_bag_5.db3"] if version >= 4 else []),
        *(
            [
                "  files:",
                "    - path: my_bag_4.db3",
                "      starting_time:",
                "        nanoseconds_since_epoch: 1585866235112411371",
                "      duration:",
                "        nanoseconds: 7",
                "      message_count: 12",
            ]
            if version >= 5
            else []
        ),
        *(["  custom_data: ~" if version == 6 else "  custom_data:\n    robot: r2"] if version >= 6 else []),
        *([f"  ros_distro: {'jazzy' if version >= 9 else 'iron'}"] if version >= 8 else []),
    ]
    return "\n".join(lines)


@pytest.mark.parametrize("version", range(1, 10))
def test_every_version_is_read(version: int) -> None:
    assert read_metadata(text_of(version).encode(), "metadata.yaml") == BagMetadata(
        version=version,
        storage="sqlite3",
        paths=("my_bag_4.db3", "my_bag_5.db3"),
        topics=(
            TopicInformation(
                Topic(
                    "/topic",
                    "std_msgs/msg/String",
                    "cdr",
                    qos_profiles=QOS if version >= 4 else "",
                    type_hash=HASH if version >= 7 else "",
                ),
                20,
            ),
        ),
        files=(FileInformation("my_bag_4.db3", 1585866235112411371, 7, 12),) if version >= 5 else (),
        start_time=1585866235112411371,
        duration=4531096768,
        message_count=20,
        custom_data={"robot": "r2"} if version >= 7 else {},
        ros_distro={8: "iron", 9: "jazzy"}.get(version, ""),
    )


METADATA = BagMetadata(
    storage="mcap",
    paths=("a_7.mcap", "sub folder/on.mcap"),
    topics=(
        TopicInformation(Topic("/näme: # '\"\\ 😀", "std_msgs/msg/String", "protobuf", qos_profiles=QOS), 3),
        TopicInformation(Topic("~", "null", "1e3", qos_profiles="", type_hash=HASH), 0),
    ),
    files=(FileInformation("a_7.mcap", 5, 6, 3),),
    start_time=5,
    duration=6,
    message_count=3,
    compression_format="zstd",
    compression_mode="FILE",
    custom_data={"a: b": "yes\n\x7f\u2028", "": "012"},
    ros_distro="jazzy",
)


@pytest.mark.parametrize("write", [write_metadata, write_inner_metadata])
def test_what_is_written_is_read(write: object) -> None:
    assert read_metadata(write(METADATA).encode(), "metadata.yaml") == METADATA  # type: ignore[operator]
    empty = BagMetadata("mcap", ())
    assert read_metadata(write(empty).encode(), "metadata.yaml") == empty  # type: ignore[operator]


def test_names_of_policies_are_written_as_numbers() -> None:
    named = BagMetadata(
        "mcap", (), (TopicInformation(Topic("/a", "p/msg/A", "cdr", qos_profiles=NAMED_QOS), 0),)
    )
    assert read_metadata(write_metadata(named).encode(), "metadata.yaml").topics[0].topic.qos_profiles == QOS


def test_rosbags_reads_what_is_written(tmp_path: Path) -> None:
    from rosbags.rosbag2 import Reader

    database(tmp_path / "a.db3")
    topics = tuple(
        TopicInformation(
            Topic(name, "std_msgs/msg/String", "cdr", qos_profiles=NAMED_QOS, type_hash=HASH), count
        )
        for name, count in (("/a", 27), ("/b", 13))
    )
    files = (FileInformation("a.db3", 965, 400, 40),)
    metadata = BagMetadata("sqlite3", ("a.db3",), topics, files, 965, 400, 40, custom_data={"robot": "r2"})
    (tmp_path / "metadata.yaml").write_text(write_metadata(metadata))
    with Reader(tmp_path) as reader:
        assert reader.message_count == 40
        assert (reader.start_time, reader.end_time) == (965, 1366)
        assert [connection.topic for connection in reader.connections] == ["/a", "/b"]
        (qos,) = reader.connections[0].ext.offered_qos_profiles  # type: ignore[union-attr]
        assert (qos.reliability.name, qos.durability.name) == ("RELIABLE", "VOLATILE")


@pytest.mark.parametrize("version", [8, 9])
def test_what_rosbags_writes_is_read(tmp_path: Path, version: int) -> None:
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    never = QosTime(9223372036, 854775807)
    qos = Qos(
        QosHistory.UNKNOWN,
        0,
        QosReliability.RELIABLE,
        QosDurability.VOLATILE,
        never,
        never,
        QosLiveliness.AUTOMATIC,
        never,
        avoid_ros_namespace_conventions=False,
    )
    with Writer(tmp_path / "bag", version=version) as writer:  # type: ignore[arg-type]
        store = get_typestore(Stores.ROS2_JAZZY)
        writer.add_connection("/topic", "std_msgs/msg/String", typestore=store, offered_qos_profiles=[qos])
    metadata = read_metadata((tmp_path / "bag" / "metadata.yaml").read_bytes(), "metadata.yaml")
    assert (metadata.version, metadata.storage, metadata.paths) == (version, "sqlite3", ("bag.db3",))
    assert metadata.topics == (
        TopicInformation(Topic("/topic", "std_msgs/msg/String", "cdr", qos_profiles=QOS, type_hash=HASH), 0),
    )


@pytest.mark.parametrize(
    ("version", "path", "expected"),
    [
        (1, "my_bag/a.db3", "a.db3"),
        (3, "some/where/a.db3", "a.db3"),
        (2, "my_bag\\\\a.db3", "a.db3"),
        (4, "sub/a.db3", "sub/a.db3"),
        (9, "/home/me/bag/a.mcap", "a.mcap"),
        (9, "../bag/a.mcap", "a.mcap"),
        (9, "./a.mcap", "a.mcap"),
    ],
)
def test_files_are_in_the_folder_of_the_bag(version: int, path: str, expected: str) -> None:
    text = f'version: {version}\nstorage_identifier: a\ntopics_with_message_count: []\nrelative_file_paths: ["{path}"]'
    assert read_metadata(text.encode(), "metadata.yaml").paths == (expected,)


NINE = text_of(9)
WRONG = {
    "empty": ("", "the text: expected names and values"),
    "a list": ("- 1", "the text: expected names and values"),
    "no YAML": ("a: b: c", "line 1: not valid YAML: mapping values are not allowed in this context"),
    "a tab": ("a:\n\t- b", "line 2: not valid YAML: found character that cannot start any token"),
    "two documents": ("a: 1\n---\nb: 1", "line 2: a second document begins; there may be one"),
    "twice": ("version: 1\nversion: 2", "line 2: a second version"),
    "a list as a key": ("[1]: 2", "line 1: a key that is not a text"),
    "deep": ("[" * 100 + "]" * 100, "line 1: nested more than 32 deep"),
    "an alias of nothing": ("a: *b", "line 1: nothing before it is called b"),
    "an alias of itself": ("a: &b [*b]", "line 1: nothing before it is called b"),
    "no version": ("a: 1", "version: missing"),
    "version a text": (
        NINE.replace("version: 9", "version: nine"),
        "version: expected a whole number, not 'nine'",
    ),
    "version 0": (
        NINE.replace("version: 9", "version: 0"),
        "version: 0 is not known (1 to 9); name a file of the bag instead of its folder",
    ),
    "version 10": (
        NINE.replace("version: 9", "version: 10"),
        "version: 10 is not known (1 to 9); name a file of the bag instead of its folder",
    ),
    "no storage": (NINE.replace("storage_identifier", "storage"), "storage_identifier: missing"),
    "storage a list": (
        NINE.replace("storage_identifier: sqlite3", "storage_identifier: [a]"),
        "storage_identifier: expected a text",
    ),
    "files a text": (
        NINE.replace("relative_file_paths:", "relative_file_paths: a\n  other:"),
        "relative_file_paths: expected a list",
    ),
    "a file without a name": (
        NINE.replace("    - my_bag_5.db3", "    - ''"),
        "relative_file_paths[1]: expected the name of a file",
    ),
    "no type": (
        NINE.replace("        type:", "        types:"),
        "topics_with_message_count[0].topic_metadata.type: missing",
    ),
    "topic a text": (
        NINE.replace("- topic_metadata:", "- topic_metadata: a\n      other:"),
        "topics_with_message_count[0].topic_metadata: expected names and values",
    ),
    "count a fraction": (
        NINE.replace("      message_count: 20", "      message_count: 2.5"),
        "topics_with_message_count[0].message_count: expected a whole number, not '2.5'",
    ),
    "count with other digits": (
        NINE.replace("      message_count: 20", "      message_count: ٣"),
        "topics_with_message_count[0].message_count: expected a whole number, not '٣'",
    ),
    "start time endless": (
        NINE.replace("1585866235112411371", "1" * 5000, 1),
        f"starting_time.nanoseconds_since_epoch: expected a whole number, not '{'1' * 40}'",
    ),
    "duration a number": (
        NINE.replace("  duration:\n    nanoseconds: 4531096768", "  duration: 5"),
        "duration: expected names and values",
    ),
    "profile a text": (
        NINE.replace("- history: unknown\n", "- a\n          -\n"),
        "topics_with_message_count[0].topic_metadata.offered_qos_profiles[0]: expected a QoS profile, "
        "as names and values",
    ),
    "profiles a text in version 9": (
        NINE.replace("offered_qos_profiles:", "offered_qos_profiles: a\n        other:"),
        "topics_with_message_count[0].topic_metadata.offered_qos_profiles: expected a list",
    ),
    "policy with spaces": (
        NINE.replace("history: unknown", "history: a b"),
        "topics_with_message_count[0].topic_metadata.offered_qos_profiles[0]: 'history' is neither a number nor a name",
    ),
    "custom data a list": (
        NINE.replace("custom_data:\n    robot: r2", "custom_data: [a]"),
        "custom_data: expected names and values",
    ),
    "custom data nested": (NINE.replace("robot: r2", "robot: [r2]"), "custom_data.robot: expected a text"),
}


def test_nesting_without_end() -> None:
    """Versions of libyaml differ in who notices it first."""
    with pytest.raises(BagError, match=r"^bag/metadata.yaml: line 1: (nested more|not valid YAML: exceeded)"):
        read_metadata(b"[" * 1_000_000, "bag/metadata.yaml")


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_with_its_place(name: str) -> None:
    text, expected = WRONG[name]
    if text.startswith("rosbag2") and "line" not in expected:
        expected = f"rosbag2_bagfile_information.{expected}"
    with pytest.raises(BagError) as caught:
        read_metadata(text.encode(), "bag/metadata.yaml")
    assert str(caught.value) == f"bag/metadata.yaml: {expected}"


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"a: \xff", "not UTF-8 at byte 3"),
        (bytes(16 * 2**20 + 1), "too large for metadata of a bag: more than 16777216 bytes"),
        (
            b"a: \0",
            "not valid YAML: unacceptable character #x0000: control characters are not allowed "
            'in "<unicode string>", position 3',
        ),
    ],
)
def test_bytes_that_are_no_text_are_refused(data: bytes, expected: str) -> None:
    with pytest.raises(BagError) as caught:
        read_metadata(data, "metadata.yaml")
    assert str(caught.value) == f"metadata.yaml: {expected}"


def test_aliases_are_values_and_count_as_often_as_they_are_used() -> None:
    assert read_yaml("a: &x [1, 2]\nb: *x\nc: &y ~\nd: *y", "a") == {
        "a": ["1", "2"],
        "b": ["1", "2"],
        "c": "~",
        "d": "~",
    }
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 9)]
    with pytest.raises(BagError) as caught:
        read_yaml("\n".join(lines), "a")
    assert (
        str(caught.value)
        == f"a: line 7: more than {MAXIMUM_NODE_COUNT} values, counting each use of an alias"
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ""),
        (QOS, QOS),
        (NAMED_QOS, QOS),
        ("- history: keep_last\n- history: keep_all", "- history: 1\n- history: 2"),
        ("- durability: best_available\n  liveliness: best_available", "- durability: 4\n  liveliness: 5"),
        ("[]", ""),
        (QOS.replace("\n  ", "\n    ").replace("- ", "-   ") + "\n", QOS),
        ("no profile, but reliable", "no profile, but reliable"),
        ("- history: [reliable", "- history: [reliable"),
    ],
)
def test_policies_become_numbers(text: str, expected: str) -> None:
    assert numbered_qos(text) == expected


@given(
    st.lists(
        st.tuples(
            st.integers(0, len(NINE)), st.integers(0, 3), st.text("-: \n[]{}&*?|>'\"%@~#a9!,", max_size=4)
        ),
        max_size=6,
    )
)
@settings(max_examples=300, deadline=None)
def test_damaged_metadata_raises_nothing_else(changes: list[tuple[int, int, str]]) -> None:
    text = NINE
    for place, length, inserted in changes:
        text = text[:place] + inserted + text[place + length :]
    try:
        metadata = read_metadata(text.encode(), "metadata.yaml")
    except BagError as error:
        assert str(error).startswith("metadata.yaml: ")
    else:
        assert read_metadata(write_metadata(metadata).encode(), "metadata.yaml").paths == metadata.paths
