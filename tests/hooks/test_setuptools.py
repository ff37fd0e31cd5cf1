"""What the setuptools hook does to other projects, and when: nothing, and late. `test_backends` builds real ones."""

from __future__ import annotations

import sys
import tarfile
from pathlib import Path

import pytest

from tests.programs import run

SETUP = "from setuptools import setup\nsetup(name='some', version='1.2.3', py_modules=[])\n"


@pytest.fixture
def project(folder: Path) -> Path:
    """A project without a configuration."""
    (folder / "setup.py").write_text(SETUP)
    return folder


def setup(project: Path, *arguments: str, code: int = 0) -> str:
    return run(sys.executable, "setup.py", "--quiet", *arguments, folder=project, code=code)


@pytest.mark.parametrize("text", ["", "[project\n", "[tool.other]\nrosidl-proto = 1\n"])
def test_a_project_that_knows_nothing_of_us(text: str, project: Path) -> None:
    """Not even files that are not valid are any business of the hook."""
    if text:
        (project / "setup.cfg").write_text("[metadata]\ndescription = rosidl-proto is mentioned\n")
        (project / "other.toml").write_text(text)

    assert setup(project, "--version") == "1.2.3\n"
    setup(project, "build")
    assert not (project / "build/rosidl_proto").exists()


def test_nothing_is_generated_before_it_is_built(project: Path) -> None:
    (project / "setup.cfg").write_text("[tool.rosidl-proto]\npackages = no_such_package\n")

    assert setup(project, "--version") == "1.2.3\n"
    setup(project, "egg_info")
    assert (
        setup(project, "build", code=1)
        .splitlines()[-1]
        .startswith("error: rosidl-proto: package 'no_such_package' was not found; looked in ")
    )


def test_settings_that_are_wrong(project: Path) -> None:
    (project / "setup.cfg").write_text("[tool.rosidl-proto]\npackage = std_msgs\n")
    assert "error: rosidl-proto: setup.cfg: [tool.rosidl-proto] has no setting 'package'" in setup(
        project, "build", code=1
    ).replace(f"{project}/", "")
    (project / "setup.cfg").write_text("[tool.rosidl-proto]\ndeps = yes\n")
    assert (
        "error: rosidl-proto: setup.cfg: [tool.rosidl-proto] names nothing to generate; set `packages`"
        in setup(project, "build", code=1).replace(f"{project}/", "")
    )
    (project / "setup.cfg").write_text("[tool.rosidl_proto]\npackages = std_msgs\n")
    assert (
        "error: rosidl-proto: setup.cfg: [tool.rosidl_proto] is not read; did you mean [tool.rosidl-proto]?"
        in setup(project, "build", code=1).replace(f"{project}/", "")
    )


def test_build_and_source_distribution(project: Path) -> None:
    """What was generated is in what is built, and not in the sources."""
    (project / "setup.cfg").write_text(
        "[tool.rosidl-proto]\npackages = builtin_interfaces\ndistro = kilted\n"
    )

    setup(project, "build")
    setup(project, "sdist", "--formats", "tar")

    assert (project / "build/lib/rosidl_proto/builtin_interfaces/msg/Time_pb2.py").is_file()
    assert b"Time_pb2" not in (project / "dist/some-1.2.3.tar").read_bytes()


def test_the_lock_file_is_a_source(project: Path) -> None:
    (project / "setup.cfg").write_text(
        "[tool.rosidl-proto]\npackages = builtin_interfaces\nnumbering = sequential\nlock-file = numbers.lock\n"
    )
    setup(project, "sdist", "--formats", "tar")
    setup(project, "build")

    setup(project, "sdist", "--formats", "tar", "--dist-dir", "again")

    for folder, is_there in (("dist", False), ("again", True)):
        with tarfile.open(project / folder / "some-1.2.3.tar") as sources:
            assert ("some-1.2.3/numbers.lock" in sources.getnames()) == is_there
