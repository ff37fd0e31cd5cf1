"""What is checked before a commit is what `make check` checks."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from ruamel.yaml import YAML

ROOT = Path(__file__).parent.parent


def test_hooks_of_commits_are_the_checks() -> None:
    (local,) = YAML(typ="safe").load(ROOT / ".pre-commit-config.yaml")["repos"]
    assert local["repo"] == "local"
    (checks,) = re.findall("^check: (.*)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)

    assert [hook["entry"] for hook in local["hooks"]] == [f"make {check}" for check in checks.split()]


def test_each_check_is_there() -> None:
    (local,) = YAML(typ="safe").load(ROOT / ".pre-commit-config.yaml")["repos"]
    for hook in local["hooks"]:
        command = [*hook["entry"].split(), "--dry-run"]
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
