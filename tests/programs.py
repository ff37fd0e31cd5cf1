"""Running programs in environments of their own."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Mapping
from pathlib import Path


def run(*command: str | Path, folder: Path, code: int = 0, variables: Mapping[str, str] | None = None) -> str:
    """Run a program, and return what it prints: of one that fails, what it says of its errors.

    Args:
        command: The program and its arguments.
        folder: The current folder.
        code: The exit code that it must have.
        variables: Variables of its environment, which has none for Python.
    """
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    environment.update(variables or {})
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=False, text=True)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stderr if code else done.stdout
