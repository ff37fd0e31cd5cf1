"""What the hatchling hook says when it cannot work, and what sdists have. `test_backends` builds real projects."""

from __future__ import annotations

import sys
import tarfile
from pathlib import Path

import pytest

from tests.programs import run

PROJECT = """
[project]
name = "some"
version = "1.2.3"
[tool.hatch.build.targets.wheel]
bypass-selection = true
[tool.hatch.build.hooks.rosidl-proto]
"""


@pytest.fixture
def project(folder: Path) -> Path:
    """A project with the hook, and without settings."""
    pytest.importorskip("hatchling")
    (folder / "pyproject.toml").write_text(PROJECT)
    return folder


def build(project: Path, target: str, code: int = 0) -> str:
    return run(sys.executable, "-m", "hatchling", "build", "-t", target, folder=project, code=code)


def test_without_settings(project: Path) -> None:
    assert (
        build(project, "wheel", code=1)
        .splitlines()[-1]
        .endswith(
            f"{project}/pyproject.toml has the build hook rosidl-proto, but no [tool.rosidl-proto], which says what to "
            "generate"
        )
    )


def test_settings_that_name_nothing(project: Path) -> None:
    (project / "pyproject.toml").write_text(f"{PROJECT}\n[tool.rosidl-proto]\n")

    assert (
        build(project, "wheel", code=1)
        .splitlines()[-1]
        .endswith(f"{project}/pyproject.toml: [tool.rosidl-proto] names nothing to generate; set `packages`")
    )


def test_sdists_have_nothing_generated(project: Path) -> None:
    build(project, "sdist")

    with tarfile.open(project / "dist/some-1.2.3.tar.gz") as archive:
        assert sorted(archive.getnames()) == ["some-1.2.3/PKG-INFO", "some-1.2.3/pyproject.toml"]
