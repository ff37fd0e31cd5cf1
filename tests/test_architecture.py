"""Imports go one way, and the repository speaks of itself alone."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "rosidl_adapter_proto"

# A part of the package imports only parts with a lower number, and itself; `errors` is for all.
FLOORS = {
    "interfaces": 1,
    "schema": 2,
    "transcode": 3,
    "adapter": 4,
    "generate": 5,
    "ros": 5,
    "converters": 5,
    "bags": 6,
    "plotjuggler": 7,
    "hooks": 8,
    "cli": 9,
    "time": 1,
    "errors": 0,
}
ENTRANCES = ("__init__", "__main__")
ONLY_GENERATING = {"jinja2", "black", "lark", "rosbags", "grpc_tools", "click"}


def imports(file: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}:{node.lineno}: imports are absolute"
            yield from ((node.lineno, f"{node.module}.{alias.name}") for alias in node.names)


def floor_name(file: Path) -> str:
    return file.relative_to(PACKAGE).parts[0].removesuffix(".py")


def test_imports_go_one_way() -> None:
    wrong = []
    for file in sorted(PACKAGE.rglob("*.py")):
        here = floor_name(file)
        if here in ENTRANCES:
            continue
        for line, name in imports(file):
            top, _, rest = name.partition(".")
            there = rest.partition(".")[0]
            if top == PACKAGE.name and there in FLOORS and there != here and FLOORS[there] >= FLOORS[here]:
                wrong.append(f"{file}:{line}: {here} imports {there}")
            if top == "rclpy" and here != "ros":
                wrong.append(f"{file}:{line}: rclpy is imported outside ros/")
            if here in ("adapter", "transcode", "errors") and top in ONLY_GENERATING:
                wrong.append(f"{file}:{line}: {top} is only for generating")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("folder", ["bags", "plotjuggler"])
def test_the_architecture_says_what_each_file_does(folder: str) -> None:
    text = (PACKAGE.parent / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = text.partition(f"## The files of `{folder}/`\n")[2].partition("\n## ")[0]
    missing = [
        file.name
        for file in sorted((PACKAGE / folder).glob("*.py"))
        if file.stem not in ENTRANCES and f"`{file.name}`" not in table
    ]
    assert not missing
