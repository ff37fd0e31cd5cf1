"""The CMake files of the ament_cmake hook, in a project that stands in for ROS: what cannot be served is skipped."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from rosidl_adapter_proto.generate.targets.index import RESOURCE_FOLDER
from rosidl_adapter_proto.hooks.cmake import cmake_folder
from tests.folders import write_package

cmake = pytest.importorskip("cmake", reason="needs cmake")
CMAKE = Path(cmake.CMAKE_BIN_DIR, "cmake")

PROJECT = """
cmake_minimum_required(VERSION 3.20)
project(workspace NONE)
function(ament_register_extension)
endfunction()
function(_ament_cmake_python_register_environment_hook)
endfunction()
if(NOT NO_PYTHON)
  function(ament_get_python_install_dir variable)
    set(${variable} lib/site PARENT_SCOPE)
  endfunction()
endif()
set(ament_cmake_core_DIR "${CMAKE_CURRENT_SOURCE_DIR}")
set(rosidl_generator_proto_DIR "@hook@")
find_package(rosidl_generator_proto REQUIRED)

# Does what ROS does as far as the hook sees it, and builds and installs something.
macro(rosidl_generate_interfaces target)
  set(_interface_tuples "")
  foreach(_file ${ARGN})
    list(APPEND _interface_tuples "${CMAKE_CURRENT_SOURCE_DIR}:${_file}")
  endforeach()
  set(_adapter_arguments_file "rosidl_adapter__arguments__${target}.json")
  add_custom_target(${target} ALL COMMAND "${CMAKE_COMMAND}" -E touch by_ros)
  set(rosidl_generate_interfaces_TARGET ${target})
  set(rosidl_generate_interfaces_DEPENDENCY_PACKAGE_NAMES std_msgs far_msgs skipped_msgs)
  set(std_msgs_DIR "${CMAKE_SOURCE_DIR}/ros/share/std_msgs/cmake")
  set(std_msgs_IDL_FILES msg/Header.idl)
  set(far_msgs_DIR "${CMAKE_SOURCE_DIR}/ros/share/far_msgs/cmake")
  set(skipped_msgs_DIR "${CMAKE_SOURCE_DIR}/ros/share/skipped_msgs/cmake")
  if(NO_TUPLES)
    set(_interface_tuples "")
  endif()
  include("@hook@/rosidl_generator_proto_generate_interfaces.cmake")
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/by_ros" DESTINATION share/${PROJECT_NAME})
endmacro()
""".replace("@hook@", cmake_folder().as_posix())

PACKAGE = """
project({name} NONE)
{settings}
rosidl_generate_interfaces({name} {interfaces})
"""


@dataclass(frozen=True)
class Package:
    """An interface package, and what becomes of it.

    Attributes:
        definitions: The text of each definition by its path.
        reason: Why it cannot be served, with `{src}` for its folder; None if it can.
        settings: Commands of its CMakeLists.txt.
        files: What else it has.
        stage: When that comes out.
    """

    definitions: Mapping[str, str]
    reason: str | None
    settings: str = ""
    files: Mapping[str, str] = field(default_factory=dict)
    stage: str = "configure"


TRACK = {"msg/Track.msg": "std_msgs/Header header\nuint32 id\n"}
SEQUENTIAL = "set(ROSIDL_PROTO_NUMBERING sequential)"
NO_PROGRAM = '#!/bin/sh\necho "No module named rosidl_adapter_proto" >&2\nexit 1\n'

PACKAGES = {
    "good_msgs": Package(TRACK, None),
    "folder_msgs": Package(
        {"msg/a/A.msg": "B b\n", "msg/b/c/B.msg": "int8 x\n", "api/srv/C.srv": "---\nA a\n"}, None
    ),
    "long_double_msgs": Package(
        {"msg/A.idl": "module long_double_msgs { module msg { struct A { long double x; }; }; };"}, None
    ),
    # While a package is configured
    "wrong_msgs": Package(
        {"msg/Track.msg": "uint32 id\nuint32 3d\n"},
        "{src}/msg/Track.msg:2:8: '3d' is not a valid field name; ",
    ),
    "text_msgs": Package(
        {"msg/Track.txt": ""}, "{src}/msg/Track.txt is no definition: it has to be a .msg, "
    ),
    "twice_msgs": Package(
        {"msg/a/A.msg": "int8 x\n", "msg/b/A.msg": "int8 x\n"},
        "twice_msgs/msg/A is defined by both {src}/msg/a/A.msg and {src}/msg/b/A.msg: ",
    ),
    "missing_msgs": Package(
        {"msg/A.msg": "no_msgs/No no\n"}, "no_msgs/msg/No was not found, but missing_msgs/msg/A.no "
    ),
    "cycle_msgs": Package({"msg/A.msg": "A[] a\n"}, "a message cannot contain itself: cycle_msgs/msg/A.a "),
    "clash_msgs": Package(
        {
            "srv/A.srv": "---\n",
            "srv/A_Request.idl": "module clash_msgs { module srv { struct A_Request { long x; }; }; };",
        },
        "clash_msgs.srv.pb.A_Request is defined by both clash_msgs/srv/A.proto and clash_msgs/srv/A_Request.proto; ",
    ),
    "option_msgs": Package(
        TRACK, "argument --events: must be true or false", "set(ROSIDL_PROTO_EVENTS maybe)"
    ),
    "root_msgs": Package(
        TRACK, "'my-protos' cannot be the name of a Python package", "set(ROSIDL_PROTO_PYTHON_ROOT my-protos)"
    ),
    "lock_msgs": Package(
        TRACK, "{src}/rosidl-proto.lock", SEQUENTIAL, {"rosidl-proto.lock": "<<<<<<< HEAD\n"}
    ),
    "number_msgs": Package(
        TRACK,
        "number_msgs/msg/Track.id: {src}/rosidl-proto.lock has number 1 for it with type string, but its type is ",
        SEQUENTIAL,
        {
            "rosidl-proto.lock": '{"version": 2, "messages": {"number_msgs/msg/Track": {"fields": '
            '{"id": "1 string (string)"}, "removed": {}}}}'
        },
    ),
    "no_python_msgs": Package(
        TRACK,
        "/nowhere/python3 cannot be run (",
        "set(ROSIDL_PROTO_PYTHON /nowhere/python3)",
    ),
    "no_program_msgs": Package(
        TRACK,
        "No module named rosidl_adapter_proto",
        "set(ROSIDL_PROTO_PYTHON ${CMAKE_CURRENT_SOURCE_DIR}/python)",
        {"python": NO_PROGRAM},
    ),
    "dependent_msgs": Package(
        {"msg/A.msg": "skipped_msgs/B[] b\n"},
        "dependent_msgs refers to skipped_msgs, which was built without protobuf types: a warning says why when "
        "skipped_msgs is built",
    ),
    "no_tuples_msgs": Package(
        TRACK,
        "This version of ROS does not tell which definitions it got (in _interface_tuples).",
        "set(NO_TUPLES TRUE)",
    ),
    # While it is built, and installed, since it comes about after that
    "occupied_msgs": Package(TRACK, "/package has files that were not made by rosidl-proto; ", stage="build"),
    "install_msgs": Package(
        {"msg/A.msg": "far_msgs/Far far\n"}, "cannot write to {prefix}: ", stage="install"
    ),
}

STAGES = ("configure", "build", "install")


@dataclass(frozen=True)
class Workspace:
    """A project with packages, and where it is built and installed to."""

    folder: Path

    @property
    def prefix(self) -> Path:
        """Where it is installed to."""
        return self.folder / "prefix"

    def write(self, names: Iterable[str]) -> None:
        """Write packages, with what they depend on."""
        write_package(self.folder / "ros/share/std_msgs", {"msg/Header.msg": "string frame_id\n"})
        write_package(self.folder / "ros/share/far_msgs", {"msg/Far.msg": "int8 x\n"})
        write_package(self.folder / "ros/share/skipped_msgs", {"msg/B.msg": "int8 x\n"})
        write_package(self.folder / "ros", {f"{RESOURCE_FOLDER}/skipped_msgs": ""})
        folders = "".join(f"add_subdirectory({name})\n" for name in names)
        write_package(self.folder, {"CMakeLists.txt": PROJECT + folders, "ament_cmake_coreConfig.cmake": ""})
        for name in names:
            package = PACKAGES[name]
            interfaces = " ".join(package.definitions)
            text = PACKAGE.format(name=name, settings=package.settings, interfaces=interfaces)
            folder = write_package(
                self.folder / name, {**package.definitions, **package.files, "CMakeLists.txt": text}
            )
            if "python" in package.files:
                (folder / "python").chmod(0o755)

    def run(self, stage: str, *options: str, folder: str = "build") -> tuple[int, str]:
        """Configure, build or install, and return the exit code and what is printed."""
        build = self.folder / folder
        # The stand-in would mix with a ROS that there is.
        packages = ("rosidl_generator_py", "ament_cmake_python")
        alone = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{package}=ON" for package in packages]
        arguments: dict[str, list[str | Path]] = {
            "configure": ["-S", self.folder, "-B", build, f"-DROSIDL_PROTO_PYTHON={sys.executable}", *alone],
            "build": ["--build", build],
            "install": ["--install", build, "--prefix", self.prefix],
        }
        process = subprocess.run(
            [CMAKE, *arguments[stage], *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
            text=True,
        )
        return process.returncode, process.stdout

    def block(self, stage: str, name: str) -> None:
        """Bring about what a package runs into in a stage, just before it."""
        if (stage, name) == ("build", "occupied_msgs"):
            output = self.folder / f"build/{name}/rosidl_generator_proto/{name}"
            write_package(output / "package", {"of_somebody_else": ""})
        elif (stage, name) == ("install", "install_msgs"):
            write_package(self.prefix, {"share/far_msgs": ""})

    def resource(self, name: str) -> bytes | None:
        """Return what the ament index tells of a package."""
        file = self.prefix / RESOURCE_FOLDER / name
        return file.read_bytes() if file.exists() else None

    def made(self, name: str) -> list[Path]:
        """Return what is installed of a package, of ours."""
        return [*self.prefix.glob(f"share/{name}/*/*.proto"), *self.prefix.glob(f"lib/site/*/{name}/*/*.py")]


@dataclass(frozen=True)
class Built:
    """A workspace that was built, what was printed in each stage, and what was then installed."""

    workspace: Workspace
    printed: Mapping[str, str]

    def reasons(self, name: str) -> dict[str, str]:
        """Return why there are no protobuf types of a package, by the stage that warns of it."""
        text = f"rosidl_generator_proto: no protobuf types can be made of {name}."
        warning = rf"^CMake Warning .*\n  {re.escape(text)}\n\n((?:      .*\n)*)\n  It is built without them,"
        found = {stage: re.findall(warning, text, re.MULTILINE) for stage, text in self.printed.items()}
        return {stage: reason for stage, reasons in found.items() for reason in reasons}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """All packages, built and installed together."""
    workspace = Workspace(tmp_path_factory.mktemp("workspace"))
    workspace.write(PACKAGES)
    printed = {}
    for stage in STAGES:
        for name in PACKAGES:
            workspace.block(stage, name)
        code, printed[stage] = workspace.run(stage)
        assert code == 0, printed[stage]
    return Built(workspace, printed)


@pytest.mark.parametrize("name", PACKAGES)
def test_ros_goes_on(name: str, built: Built) -> None:
    package, workspace = PACKAGES[name], built.workspace
    assert (workspace.prefix / f"share/{name}/by_ros").is_file()
    reasons = built.reasons(name)
    if package.reason is None:
        assert reasons == {}
        for path in package.definitions:
            made = f"rosidl_proto/{name}/{path.partition('.')[2]}/{Path(path).stem}_adapter.py"
            made = made.replace("/idl/", "/msg/")
            assert (workspace.prefix / "lib/site" / made).is_file()
        return
    # It is said once, and as it is written: CMake breaks no line of it.
    expected = package.reason.format(src=workspace.folder / name, prefix=workspace.prefix)
    assert list(reasons) == [package.stage]
    assert expected in reasons[package.stage]
    if package.stage != "install":
        assert workspace.made(name) == []
        assert workspace.resource(name) == (None if name == "no_tuples_msgs" else b"")


def test_what_was_mended_is_served(built: Built) -> None:
    workspace = built.workspace
    (workspace.folder / "lock_msgs/rosidl-proto.lock").unlink()

    code, printed = workspace.run("build", "--target", "lock_msgs")

    assert (code, "CMake Warning" in printed) == (0, False), printed
    assert workspace.run("install", folder="build/lock_msgs")[0] == 0
    assert workspace.resource("lock_msgs")
    assert len(workspace.made("lock_msgs")) == 4


@pytest.mark.parametrize("generator", ["Unix Makefiles", "Ninja"])
def test_nothing_of_an_earlier_build_is_installed(generator: str, tmp_path: Path) -> None:
    if generator == "Ninja" and shutil.which("ninja") is None:
        pytest.skip("needs ninja")
    workspace = Workspace(tmp_path)
    workspace.write(["good_msgs"])
    for stage in STAGES:
        assert workspace.run(stage, *(["-G", generator] if stage == "configure" else []))[0] == 0
    assert workspace.made("good_msgs")
    shutil.rmtree(workspace.prefix)

    (workspace.folder / "ros/share/std_msgs/msg/Header.msg").write_text("no_msgs/No no\n")
    (workspace.folder / "good_msgs/msg/Track.msg").touch()
    for stage in STAGES[1:]:
        code, printed = workspace.run(stage)
        assert (code, printed.count("CMake Warning")) == (0, 1 if stage == "build" else 0), printed

    assert workspace.made("good_msgs") == []
    assert workspace.resource("good_msgs") == b""


def test_without_a_folder_of_python_packages(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    workspace.write(["good_msgs"])

    code, printed = workspace.run("configure", "-DNO_PYTHON=ON")

    assert code == 0, printed
    reason = "ament_cmake_python was not found, which says where Python packages are installed."
    assert reason in Built(workspace, {"configure": printed}).reasons("good_msgs")["configure"]
    assert workspace.run("build")[0] == 0


@pytest.mark.parametrize(
    "name", ["wrong_msgs", "lock_msgs", "no_python_msgs", "occupied_msgs", "install_msgs"]
)
def test_strict(name: str, tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    workspace.write([name])
    package = PACKAGES[name]
    for stage in STAGES:
        workspace.block(stage, name)
        code, printed = workspace.run(stage, *(["-DROSIDL_PROTO_STRICT=ON"] if stage == "configure" else []))
        if stage == package.stage:
            break
        assert code == 0, printed
    assert code != 0
    assert package.reason is not None
    assert package.reason.format(src=workspace.folder / name, prefix=workspace.prefix) in printed
    assert "This is an error since ROSIDL_PROTO_STRICT is set" in printed


def test_skip(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    workspace.write(["wrong_msgs"])

    code, printed = workspace.run("configure", "-DROSIDL_PROTO_SKIP=ON", "-DROSIDL_PROTO_STRICT=ON")

    assert code == 0, printed
    assert "rosidl_generator_proto: skipped, since ROSIDL_PROTO_SKIP is set" in printed
    assert workspace.run("build")[0] == 0
