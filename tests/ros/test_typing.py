"""Type checkers know which protobuf class a callback gets."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.ros.support import ROOT

FOLDER = Path(__file__).with_name("typing")
FILES = [FOLDER / "positive.py", FOLDER / "negative.py", ROOT / "examples" / "port" / "with_protobuf.py"]
STAND_IN = Path(__file__).with_name("stand_in")


def expected_errors(file: Path) -> set[int]:
    lines = file.read_text().splitlines()
    return {number for number, line in enumerate(lines, 1) if "# error" in line}


def mypy(file: Path, generated: Path) -> dict[int, str]:
    """Return the errors that mypy finds in a file, by line."""
    pytest.importorskip("mypy", reason="needs mypy: pip install '.[test]'")
    result = subprocess.run(
        [
            sys.executable,
            "-m",
            "mypy",
            "--strict",
            "--output",
            "json",
            "--config-file",
            "",
            str(file),
        ],
        env={**os.environ, "MYPYPATH": os.pathsep.join(map(str, (generated, ROOT, STAND_IN)))},
        cwd=generated.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    errors = [json.loads(line) for line in result.stdout.splitlines() if line.startswith("{")]
    return {error["line"]: error["message"] for error in errors if Path(error["file"]).name == file.name}


def pyright(file: Path, generated: Path) -> dict[int, str]:
    """Return the errors that pyright finds in a file, by line."""
    pytest.importorskip("pyright", reason="needs pyright: pip install '.[test]'")
    project = generated.parent / file.stem
    project.mkdir()
    shutil.copy(file, project)
    paths = [str(generated), str(ROOT), str(STAND_IN)]
    (project / "pyrightconfig.json").write_text(json.dumps({"extraPaths": paths}))
    result = subprocess.run(
        [sys.executable, "-m", "pyright", "--outputjson", "-p", str(project), "--pythonpath", sys.executable],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.stdout.startswith("{"), result.stdout + result.stderr
    found = json.loads(result.stdout)["generalDiagnostics"]
    return {
        each["range"]["start"]["line"] + 1: each["message"] for each in found if each["severity"] == "error"
    }


@pytest.mark.parametrize("check", [mypy, pyright])
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_typing(generated: Path, check: object, file: Path) -> None:
    if not find_spec("rclpy.subscription_content_filter_options"):
        pytest.skip("rclpy before Kilted has few type hints")
    found = check(file, generated)  # type: ignore[operator]
    assert set(found) == expected_errors(file), found
