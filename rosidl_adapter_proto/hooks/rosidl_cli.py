"""The type `proto` of ROS's own command line: `rosidl generate -t proto`."""

from __future__ import annotations

import sys
from pathlib import Path

from rosidl_cli.command.generate.extensions import GenerateCommandExtension

from rosidl_adapter_proto.errors import Error
from rosidl_adapter_proto.generate import Request, generate
from rosidl_adapter_proto.generate.manifest import read_manifest
from rosidl_adapter_proto.generate.request import find_catalog
from rosidl_adapter_proto.interfaces.find import interface_source


class GenerateProto(GenerateCommandExtension):  # type: ignore[misc, unused-ignore]
    """Generates `.proto` files, protobuf classes and adapters.

    What cannot be generated is an error, but among other types it is skipped with a warning: these do not need it.
    """

    def __init__(self, name: str, strict: bool = False) -> None:
        """Make the extension.

        Args:
            name: The name of the type.
            strict: Whether it is always an error, as by `-t 'proto[strict: true]'`.
        """
        super().__init__(name)
        self._strict = strict

    def generate(
        self,
        package_name: str,
        interface_files: list[str],
        include_paths: list[str],
        output_path: Path,
        type_description_files: list[str] | None = None,
    ) -> list[str]:
        """Generate a package, and what it depends on.

        Args:
            package_name: The package.
            interface_files: Its definitions; each may have a base folder and a colon before its path.
            include_paths: Folders of packages to find dependencies in.
            output_path: The folder to write; among other types, it has the name of this one (rosidl_cli).
            type_description_files: Not needed.

        Returns:
            The generated files.

        Raises:
            Error: A definition is wrong or missing, or files cannot be written.
        """
        try:
            own = interface_source(package_name, interface_files)
            names = tuple(own.packages[package_name])
            catalog = find_catalog(map(Path, include_paths), None, [own])
            generate(Request(types=names), catalog, output_path)
        except Error as error:
            if self._strict or output_path.name != self.name:
                raise
            print(f"Warning: no protobuf types can be made of {package_name}: {error}", file=sys.stderr)
            return []
        manifest = read_manifest(output_path)
        return [str(output_path / path) for path in manifest.outputs] if manifest else []
