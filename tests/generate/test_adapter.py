"""What generated adapters do besides converting good values: errors, defaults, constants, groups, descriptions."""

from __future__ import annotations

import array
import importlib
import json
import math
import pickle
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy
import pytest

from rosidl_adapter_proto.adapter import RosNotFoundError, add_descriptor_file
from rosidl_adapter_proto.errors import ConversionError, GenerateError, SchemaError
from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source

# protoc before 26 has an option for fields with the same JSON name, but does not heed it in proto3.
PROTOC_TAKES_JSON_CONFLICTS = tuple(map(int, version("grpcio-tools").split(".")[:2])) >= (1, 66)

DEFINITIONS = {
    "msg/Everything.msg": """\
# What there is.
# More of it.
bool flag
byte raw 7
char letter
int8 small
uint16 medium -0
float32 single 1.5
float64 double_value
int64 large
string name "you"
string<=3 short
wstring wide "ä"
wstring<=2 short_wide
byte[] raws [1, 2]
uint8[<=4] blob
int16[] shorts
int16[3] three_shorts [1, 2, 3]
float32[] singles
float64[2] two_doubles
uint32[<=2] few
bool[2] flags
string[] names ["a", "b"]
wstring[] wides
Part part
Part[] parts
Part[2] two_parts
uint8 DEBUG=10
# What it is called.
string NAME="x"
float32 LIMIT=inf
""",
    "msg/Part.msg": "int32 x 3\nstd_msgs/Header header\n",
    "msg/PartAdapter.msg": "int32 y\n",
    "msg/Type.msg": "int32 from\nint32 y\n",
    "msg/Service.msg": "Header header\n",
    "msg/Header.msg": "std_msgs/Header header\nHeader2 other\n",
    "msg/Header2.msg": f"int32 x_1\n{'int32 x1' if PROTOC_TAKES_JSON_CONFLICTS else ''}\nint32 self\nint32 int\n",
    "msg/Nothing.msg": "",
    "msg/Taken.idl": """
        module things { module msg {
            module Taken_Constants { const long fields = 3; const long new = 4; const long custom_type = 5; };
            struct Taken { long cls; };
        }; };
    """,
    "srv/Set.srv": "int8 a 1\nint8 A=3\n---\nbool ok\n",
    "action/Go.action": "int32 order\n---\nint32[] sequence\n---\nfloat32 part\n",
}


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimpleNamespace]:
    """The package `things`, generated and imported."""
    root = tmp_path_factory.mktemp("things_root")
    for path, text in DEFINITIONS.items():
        file = root / "things" / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    catalog = Catalog((folder_source(root / "things"), store_source()))
    generate(Request(("things",)), catalog, root / "out", Options(python_root="things_root"))
    sys.path.insert(0, str(root / "out/python"))
    modules = {
        name: importlib.import_module(f"things_root.things.{name}") for name in ("msg", "srv", "action")
    }
    yield SimpleNamespace(folder=root / "out", **modules)
    sys.path.remove(str(root / "out/python"))


def ros_everything(**fields: Any) -> SimpleNamespace:
    """Return an object with the fields of the ROS message; any object will do."""
    part = SimpleNamespace(x=1, header=SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=2), frame_id="f"))
    values = {
        "flag": True,
        "raw": b"\x07",
        "letter": 65,
        "small": -1,
        "medium": 1,
        "single": 1.5,
        "double_value": 2.5,
        "large": -(2**63),
        "name": "n",
        "short": "abc",
        "wide": "ä𝄞",
        "short_wide": "",
        "raws": [b"a", b"b"],
        "blob": array.array("B", [1, 2]),
        "shorts": array.array("h", [-1]),
        "three_shorts": numpy.array([1, 2, 3], numpy.int16),
        "singles": array.array("f", [1.0]),
        "two_doubles": numpy.array([1.0, 2.0]),
        "few": [1, 2],
        "flags": [True, False],
        "names": ["x"],
        "wides": ["é"],
        "part": part,
        "parts": [part],
        "two_parts": [part, part],
    }
    return SimpleNamespace(**{**values, **fields})


def bad_part(**header: Any) -> SimpleNamespace:
    values = {"stamp": SimpleNamespace(sec=1, nanosec=2), "frame_id": "f", **header}
    return SimpleNamespace(x=1, header=SimpleNamespace(**values))


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"flag": 2}, "flag: expected bool, not 2"),
        ({"raw": b""}, "raw: ord() expected a character, but string of length 0 found"),
        ({"letter": 256}, "letter: 256 is not in the range from 0 to 255"),
        ({"small": -129}, "small: -129 is not in the range from -128 to 127"),
        ({"medium": 1.5}, "medium: *"),
        ({"medium": 65536}, "medium: 65536 is not in the range from 0 to 65535"),
        ({"single": 3.5e38}, "single: 3.5e+38 is too large for a float32"),
        ({"large": 2**63}, "large: Value out of range: 9223372036854775808"),
        ({"name": 1}, "name: expected str, not int"),
        ({"name": "\ud800"}, "name: 'utf-8' codec can't encode *"),
        ({"short": "abcd"}, "short: 4 characters, more than the bound of 3"),
        ({"wide": "\ud800"}, "wide: 'utf-16-le' codec can't encode *"),
        ({"short_wide": "abc"}, "short_wide: 3 characters, more than the bound of 2"),
        ({"raws": [b"a", b"bc"]}, "raws[1]: ord() expected a character, but string of length 2 found"),
        ({"blob": [1] * 5}, "blob: 5 elements, more than the bound of 4"),
        ({"blob": [1, 256]}, "blob[1]: 256 is not in the range from 0 to 255"),
        ({"shorts": [1, 2, 40000]}, "shorts[2]: 40000 is not in the range from -32768 to 32767"),
        ({"shorts": numpy.array([70000])}, "shorts[0]: 70000 is not in the range from -32768 to 32767"),
        ({"three_shorts": [1, 2]}, "three_shorts: 2 elements, but the array has 3"),
        ({"singles": [1.0, 1e39]}, "singles[1]: 1e+39 is too large for a float32"),
        ({"singles": b"abcd"}, "singles: expected a sequence of numbers, not bytes"),
        ({"singles": ["a"]}, "singles[0]: *"),
        ({"two_doubles": [1.0, 2.0, 3.0]}, "two_doubles: 3 elements, but the array has 2"),
        ({"few": [1, -1]}, "few[1]: -1 is not in the range from 0 to 4294967295"),
        ({"few": [1, 2, 3]}, "few: 3 elements, more than the bound of 2"),
        ({"flags": [True]}, "flags: 1 element, but the array has 2"),
        ({"flags": [True, 3]}, "flags[1]: expected bool, not 3"),
        ({"names": "ab"}, "names: expected a sequence, not str"),
        ({"two_doubles": {1.0, 2.0}}, "two_doubles: expected a sequence of numbers, not set"),
        ({"singles": numpy.ones(2, complex)}, "singles: expected real numbers, not complex ones"),
        ({"names": ["a", None]}, "names[1]: expected str, not NoneType"),
        ({"wides": ["a", "\udc00"]}, "wides[1]: 'utf-16-le' codec can't encode *"),
        ({"part": None}, "part.x: 'NoneType' object has no attribute 'x'"),
        ({"part": bad_part(frame_id=b"\xff")}, "part.header.frame_id: expected str, not bytes"),
        (
            {"parts": [bad_part(), bad_part(stamp=SimpleNamespace(sec=2**31, nanosec=0))]},
            "parts[1].header.stamp.sec: Value out of range: 2147483648",
        ),
        ({"two_parts": []}, "two_parts: 0 elements, but the array has 2"),
    ],
)
def test_bad_ros_values(package: SimpleNamespace, fields: dict[str, Any], text: str) -> None:
    adapter = package.msg.EverythingAdapter
    destination = adapter.convert_to_custom(ros_everything())
    before = destination.SerializeToString()
    with pytest.raises(ConversionError) as caught:
        adapter.convert_to_custom(ros_everything(**fields), destination)
    expected = f"things/msg/Everything.{text}"
    if expected.endswith("*"):  # the rest is the words of Python or protobuf, which differ between versions
        assert str(caught.value).startswith(expected[:-1])
    else:
        assert str(caught.value) == expected
    assert destination.SerializeToString() == before
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


class FakeEverything:
    """A ROS message class: what `fill_ros_message` needs of one."""

    def __init__(self, **fields: Any) -> None:
        values = ros_everything(
            blob=array.array("B"), shorts=array.array("h"), singles=array.array("f"), few=array.array("I")
        )
        vars(self).update({**vars(values), **fields})
        self.part = FakePart()


class FakePart:
    def __init__(self) -> None:
        self.x = 0
        self.header = SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0), frame_id="")


@pytest.fixture
def fake_ros(package: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> Any:
    ros_module = SimpleNamespace(Everything=FakeEverything, Part=FakePart)
    monkeypatch.setitem(sys.modules, "things.msg", ros_module)  # type: ignore[arg-type]
    return package.msg.EverythingAdapter


def test_round_trip_with_any_class(package: SimpleNamespace, fake_ros: Any) -> None:
    custom = fake_ros.convert_to_custom(ros_everything())
    assert fake_ros.convert_to_custom(fake_ros.convert_to_ros_message(custom)) == custom


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"raw": 256}, "raw: 256 is not in the range from 0 to 255"),
        ({"small": 128}, "small: 128 is not in the range from -128 to 127"),
        ({"short": "abcd"}, "short: 4 characters, more than the bound of 3"),
        ({"wide": b"a"}, "wide: 'utf-16-le' codec can't decode byte 0x61 in position 0: truncated data"),
        ({"short_wide": b"a\0b\0c\0"}, "short_wide: 3 characters, more than the bound of 2"),
        ({"blob": b"12345"}, "blob: 5 elements, more than the bound of 4"),
        ({"shorts": [1, -32769]}, "shorts[1]: -32769 is not in the range from -32768 to 32767"),
        ({"three_shorts": [1]}, "three_shorts: 1 element, but the array has 3 (or none, for zeros)"),
        (
            {"three_shorts": [1, 2, 1 << 16]},
            "three_shorts[2]: 65536 is not in the range from -32768 to 32767",
        ),
        ({"two_doubles": [1]}, "two_doubles: 1 element, but the array has 2 (or none, for zeros)"),
        ({"few": [1, 2, 3]}, "few: 3 elements, more than the bound of 2"),
        ({"flags": [True]}, "flags: 1 element, but the array has 2 (or none, for zeros)"),
        (
            {"wides": [b"", b"x"]},
            "wides[1]: 'utf-16-le' codec can't decode byte 0x78 in position 0: truncated data",
        ),
        ({"two_parts": [{}]}, "two_parts: 1 element, but the array has 2 (or none, for zeros)"),
    ],
)
def test_bad_protobuf_values(
    package: SimpleNamespace, fake_ros: Any, fields: dict[str, Any], text: str
) -> None:
    destination = FakeEverything(name="before")
    with pytest.raises(ConversionError) as caught:
        fake_ros.convert_to_ros_message(package.msg.Everything(name="after", **fields), destination)
    assert str(caught.value) == f"things/msg/Everything.{text}"
    assert destination.name == "before"


def test_absent_arrays_are_zeros(package: SimpleNamespace, fake_ros: Any) -> None:
    message = fake_ros.convert_to_ros_message(package.msg.Everything())
    assert message.three_shorts.tolist() == [0, 0, 0]
    assert message.two_doubles.tolist() == [0.0, 0.0]
    assert message.flags == [False, False]
    assert [part.x for part in message.two_parts] == [0, 0]


def test_not_a_number_and_infinity(package: SimpleNamespace, fake_ros: Any) -> None:
    values = array.array("f", [math.nan, math.inf, -math.inf, -0.0])
    custom = fake_ros.convert_to_custom(ros_everything(single=math.nan, singles=values))
    message = fake_ros.convert_to_ros_message(custom)
    assert math.isnan(message.single)
    assert message.singles.tobytes() == values.tobytes()


def test_destination_is_overwritten(package: SimpleNamespace, fake_ros: Any) -> None:
    custom = package.msg.Everything(names=["old"], blob=b"old")
    assert fake_ros.convert_to_custom(ros_everything(), custom) is custom
    assert custom == fake_ros.convert_to_custom(ros_everything())
    message = FakeEverything()
    assert fake_ros.convert_to_ros_message(custom, message) is message
    assert message.names == ["x"]


def test_wrong_objects(package: SimpleNamespace, fake_ros: Any) -> None:
    with pytest.raises(ConversionError) as caught:
        fake_ros.convert_to_ros_message(package.msg.Part())
    assert str(caught.value) == (
        "things/msg/Everything: expected a protobuf message things.msg.pb.Everything, "
        "not things_root.things.msg.Part_pb2.Part"
    )
    with pytest.raises(ConversionError) as caught:
        fake_ros.convert_to_ros_message(package.msg.Everything(), object())
    assert str(caught.value) == "things/msg/Everything: expected a ROS message as destination, not object"


def test_ros_class_that_is_not_installed(package: SimpleNamespace) -> None:
    with pytest.raises(RosNotFoundError) as caught:
        package.msg.TypeAdapter.convert_to_ros_message(package.msg.Type())
    assert str(caught.value) == (
        "things/msg/Type: cannot import things.msg (No module named 'things'); "
        "source a ROS 2 installation that has it, or install it with pip"
    )


def test_new_applies_default_values(package: SimpleNamespace) -> None:
    message = package.msg.EverythingAdapter.new(flag=True, name="me")
    assert (message.flag, message.raw, message.name, message.single) == (True, 7, "me", 1.5)
    assert message.wide.decode("utf-16-le") == "ä"
    assert message.raws == b"\1\2"
    assert list(message.three_shorts) == [1, 2, 3]
    assert list(message.names) == ["a", "b"]
    assert message.part.x == 3
    assert [part.x for part in message.two_parts] == [3, 3]
    assert not message.parts
    assert package.msg.EverythingAdapter.new(part=package.msg.Part()).part.x == 0
    assert package.srv.Set_RequestAdapter.new().a == 1


def test_constants(package: SimpleNamespace) -> None:
    adapter = package.msg.EverythingAdapter
    assert adapter.DEBUG == 10
    assert adapter.NAME == "x"
    assert math.isinf(adapter.LIMIT)
    assert package.srv.Set_RequestAdapter.A == 3


def test_names_that_adapters_use_themselves(package: SimpleNamespace) -> None:
    adapter = package.msg.TakenAdapter
    assert (adapter.fields_, adapter.new_, adapter.custom_type_) == (3, 4, 5)
    assert adapter.new(cls=1) == package.msg.Taken(cls=1)


def test_projects_are_named_after_what_was_asked_for(package: SimpleNamespace) -> None:
    assert 'name = "things-root-things"' in (package.folder / "pyproject.toml").read_text()


@pytest.mark.parametrize("name", ["types", "rosidl_adapter_proto", "class", "a-b"])
def test_python_roots_that_cannot_be(name: str, tmp_path: Path) -> None:
    with pytest.raises(
        GenerateError, match=rf"'{name}' (is|cannot be) the name of a(nother)? Python package"
    ):
        generate(
            Request(("std_msgs",)), Catalog((store_source(),)), tmp_path / "out", Options(python_root=name)
        )


def test_names_that_collide(package: SimpleNamespace) -> None:
    """A message may be called like the adapter of another, like a base class, or like a message elsewhere."""
    assert package.msg.PartAdapter.DESCRIPTOR.full_name == "things.msg.pb.PartAdapter"
    assert package.msg.PartAdapter_.custom_type is package.msg.Part
    assert package.msg.PartAdapterAdapter.custom_type is package.msg.PartAdapter
    assert package.msg.ServiceAdapter.custom_type is package.msg.Service
    assert package.msg.HeaderAdapter.type_name == "things/msg/Header"
    assert package.msg.HeaderAdapter.fields[0].nested.type_name == "std_msgs/msg/Header"


def test_groups(package: SimpleNamespace) -> None:
    assert package.srv.SetAdapter.request is package.srv.Set_RequestAdapter
    assert package.srv.SetAdapter.response.custom_type is package.srv.Set_Response
    go = package.action.GoAdapter
    assert [go.goal, go.result, go.feedback] == [
        package.action.Go_GoalAdapter,
        package.action.Go_ResultAdapter,
        package.action.Go_FeedbackAdapter,
    ]
    assert go.send_goal.request.custom_type is package.action.Go_SendGoal_Request
    assert go.get_result.type_name == "things/action/Go_GetResult"
    assert go.feedback_message.custom_type is package.action.Go_FeedbackMessage


def test_package_exports(package: SimpleNamespace) -> None:
    assert set(package.srv.__all__) == {
        "SetAdapter",
        "Set_Request",
        "Set_RequestAdapter",
        "Set_Response",
        "Set_ResponseAdapter",
    }
    assert set(package.srv.__all__) <= set(dir(package.srv))
    with pytest.raises(AttributeError, match="has no attribute 'Nonsense'"):
        _ = package.srv.Nonsense


def test_an_adapter_derived_from_one_in_use(package: SimpleNamespace) -> None:
    part = package.msg.Part(x=1)
    data = package.msg.PartAdapter_.to_cdr(part)

    class Derived(package.msg.PartAdapter_):  # type: ignore[misc, name-defined]
        custom_type = package.msg.PartAdapter

    with pytest.raises(SchemaError):  # its class has other fields
        Derived.from_cdr(data)
    assert package.msg.PartAdapter_.from_cdr(data).x == 1


def test_empty_message(package: SimpleNamespace) -> None:
    adapter = package.msg.NothingAdapter
    assert [field.name for field in adapter.fields] == ["structure_needs_at_least_one_member"]
    assert adapter.convert_to_custom(object()) == package.msg.Nothing()


def test_same_descriptor_twice(package: SimpleNamespace) -> None:
    descriptor = package.msg.Part.DESCRIPTOR.file
    assert add_descriptor_file(descriptor.name, descriptor.serialized_pb, "elsewhere.py") is descriptor


def test_different_descriptor_of_the_same_name(package: SimpleNamespace) -> None:
    descriptor = package.msg.Part.DESCRIPTOR.file
    other = package.msg.Type.DESCRIPTOR.file.serialized_pb.replace(b"things/msg/Type", b"things/msg/Part")
    with pytest.raises(ImportError) as caught:
        add_descriptor_file(descriptor.name, other, "elsewhere.py")
    text = str(caught.value)
    assert text.startswith(f"elsewhere.py and {package.folder}")
    assert "bring different versions of things/msg/Part.proto into one process" in text
    assert text.endswith("generate both from the same definitions, with the same options")


def test_import_is_light(package: SimpleNamespace) -> None:
    """Importing a generated adapter loads nothing that only generating needs, and no ROS."""
    program = (
        "import sys, json; from things_root.things.msg import EverythingAdapter; "
        "print(json.dumps(sorted({name.partition('.')[0] for name in sys.modules})))"
    )
    path = f"{package.folder / 'python'}:{Path(__file__).parents[2]}"
    output = subprocess.run(
        [sys.executable, "-c", program], env={"PYTHONPATH": path}, capture_output=True, check=True, text=True
    ).stdout
    heavy = {"jinja2", "black", "lark", "rosbags", "grpc_tools", "rclpy", "numpy", "click", "dataclasses"}
    assert not heavy & set(json.loads(output))


def test_protoc_output_of_the_same_file_can_be_loaded_beside(
    package: SimpleNamespace, tmp_path: Path
) -> None:
    """protoc's own Python module of a generated .proto file shares the classes' descriptors."""
    proto = "things/msg/Header2.proto"
    subprocess.run(
        [
            sys.executable,
            "-m",
            "grpc_tools.protoc",
            f"-I{package.folder / 'proto'}",
            f"--python_out={tmp_path}",
            proto,
        ],
        check=True,
    )
    program = (
        f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(package.folder / 'python')!r}]; "
        "import things.msg.Header2_pb2 as protoc; from things_root.things.msg import Header2; "
        "assert Header2.DESCRIPTOR.file is protoc.DESCRIPTOR"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
