"""Copies our plugins to where PlotJuggler looks for plugins."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.plugins import plugin_path

VERSIONS = ("3", "4")
NAMES = {"protobuf": "rosidl_proto_protobuf.wasm", "ros2msg": "rosidl_proto_ros2msg.wasm"}
"""What our plugins are called there, by their encodings: PlotJuggler 3 loads one file of a name."""


@dataclass(frozen=True)
class Installed:
    """A plugin in its place.

    Attributes:
        path: Where it is.
        is_new: Whether it was copied now; else the same one was there.
    """

    path: Path
    is_new: bool


def plugin_folder(version: str = "3") -> Path:
    """Return where PlotJuggler looks for plugins of a user.

    Version 3 looks into `PlotJuggler` in the folder of Qt for data of users, `QStandardPaths::GenericDataLocation`, and
    version 4 into the folders in `plotjuggler/extensions` there.

    Args:
        version: The version of PlotJuggler, `3` or `4`.
    """
    named = os.environ.get("XDG_DATA_HOME", "")
    data = Path(named) if os.path.isabs(named) else Path.home() / ".local" / "share"
    return {"3": data / "PlotJuggler", "4": data / "plotjuggler" / "extensions" / "rosidl-proto"}[version]


def install_plugins(folder: Path, *, force: bool = False) -> list[Installed]:
    """Copy our plugins to a folder, which is made if it is not there. Those of other versions of ours are replaced.

    Args:
        folder: The folder.
        force: Replace other files of their names, too; without it they are an error, and nothing is copied.

    Raises:
        PluginError: Another file is there, the folder cannot be written, or the plugins cannot be built.
    """
    plugins = {folder / name: plugin_path(encoding).read_bytes() for encoding, name in NAMES.items()}
    try:
        old = {path: path.read_bytes() for path in plugins if os.path.lexists(path)}
        others = [str(path) for path, data in old.items() if not _is_ours(data)]
        if others and not force:
            raise PluginError(
                f"{', '.join(others)}: there is a file that is none of our plugins; --force replaces it"
            )
        folder.mkdir(parents=True, exist_ok=True)
        for path, data in plugins.items():
            if old.get(path) != data:
                partial = path.with_name(f".{path.name}.partial")
                partial.write_bytes(data)
                partial.replace(path)
    except OSError as error:
        raise PluginError(
            f"cannot write plugins to {folder}: {error.strerror}; choose another folder"
        ) from error
    return [Installed(path, old.get(path) != data) for path, data in plugins.items()]


def _is_ours(data: bytes) -> bool:
    return data.startswith(b"\0asm") and b"name: rosidl_adapter_proto " in data
