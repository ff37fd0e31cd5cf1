"""Fields and constants of `.idl` files may be called like anything that Python, protobuf or generated code has."""

from __future__ import annotations

import array
import ast
import builtins
import importlib
import keyword
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from google.protobuf.empty_pb2 import Empty

from rosidl_adapter_proto import TypeRegistry, adapter, adapter_for
from rosidl_adapter_proto.adapter.contract import (
    PROTOBUF_NAMES,
    RESERVED_IN_BODIES,
    RESERVED_NAMES,
    constant_name,
)
from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.generate.targets.python.names import check_module_names
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
from rosidl_adapter_proto.interfaces.model import TypeName
from tests.folders import write_package

OF_MODULES = (
    "self",
    "cls",
    "source",
    "message",
    "destination",
    "arrays",
    "field",
    "error",
    "value",
    "annotations",
)
OF_DEFINITIONS = ("Part", "PartAdapter", "Constants", "ConstantsAdapter", "Constants_pb2", "reserved_msgs")
NAMES = sorted(
    name
    for name in {
        *keyword.kwlist,
        *keyword.softkwlist,
        *dir(builtins),
        *adapter.__all__,
        *RESERVED_NAMES,
        *RESERVED_IN_BODIES,
        *PROTOBUF_NAMES,
        *OF_MODULES,
        *OF_DEFINITIONS,
    }
    if not name.startswith("_")
)


# An underscore escapes what may be a keyword of IDL.
def idl(message: str, members: list[str], constants: list[str] | None = None) -> str:
    module = f"module {message}_Constants {{ {' '.join(constants)} }};" if constants else ""
    return (
        f"module reserved_msgs {{ module msg {{ {module} struct {message} {{ {' '.join(members)} }}; }}; }};"
    )


DEFINITIONS = {
    "msg/Part.msg": "int32 x 3\n",
    "msg/Fields.idl": idl("Fields", [f"@default(value=7) long _{name};" for name in NAMES]),
    "msg/Arrays.idl": idl("Arrays", [f"sequence<double> _{name};" for name in NAMES]),
    "msg/Nested.idl": idl("Nested", [f"reserved_msgs::msg::Part _{name};" for name in NAMES]),
    "msg/Constants.idl": idl(
        "Constants",
        ["long x;"],
        [f"const long _{name} = {number};" for number, name in enumerate(NAMES)],
    ),
}


@pytest.fixture(scope="module", params=["generated", "at run time"])
def adapter_of(reserved: SimpleNamespace, request: pytest.FixtureRequest) -> Callable[[str], Any]:
    """What gives the adapter of a message of `DEFINITIONS`."""
    if request.param == "generated":
        return lambda name: getattr(reserved.msg, f"{name}Adapter")
    registry = TypeRegistry.from_folders(reserved.folder.parent / "reserved_msgs")
    return lambda name: adapter_for(f"reserved_msgs/msg/{name}", registry)


@pytest.fixture(scope="module")
def reserved(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimpleNamespace]:
    """The messages of `DEFINITIONS`, generated and imported."""
    root = tmp_path_factory.mktemp("reserved")
    write_package(root / "reserved_msgs", DEFINITIONS)
    catalog = Catalog((folder_source(root / "reserved_msgs"), store_source()))
    generate(Request(("reserved_msgs",)), catalog, root / "out", Options(python_root="reserved_root"))
    sys.path.insert(0, str(root / "out" / "python"))
    module = importlib.import_module("reserved_root.reserved_msgs.msg")
    yield SimpleNamespace(folder=root / "out", msg=module)
    sys.path.remove(str(root / "out" / "python"))


def test_the_names_of_protobuf_are_complete() -> None:
    assert {name for name in dir(Empty) if not name.startswith("_")} <= PROTOBUF_NAMES


def test_constants_keep_apart() -> None:
    names = [*NAMES, *(f"{name}_" for name in NAMES), *(f"{name}__" for name in NAMES)]
    called = [constant_name(name, "Constants") for name in names]
    assert len(set(called)) == len(names)
    assert not {*called} & (RESERVED_NAMES | RESERVED_IN_BODIES)


def test_constants(adapter_of: Callable[[str], Any]) -> None:
    constants = adapter_of("Constants")
    for number, name in enumerate(NAMES):
        assert getattr(constants, constant_name(name, "Constants")) == number, name
    message = constants.custom_type(x=1)
    assert constants.from_cdr(constants.to_cdr(message)) == message


VALUES: dict[str, Any] = {
    "Fields": lambda number: number,
    "Arrays": lambda number: array.array("d", [number, 0.5]),
    "Nested": lambda number: SimpleNamespace(x=number),
}
BLANKS: dict[str, Any] = {
    "Fields": lambda: 0,
    "Arrays": lambda: array.array("d"),
    "Nested": lambda: SimpleNamespace(x=0),
}


@pytest.mark.parametrize("kind", VALUES)
def test_fields(kind: str, adapter_of: Callable[[str], Any]) -> None:
    types = adapter_of(kind)
    source = SimpleNamespace(**{name: VALUES[kind](number) for number, name in enumerate(NAMES)})
    message = types.convert_to_custom(source)
    other = types.convert_to_custom(source, types.custom_type())
    back = SimpleNamespace(**{name: BLANKS[kind]() for name in NAMES})
    types.fill_ros_message(message, back)
    assert back == source
    assert message == other == types.from_cdr(types.to_cdr(message))


def test_default_values(adapter_of: Callable[[str], Any]) -> None:
    fields, nested = adapter_of("Fields").new(), adapter_of("Nested").new()
    assert [getattr(fields, name) for name in NAMES] == [7] * len(NAMES)
    assert [getattr(nested, name).x for name in NAMES] == [3] * len(NAMES)


def test_types(reserved: SimpleNamespace, tmp_path: Path) -> None:
    checkout = Path(__file__).parents[2]
    config = tmp_path / "mypy.ini"
    config.write_text(
        "[mypy]\nstrict = true\nnamespace_packages = true\nexplicit_package_bases = true\n"
        f"mypy_path = {reserved.folder / 'python'}:{checkout}\ncache_dir = {tmp_path / 'cache'}\n"
    )
    folder = reserved.folder / "python" / "reserved_root"
    command = [sys.executable, "-m", "mypy", "--config-file", str(config), str(folder)]
    report = subprocess.run(command, capture_output=True, check=False, text=True)
    assert report.returncode == 0, report.stdout


def test_interfaces_called_like_what_their_modules_use(tmp_path: Path) -> None:
    write_package(
        tmp_path / "odd_msgs",
        {"msg/numbers.idl": "module odd_msgs { module msg { struct numbers { long a; }; }; };"},
    )
    catalog = Catalog((folder_source(tmp_path / "odd_msgs"), store_source()))
    with pytest.raises(SchemaError) as caught:
        generate(Request(("odd_msgs",)), catalog, tmp_path / "out", Options())
    assert str(caught.value) == (
        "odd_msgs/msg/numbers: generated modules use the name 'numbers' themselves; "
        "rename the interface, in ROS's style with an upper case letter first"
    )
    check_module_names(TypeName("odd_msgs", "msg", "Numbers"))


def test_the_names_that_modules_use_are_complete(things: SimpleNamespace) -> None:
    """Nothing in lower case stands in an adapter module, but what no interface can be called."""
    used: set[str] = set()
    for file in things.folder.rglob("*_adapter.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Name):
                used.add(node.id)
            elif isinstance(node, ast.arg):
                used.add(node.arg)
    used = {name for name in used if name.islower() and name.strip("_") == name} - IN_BODIES
    assert "numbers" in used
    for name in used:
        with pytest.raises(
            SchemaError, match=f"^things/msg/{name}: generated modules use the name '{name}' "
        ):
            check_module_names(TypeName("things", "msg", name))


IN_BODIES = {
    "codec",
    "custom_type",
    "defaults",
    "feedback",
    "feedback_message",
    "fields",
    "get_result",
    "goal",
}
IN_BODIES |= {"has_defaults", "request", "response", "result", "ros_class", "send_goal", "type_hash", "value"}
"""What has its meaning in a class body or a lambda only, where no interface is used by its name."""
