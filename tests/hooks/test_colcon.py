"""Workspaces built by colcon, with ROS from wheels: run by `make test-colcon` in an environment of its own."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.folders import write_package
from tests.programs import run
from tests.ros.support import reserve_domain

pytestmark = pytest.mark.skipif(find_spec("colcon_core") is None, reason="needs colcon: make test-colcon")

ROOT = Path(__file__).parents[2]
SECONDS = 120.0
"""How long anything may take on a busy machine. Nothing waits that long if all is well."""
NATIVE = "scene_msgs/msg/_scene.py"
"""Something that ROS itself builds."""


def environment(**variables: str) -> dict[str, str]:
    """Return the variables of a shell in which the environment of this Python is the ROS installation."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "PYTEST"))}
    prefix = {"AMENT_PREFIX_PATH": sys.prefix, "CMAKE_PREFIX_PATH": sys.prefix, "VIRTUAL_ENV": sys.prefix}
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return {**kept, **prefix, "PATH": path, **variables}


class Workspace:
    """A copy of the workspace of the examples."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(ROOT / "examples" / "workspace", folder)

    def file(self, path: str) -> Path:
        """Return a file of the sources."""
        return self.folder / "src" / path

    def replace(self, path: str, old: str, new: str) -> None:
        """Change a file of the sources."""
        text = self.file(path).read_text(encoding="utf-8")
        assert old in text
        self.file(path).write_text(text.replace(old, new), encoding="utf-8")

    def build(self, *options: str, executor: str = "sequential", succeeds: bool = True) -> str:
        """Build, and return what is printed."""
        command = ["colcon", "build", "--executor", executor, *options]
        process = subprocess.run(
            [*command, "--event-handlers", "console_direct+"],
            cwd=self.folder,
            env=environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
            text=True,
        )
        assert (process.returncode == 0) == succeeds, process.stdout[-10_000:]
        return process.stdout

    def run(self, script: str) -> str:
        """Run a shell script where the workspace is sourced, and return what it prints."""
        return run("bash", "-ec", f"source install/setup.bash\n{script}", folder=self.folder, **environment())

    @contextmanager
    def node(self, name: str, domain: int) -> Iterator[subprocess.Popen[str]]:
        """Run a node of the workspace, which is killed if it takes too long."""
        process = subprocess.Popen(
            ["bash", "-ec", f"source install/setup.bash\nexec install/{name}"],
            cwd=self.folder,
            env=environment(
                PYTHONUNBUFFERED="1", ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST"
            ),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        timer = threading.Timer(SECONDS, process.kill)
        timer.start()
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate()
            timer.cancel()

    def received(self, prefix: str = "track_node/") -> str:
        """Run the talker, and return the first line that the listener, which knows nothing of protobuf, prints."""
        programs = f"{prefix}lib/track_node"
        with reserve_domain() as domain, self.node(f"{programs}/talker", domain) as talker:
            with self.node(f"{programs}/listener", domain) as listener:
                assert listener.stdout is not None
                for line in listener.stdout:
                    if "robot" in line:
                        return line.partition("]: ")[2].strip()
            assert talker.stdout is not None
            talker.send_signal(signal.SIGINT)
            raise AssertionError(f"nothing was received; the talker says: {talker.stdout.read()}")

    def times(self) -> dict[str, int]:
        """Return when each file was written that our hooks or ROS's generators make."""
        parts = ("rosidl_proto", "rosidl_generator", ".proto")
        return {
            str(path.relative_to(self.folder)): path.stat().st_mtime_ns
            for top in ("build", "install")
            for path in (self.folder / top).rglob("*")
            if path.is_file()
            and any(part in str(path) for part in parts)
            and "CMakeFiles" not in path.parts
            and path.suffix in (".py", ".pyi", ".proto", ".c", ".h", ".hpp", ".cpp", ".so", "")
            and path.name not in ("Makefile", "arguments", "depfile")
        }


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    """A workspace that was not built yet."""
    return Workspace(tmp_path / "workspace")


def test_the_document(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    document = (ROOT / "docs" / "build-colcon.md").read_text(encoding="utf-8")
    (commands,) = re.findall(r"^```sh\n(.*?)^```", document, re.MULTILINE | re.DOTALL)

    printed = run("bash", "-ec", commands, folder=tmp_path, **environment())

    assert re.search(r"^track_msgs .* adapters in .*/install/track_msgs$", printed, re.MULTILINE)


def test_from_nothing_to_the_third_build(workspace: Workspace) -> None:
    output = workspace.build()

    for package in ("track_msgs", "scene_msgs"):
        assert f"rosidl_generator_proto: {package} gets protobuf types and adapters" in output
    track = workspace.folder / "install/track_msgs"
    (site,) = track.glob("lib/python*/site-packages")
    for path in ("msg/Track", "srv/FindTrack", "action/Follow"):
        assert (track / f"share/track_msgs/{path}.proto").is_file()
        for suffix in ("_pb2.py", "_pb2.pyi", "_adapter.py"):
            assert (site / f"rosidl_proto/track_msgs/{path}{suffix}").is_file()
    # Dependencies that came as binaries are generated once: std_msgs with track_msgs, and not again with scene_msgs.
    assert (site / "rosidl_proto/std_msgs/msg/Header_pb2.py").is_file()
    scene = workspace.folder / "install/scene_msgs"
    assert not list(scene.glob("lib/python*/site-packages/rosidl_proto/std_msgs"))
    for path in ("geometry_msgs/msg/Pose", "scene_msgs/msg/Light"):
        assert list(scene.glob(f"lib/python*/site-packages/rosidl_proto/{path}_adapter.py"))
    assert re.fullmatch(r"robot \d+ with scores \[0\.5, 0\.25\]", workspace.received())

    listed = dict(line.split(maxsplit=1) for line in workspace.run("rosidl-proto list").splitlines())
    assert listed["track_msgs"].endswith(f"adapters in {track}")
    assert listed["std_msgs"].endswith(f"adapters in {track}")
    assert listed["scene_msgs"].endswith(f"adapters in {scene}")
    assert listed["rosgraph_msgs"].endswith(f"adapters in {workspace.folder / 'install/track_node'}")
    assert "adapters in" not in listed["sensor_msgs"]

    before = workspace.times()
    workspace.replace("track_msgs/msg/Track.msg", "uint32 id\n", "uint32 id\nfloat32 speed  # in m/s\n")
    workspace.replace("track_node/track_node/talker.py", 'label="robot"', 'label="robot", speed=1.5')
    workspace.replace("track_node/track_node/listener.py", "{track.id}", "{track.id} at {track.speed}")
    workspace.build()
    assert re.fullmatch(r"robot \d+ at 1\.5 with scores \[0\.5, 0\.25\]", workspace.received())
    after = workspace.times()
    changed = {path for path in before if before[path] != after[path]}
    ours = {path.rpartition("/")[2] for path in changed if "site-packages/rosidl_proto" in path}
    assert ours == {
        *("Track_adapter.py", "Track_pb2.py", "Track_pb2.pyi"),
        # These hold a Track, and so its type hash.
        *("FindTrack_adapter.py", "Follow_adapter.py", "Scene_adapter.py"),
    }

    output = workspace.build()
    assert workspace.times() == after
    assert "Generating" not in output


@pytest.mark.parametrize("layout", [("--symlink-install",), ("--merge-install",)])
def test_other_layouts(layout: tuple[str, ...], workspace: Workspace) -> None:
    prefix = "" if "--merge-install" in layout else "track_node/"
    workspace.build(*layout)
    assert re.fullmatch(r"robot \d+ with scores \[0\.5, 0\.25\]", workspace.received(prefix))
    before = workspace.times()

    output = workspace.build(*layout)
    assert workspace.times() == before
    assert "Generating" not in output

    workspace.replace("track_msgs/msg/Track.msg", "uint32 id\n", "uint32 id\nfloat32 speed\n")
    workspace.replace("track_node/track_node/talker.py", 'label="robot"', 'label="robot", speed=1.5')
    workspace.replace("track_node/track_node/listener.py", "{track.id}", "{track.id} at {track.speed}")
    workspace.build(*layout)
    assert re.fullmatch(r"robot \d+ at 1\.5 with scores \[0\.5, 0\.25\]", workspace.received(prefix))


@pytest.fixture
def strangers(workspace: Workspace) -> Workspace:
    """A workspace with two packages that do not know each other, and both need std_msgs."""
    shutil.rmtree(workspace.file("scene_msgs"))
    shutil.rmtree(workspace.file("track_node"))
    shutil.rmtree(workspace.file("track_msgs/srv"))
    shutil.rmtree(workspace.file("track_msgs/action"))
    workspace.replace("track_msgs/CMakeLists.txt", "  srv/FindTrack.srv\n  action/Follow.action\n", "")
    shutil.copytree(workspace.file("track_msgs"), workspace.file("other_msgs"))
    for file in ("CMakeLists.txt", "package.xml"):
        workspace.replace(f"other_msgs/{file}", "track_msgs", "other_msgs")
    return workspace


USE_STRANGER = "python -c 'import rosidl_proto.other_msgs.msg as msg; print(msg.Track(id=7).header)'"


def test_packages_that_are_built_at_the_same_time(strangers: Workspace) -> None:
    for _ in range(2):
        shutil.rmtree(strangers.folder / "install", ignore_errors=True)
        strangers.build("--merge-install", executor="parallel")
    strangers.run(USE_STRANGER)


def test_packages_do_not_rely_on_strangers(strangers: Workspace) -> None:
    """Whatever is installed and sourced when a package is built, it has all that it needs."""
    strangers.build("--symlink-install")
    strangers.run("rm -r build && colcon build --symlink-install --executor sequential")
    for folder in ("src", "build", "install"):
        shutil.rmtree(strangers.folder / folder / "track_msgs")
    strangers.run(USE_STRANGER)

    shutil.rmtree(strangers.folder / "install")
    strangers.build("--symlink-install")
    strangers.run(USE_STRANGER)

    strangers.file("other_msgs/msg/Track.msg").rename(strangers.file("other_msgs/msg/Item.msg"))
    strangers.replace("other_msgs/CMakeLists.txt", "msg/Track.msg", "msg/Item.msg")
    strangers.build("--symlink-install")
    assert "Generating" not in strangers.build("--symlink-install")
    strangers.run(USE_STRANGER.replace("Track", "Item"))


def test_from_links_to_copies(workspace: Workspace) -> None:
    """What links of `--symlink-install` there are in the build of a node package is gone without it."""
    shutil.rmtree(workspace.file("scene_msgs"))
    shutil.rmtree(workspace.file("track_msgs"))
    workspace.build("--symlink-install")
    link = workspace.folder / "build/track_node/rosidl_proto"
    assert link.is_symlink()

    workspace.build()

    assert not link.is_symlink()
    where = workspace.run("python -c 'import rosidl_proto.rosgraph_msgs.msg as msg; print(msg.__file__)'")
    assert where.startswith(str(workspace.folder / "install/track_node/lib"))


def test_options(workspace: Workspace) -> None:
    shutil.rmtree(workspace.file("scene_msgs"))
    shutil.rmtree(workspace.file("track_node"))
    lock_file = workspace.file("track_msgs/rosidl-proto.lock")
    workspace.build(
        *("--cmake-args", "-DROSIDL_PROTO_NUMBERING=sequential", "-DROSIDL_PROTO_EVENTS=ON"),
        "-DROSIDL_PROTO_PYTHON_ROOT=my_protos",
    )
    assert '"track_msgs/msg/Track"' in lock_file.read_text(encoding="utf-8")
    shown = workspace.run(
        "python -c 'from my_protos.track_msgs.srv import FindTrack_pb2 as pb2; print(dir(pb2))'"
    )
    assert "FindTrack_Event" in shown
    before = lock_file.read_bytes()
    workspace.build()
    assert lock_file.read_bytes() == before

    # As by a change of the lock file that comes from somebody else.
    lock_file.write_bytes(before.replace(b'"2 fixed32"', b'"9 fixed32"'))
    workspace.build()
    proto = workspace.folder / "install/track_msgs/share/track_msgs/msg/Track.proto"
    assert "fixed32 id = 9;" in proto.read_text(encoding="utf-8")

    # Without the options, which CMake has kept.
    shutil.rmtree(workspace.folder / "build")
    shutil.rmtree(workspace.folder / "install")
    output = workspace.build("--cmake-args", "-DROSIDL_PROTO_SKIP=ON")
    assert "rosidl_generator_proto: skipped, since ROSIDL_PROTO_SKIP is set" in output
    assert not list((workspace.folder / "install").rglob("*.proto"))


def test_a_python_that_cannot_be_run(workspace: Workspace) -> None:
    shutil.rmtree(workspace.file("scene_msgs"))
    shutil.rmtree(workspace.file("track_node"))

    output = workspace.build(
        *("--cmake-args", "-DROSIDL_PROTO_PYTHON=/nowhere/python3", "-DROSIDL_PROTO_STRICT=ON"),
        succeeds=False,
    )

    assert "/nowhere/python3 cannot be run (" in output
    assert "set ROSIDL_PROTO_PYTHON to a Python that has" in output


@pytest.mark.parametrize(
    ("path", "wrong", "place", "reason"),
    [
        (
            "msg/Track.msg",
            "int32 3d\n",
            "9:7",
            "'3d' is not a valid field name; use lower case letters, digits and single underscores, "
            "beginning with a letter",
        ),
        (
            "msg/Track.msg",
            "std_msgs/Heder other\n",
            "9:16",
            "std_msgs/msg/Heder was not found, but track_msgs/msg/Track.other",
        ),
        (
            "srv/FindTrack.srv",
            "int32[<=x] bounded\n",
            "6:1",
            "the size of array type 'int32[<=x]' must be a whole number above 0, not 'x'",
        ),
    ],
)
def test_a_wrong_definition(path: str, wrong: str, place: str, reason: str, workspace: Workspace) -> None:
    shutil.rmtree(workspace.file("scene_msgs"))
    shutil.rmtree(workspace.file("track_node"))
    file = workspace.file(f"track_msgs/{path}")
    with file.open("a", encoding="utf-8") as definition:
        definition.write(wrong)

    output = workspace.build("--cmake-args", "-DROSIDL_PROTO_STRICT=ON", succeeds=False)

    assert any(f"{file}:{place}" in line and reason in line for line in output.splitlines()), output
    assert "no protobuf types can be made of track_msgs" in output
    assert "Traceback" not in output


def add_package(
    workspace: Workspace, name: str, definitions: Mapping[str, str], depends: str, settings: str = ""
) -> None:
    """Add an interface package, made after track_msgs."""
    template = ROOT / "examples/workspace/src/track_msgs"
    manifest = (template / "package.xml").read_text(encoding="utf-8").replace("track_msgs", name)
    tags = "".join(f"<depend>{each}</depend>" for each in depends.split())
    cmake = (template / "CMakeLists.txt").read_text(encoding="utf-8").replace("track_msgs", name)
    found = "".join(f"find_package({each} REQUIRED)\n" for each in depends.split())
    files = {
        **definitions,
        "package.xml": manifest.replace("<depend>std_msgs</depend>", tags),
        "CMakeLists.txt": cmake.replace("find_package(std_msgs REQUIRED)\n", found + settings)
        .replace(
            "  msg/Track.msg\n  srv/FindTrack.srv\n  action/Follow.action\n",
            "  " + "\n  ".join(definitions) + "\n",
        )
        .replace("DEPENDENCIES std_msgs", f"DEPENDENCIES {depends}"),
    }
    write_package(workspace.file(name), files)


USE_OBJECTS = """
from object_msgs.msg import DetectedObject as Native
from rclpy.serialization import deserialize_message
from rosidl_proto.object_msgs.msg import DetectedObject, DetectedObjectAdapter as Adapter, Shape
native = deserialize_message(Adapter.to_cdr(DetectedObject(shape=Shape(radius=2.5))), Native)
print(native.shape.radius)
"""


def test_folders_and_what_cannot_be_served(workspace: Workspace) -> None:
    """A workspace as Autoware has it, with folders below `msg`; ROS builds all of it, also what we do not serve."""
    for name in ("scene_msgs", "track_msgs", "track_node"):
        shutil.rmtree(workspace.file(name))
    add_package(
        workspace,
        "object_msgs",
        {
            "msg/object_recognition/DetectedObject.msg": "std_msgs/Header header\nShape shape\n",
            "msg/object_recognition/shapes/Shape.msg": "float64 radius\n",
            "object_api/srv/FindObject.srv": "---\nDetectedObject[] objects\n",
        },
        "std_msgs",
    )
    sequential = "set(ROSIDL_PROTO_NUMBERING sequential)\n"
    add_package(workspace, "refused_msgs", {"msg/Part.msg": "int8 part\n"}, "std_msgs", sequential)
    lock_file = workspace.file("refused_msgs/rosidl-proto.lock")
    lock_file.write_text("<<<<<<< HEAD\n", encoding="utf-8")
    whole = {"msg/Whole.msg": "refused_msgs/Part[] parts\nobject_msgs/Shape shape\n"}
    add_package(workspace, "dependent_msgs", whole, "refused_msgs object_msgs")

    output = workspace.build("--symlink-install")

    assert "rosidl_generator_proto: object_msgs gets protobuf types and adapters" in output
    python = f"python -c '{USE_OBJECTS}'"
    assert workspace.run(python) == "2.5\n"
    warning = "rosidl_generator_proto: no protobuf types can be made of"
    assert re.search(rf"{warning} refused_msgs\.\s+{lock_file} is damaged: ", output)
    assert re.search(
        rf"{warning} dependent_msgs\.\s+dependent_msgs refers to refused_msgs, which was built without protobuf types: "
        "a warning says why when refused_msgs is built",
        output,
    )
    native = "python -c 'import dependent_msgs.msg as msg; print(msg.Whole(parts=[]))'"
    assert workspace.run(native).startswith("dependent_msgs.msg.Whole(parts=[], ")
    listed = dict(line.split(maxsplit=1) for line in workspace.run("rosidl-proto list").splitlines())
    assert "adapters in" in listed["object_msgs"]
    assert "adapters in" not in listed["refused_msgs"] + listed["dependent_msgs"]
    assert (
        workspace.run("rosidl-proto list object_msgs")
        .splitlines()[0]
        .endswith("share/object_msgs/object_recognition/DetectedObject.msg")
    )

    lock_file.unlink()
    assert warning not in workspace.build("--symlink-install")
    workspace.run("python -c 'from rosidl_proto.dependent_msgs.msg import Whole; Whole().parts.add(part=1)'")
