"""The CMake files of the ament_cmake hook, and installing them where the wheel did not put them.

ROS looks for generators in its ament index: every interface package that is built with a prefix on its path in which
`rosidl_generator_packages/rosidl_generator_proto` is found gets our output too.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.generate.output_tree import replace_file
from rosidl_adapter_proto.generate.render import templates_folder

CMAKE_PACKAGE = "rosidl_generator_proto"
INDEX_FILE = f"share/ament_index/resource_index/rosidl_generator_packages/{CMAKE_PACKAGE}"
CMAKE_FOLDER = f"share/{CMAKE_PACKAGE}/cmake"


def cmake_folder() -> Path:
    """Return the folder of the CMake files, for `-Drosidl_generator_proto_DIR`."""
    return templates_folder() / "cmake"


def install_hook(prefix: Path) -> list[Path]:
    """Install the ament_cmake hook to a prefix, such as that of a ROS that did not come from PyPI.

    Builds then run this Python, whichever other Python they find.

    Args:
        prefix: The prefix; it has to be an ament prefix already, since a new one would be on nobody's path.

    Returns:
        The files that were written.

    Raises:
        GenerateError: The prefix is none, or cannot be written.
    """
    if not os.path.isdir(prefix / "share" / "ament_index"):
        raise GenerateError(
            f"{prefix} is not a prefix of ROS packages: it has no share/ament_index; give one of those in "
            "AMENT_PREFIX_PATH, of a workspace one such as install/<package>"
        )
    contents = {f"{CMAKE_FOLDER}/{file.name}": file.read_bytes() for file in sorted(cmake_folder().iterdir())}
    python = f'set(_{CMAKE_PACKAGE}_python "{Path(sys.executable).as_posix()}")\n'
    contents[f"{CMAKE_FOLDER}/{CMAKE_PACKAGE}_python.cmake"] = python.encode()
    contents[INDEX_FILE] = b""
    try:
        for path, content in contents.items():
            (prefix / path).parent.mkdir(parents=True, exist_ok=True)
            replace_file(prefix / path, content)
    except OSError as error:
        raise GenerateError(f"cannot write to {prefix}: {error.strerror} ({error.filename})") from None
    return [prefix / path for path in contents]
