"""What the hooks of Python build backends share: generating what a project's configuration names."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rosidl_adapter_proto.generate import Request, generate
from rosidl_adapter_proto.generate.configuration import Configuration
from rosidl_adapter_proto.generate.lock import is_kept
from rosidl_adapter_proto.generate.outputs import SHARED_FOLDERS


@dataclass(frozen=True)
class GeneratedProject:
    """What a configuration names, generated into a folder.

    Attributes:
        output: The folder.
        python_root: The namespace package in its folder `python`.
    """

    output: Path
    python_root: str

    @property
    def root_folder(self) -> Path:
        """The folder of the namespace package."""
        return self.output / "python" / self.python_root

    def packages(self) -> Iterator[tuple[str, Path]]:
        """Yield the Python packages, with their folders."""
        for file in sorted(self.root_folder.rglob("__init__.py")):
            folder = file.parent
            yield ".".join(folder.relative_to(self.output / "python").parts), folder

    def shared_files(self) -> Iterator[tuple[Path, str]]:
        """Yield the files that a prefix has outside Python's folders, with their paths in the prefix."""
        for part, place in SHARED_FOLDERS.items():
            for file in sorted((self.output / part).rglob("*")):
                if file.is_file():
                    yield file, f"{place}/{file.relative_to(self.output / part).as_posix()}"


def generate_project(configuration: Configuration, output: Path) -> GeneratedProject:
    """Generate what a configuration names; of a type, its whole package.

    Args:
        configuration: The configuration; its `output` is for the command line alone.
        output: The folder to write, below the folder of the build.

    Raises:
        Error: The configuration or a definition is wrong, or files cannot be written.
    """
    request, catalog, options = configuration.request()
    # Other projects may install the same package, and Python takes all of it from one of them: so it comes whole.
    packages = dict.fromkeys((*request.packages, *(name.package for name in request.types)))
    whole = Request(tuple(packages), dependencies=request.dependencies)
    result = generate(whole, catalog, output, options, renumber=is_kept(options))
    for warning in result.warnings:
        print(f"Warning: {warning}", file=sys.stderr)
    return GeneratedProject(output, options.python_root)
