"""Small packages of definitions to generate from, and what a folder holds."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path


def write_package(folder: Path, definitions: Mapping[str, str], name: str = "") -> Path:
    """Write a package.

    Args:
        folder: Its folder; its last part is the name of the package.
        definitions: The text of each definition by its path, such as `msg/Track.msg`.
        name: The name in its package.xml; without it there is none.
    """
    for path, text in definitions.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    if name:
        (folder / "package.xml").write_text(f"<package><name>{name}</name></package>", encoding="utf-8")
    return folder


def content(folder: Path) -> dict[str, bytes | None]:
    """Return what a folder holds: the content of each file by its path, and None for each folder."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


def times(folder: Path) -> dict[str, int]:
    """Return when each file and folder was last changed, in nanoseconds."""
    return {path.relative_to(folder).as_posix(): path.stat().st_mtime_ns for path in folder.rglob("*")}
