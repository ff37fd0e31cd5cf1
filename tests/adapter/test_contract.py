"""What generated code needs of its runtime stays: modules of every version that is served import and convert.

`contract/<version>` holds what that version generated of `contract/contract_msgs`, which needs every helper there is. A
new version is generated into a folder of its own by `make golden`; what is there is never written again. The newest
may be removed, and so made anew, as long as no release has it.
"""

from __future__ import annotations

import ast
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rosidl_adapter_proto import adapter
from rosidl_adapter_proto.adapter.contract import CONTRACT_VERSION, RESERVED_NAMES, SERVED_VERSIONS
from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
from tests.programs import run

CONTRACT = Path(__file__).parent / "contract"
CHECKOUT = Path(__file__).parents[2]
CURRENT = CONTRACT / str(CONTRACT_VERSION)
ADVICE = (
    "what generated modules need has changed: raise CONTRACT_VERSION, unless it was never released, then remove "
    f"tests/adapter/contract/{CONTRACT_VERSION}; and run: make golden"
)


def round_trip(generated: Path, code: int = 0) -> str:
    program = CONTRACT / "round_trip.py"
    path = os.pathsep.join(map(str, (generated, CHECKOUT)))
    return run(sys.executable, program, folder=CONTRACT, code=code, variables={"PYTHONPATH": path})


def converted(version: int) -> dict[str, str]:
    """Return the CDR of each message that modules of a version have; nothing of services and actions themselves."""
    rows = (line.partition(" ") for line in round_trip(CONTRACT / str(version)).splitlines())
    return {name: cdr for name, _, cdr in rows}


def modules(folder: Path) -> dict[str, ast.Module]:
    """Return every module below a folder by its path."""
    files = sorted(folder.rglob("*.py"))
    return {file.relative_to(folder).as_posix(): ast.parse(file.read_text("utf-8")) for file in files}


def needed(module: ast.Module) -> set[str]:
    """Return what a generated module takes from `adapter`, and the full names of anything else of ours."""
    names, ours = set(), ""
    for node in ast.walk(module):
        if isinstance(node, ast.ImportFrom) and node.module == "rosidl_adapter_proto.adapter":
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module == "rosidl_adapter_proto":
            assert [alias.name for alias in node.names] == ["adapter"]
            ours = node.names[0].asname or "adapter"
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            found = {alias.name for alias in node.names} | {getattr(node, "module", "")}
            names |= {name for name in found if name.startswith("rosidl_adapter_proto")}
    attributes = (node for node in ast.walk(module) if isinstance(node, ast.Attribute))
    return names | {each.attr for each in attributes if ast.unparse(each.value) == ours}


def stated(module: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the position and the arguments of each statement of a version."""
    for position, node in enumerate(module.body):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            text = ast.unparse(node.value)
            if "require_contract" in text:
                yield position, text.partition("(")[2].rstrip(")")


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    """What is generated now."""
    folder = tmp_path_factory.mktemp("contract")
    catalog = Catalog((folder_source(CONTRACT / "contract_msgs"), store_source("kilted")))
    generate(Request(("contract_msgs",)), catalog, folder, Options())
    if request.config.getoption("--update-golden") and not CURRENT.exists():
        others = shutil.ignore_patterns("*.pyi", "py.typed")
        shutil.copytree(folder / "python", CURRENT, ignore=others)
    return folder / "python"


def test_every_version_that_is_served_has_its_golden_modules(fresh: Path) -> None:
    folders = [int(path.name) for path in CONTRACT.iterdir() if path.name.isdecimal()]
    assert sorted(folders) == list(SERVED_VERSIONS)


@pytest.mark.parametrize("version", SERVED_VERSIONS)
def test_modules_of_every_version_convert_alike(version: int) -> None:
    """A newer version may have more messages, and more fields at the end of `Everything`."""
    older, newer = converted(version), converted(CONTRACT_VERSION)
    grown = "contract_msgs/msg/Everything"
    newer[grown] = newer[grown][: len(older[grown])]
    assert {name: newer.get(name) for name in older} == older


def test_exactly_what_generated_modules_need_is_offered() -> None:
    offered = set(adapter.__all__)
    found = [
        needed(module) for version in SERVED_VERSIONS for module in modules(CONTRACT / str(version)).values()
    ]
    assert set().union(*found) == offered, ADVICE
    assert all(hasattr(adapter, name) for name in offered)


def test_what_is_generated_now_needs_what_its_version_needs(fresh: Path) -> None:
    golden = {path: needed(module) for path, module in modules(CURRENT).items()}
    assert {path: needed(module) for path, module in modules(fresh).items()} == golden, ADVICE


def test_every_module_states_its_version_before_it_needs_anything(fresh: Path) -> None:
    for path, module in modules(fresh).items():
        ((position, arguments),) = stated(module)
        assert arguments == f"{CONTRACT_VERSION}, __name__", path
        before = {ast.unparse(node) for node in module.body[1:position]}
        assert before <= {
            "from __future__ import annotations",
            "import typing",
            "import typing as _typing",
            "from google.protobuf.internal import builder as _builder",
            "from rosidl_adapter_proto import adapter",
            "from rosidl_adapter_proto import adapter as _adapter",
        }, path


@pytest.mark.parametrize(
    ("file", "module"),
    [
        ("msg/__init__.py", "msg"),
        ("msg/Everything_pb2.py", "msg.Everything_pb2"),
        ("srv/Set_adapter.py", "srv.Set_adapter"),
    ],
)
def test_a_version_that_is_not_served(file: str, module: str, tmp_path: Path) -> None:
    newer = tmp_path / "newer"
    shutil.copytree(CURRENT, newer)
    path = newer / "rosidl_proto/contract_msgs" / file
    text = path.read_text("utf-8")
    path.write_text(text.replace(f"({CONTRACT_VERSION}, __name__)", "(1000, __name__)"), encoding="utf-8")
    assert round_trip(newer, code=1).splitlines()[-1] == (
        f"ImportError: rosidl_proto.contract_msgs.{module} needs contract version 1000, and the installed "
        f"rosidl-adapter-proto serves 0 to {CONTRACT_VERSION}; upgrade rosidl-adapter-proto, "
        "or generate the module again with the installed one"
    )


def test_reserved_names_are_the_attributes_of_adapters() -> None:
    attributes = {*dir(adapter.TypeAdapter), *dir(type), *adapter.TypeAdapter.__annotations__}
    assert {name for name in attributes if not name.startswith("_")} == RESERVED_NAMES
