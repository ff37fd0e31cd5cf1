"""Projects that setuptools and hatchling build, in clean environments, as `pip install` does it."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
import venv
from pathlib import Path

import pytest

from rosidl_adapter_proto.errors import GenerateError
from tests.folders import content
from tests.programs import run

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```(sh|toml)\n(.*?)^```", re.MULTILINE | re.DOTALL)
USE = """
import tracker
from rosidl_proto.track_msgs.msg import Track, TrackAdapter
assert TrackAdapter.from_cdr(tracker.serialized_track(7)).label == "robot"
from rosidl_proto.std_msgs.msg import Header
print(Track.DESCRIPTOR.full_name)
"""


class Project:
    """A copy of an example, and a clean environment to install it to."""

    def __init__(self, name: str, folder: Path, wheel: Path) -> None:
        shutil.copytree(ROOT / "examples" / "workspace", folder / "workspace")
        shutil.copytree(ROOT / "examples" / name, folder / name)
        self.folder = folder / name
        self.environment = folder / "venv"
        self.definition = folder / "workspace/src/track_msgs/msg/Track.msg"
        self._wheels = str(wheel.parent)
        venv.create(self.environment, with_pip=True, symlinks=True)

    def run(self, program: str, *arguments: str, code: int = 0) -> str:
        """Run a program of the environment."""
        return run(
            self.environment / "bin" / program,
            *arguments,
            folder=self.folder if program == "pip" else self.environment,
            code=code,
            variables={"PIP_FIND_LINKS": self._wheels, "PIP_DISABLE_PIP_VERSION_CHECK": "1"},
        )


@pytest.mark.parametrize("backend", ["setuptools", "hatch"])
def test_the_document(backend: str, wheel: Path, tmp_path: Path) -> None:
    """Its commands run, but for the building of the wheel, which is there already."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    (tmp_path / "wheels").symlink_to(wheel.parent)
    environment = tmp_path / "venv"
    venv.create(environment, with_pip=True, symlinks=True)
    blocks = BLOCK.findall((ROOT / f"docs/build-{backend}.md").read_text(encoding="utf-8"))
    (settings,) = (text for kind, text in blocks if kind == "toml")
    (commands,) = (text for kind, text in blocks if kind == "sh")
    assert settings == (ROOT / f"examples/{backend}_project/pyproject.toml").read_text(encoding="utf-8")

    commands = re.sub("^pip wheel .*$", "", commands, flags=re.MULTILINE)
    path = os.pathsep.join([str(environment / "bin"), os.environ["PATH"]])
    run("bash", "-euc", commands, folder=tmp_path, variables={"PATH": path})

    assert run(environment / "bin/python", "-c", USE, folder=environment) == "track_msgs.msg.pb.Track\n"


@pytest.mark.parametrize("options", [(), ("--editable",)], ids=["wheel", "editable"])
@pytest.mark.parametrize("name", ["setuptools_project", "hatch_project"])
def test_pip_install(name: str, options: tuple[str, ...], wheel: Path, tmp_path: Path) -> None:
    project = Project(name, tmp_path, wheel)
    before = content(project.folder)

    project.run("pip", "install", "--quiet", *options, ".")

    assert project.run("python", "-W", "error", "-c", USE) == "track_msgs.msg.pb.Track\n"
    share = project.environment / "share"
    assert (share / "track_msgs/msg/Track.proto").is_file()
    assert (share / "track_msgs/action/Follow.proto").is_file()
    listed = project.run("rosidl-proto", "list")
    for package in ("track_msgs", "std_msgs", "builtin_interfaces", "unique_identifier_msgs"):
        (line,) = (line for line in listed.splitlines() if line.split()[0] == package)
        assert line.endswith(f"adapters in {project.environment}")
    (site,) = (project.environment / "lib").glob("python*/site-packages")
    if not options:
        assert (site / "rosidl_proto/track_msgs/msg/Track_pb2.pyi").is_file()
        assert (site / "rosidl_proto/track_msgs/msg/py.typed").is_file()

    if options:  # an editable install knows changes of definitions when it is installed again
        with project.definition.open("a", encoding="utf-8") as definition:
            definition.write("bool is_lost\n")
        project.run("pip", "install", "--quiet", "--no-deps", "--force-reinstall", *options, ".")
        changed = USE.replace("Track.DESCRIPTOR.full_name", "Track(is_lost=True)")
        assert project.run("python", "-c", changed) == "is_lost: true\n\n"

    project.run("pip", "uninstall", "--quiet", "--yes", "tracker")
    assert not list(site.glob("rosidl_proto/**/*.py"))
    assert not list(share.rglob("*.proto"))
    made = {path.split("/")[0] for path in set(content(project.folder)) - set(before)}
    assert made <= {"build", "tracker.egg-info", "tracker"}


@pytest.mark.parametrize("name", ["setuptools_project", "hatch_project"])
def test_what_is_wrong_stops_the_build(name: str, wheel: Path, tmp_path: Path) -> None:
    project = Project(name, tmp_path, wheel)
    project.definition.write_text("int32 x\nint32 3d\n", encoding="utf-8")

    error = project.run("pip", "install", ".", code=1)

    assert f"{project.definition.resolve()}:2:7: '3d' is not a valid field name" in error.replace(
        str(project.folder / ".."), str(project.folder.parent)
    )


def test_no_temporary_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hatch = pytest.importorskip("rosidl_adapter_proto.hooks.hatch", reason="needs hatchling")
    (folder / "pyproject.toml").write_text('[tool.rosidl-proto]\npackages = ["builtin_interfaces"]\n')
    hook = hatch.RosidlProtoBuildHook(str(folder), {}, None, None, str(folder / "dist"), "wheel")
    monkeypatch.setattr(tempfile, "tempdir", "/nowhere")

    with pytest.raises(GenerateError) as error:
        hook.initialize("standard", {})

    assert str(error.value) == (
        "cannot make a temporary folder: No such file or directory; set TMPDIR to another folder"
    )
