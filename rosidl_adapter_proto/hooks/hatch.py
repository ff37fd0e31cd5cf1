"""The hatchling build hook: `[tool.hatch.build.hooks.rosidl-proto]` in a pyproject.toml with `[tool.rosidl-proto]`."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.plugin import hookimpl

from rosidl_adapter_proto.errors import GenerateError, RequestError
from rosidl_adapter_proto.generate.configuration import SECTION, read_configuration
from rosidl_adapter_proto.hooks.project import generate_project


class RosidlProtoBuildHook(BuildHookInterface[Any]):
    """Puts generated packages into wheels, editable ones too."""

    PLUGIN_NAME = "rosidl-proto"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Generate, and have the wheel include what was made.

        Raises:
            Error: The project has no configuration, it or a definition is wrong, or files cannot be written.
        """
        if self.target_name != "wheel":
            return
        configuration = read_configuration(Path(self.root))
        if configuration is None:
            raise RequestError(
                f"{Path(self.root, 'pyproject.toml')} has the build hook {self.PLUGIN_NAME}, but no [{SECTION}], "
                "which says what to generate"
            )
        try:
            self._temporary = TemporaryDirectory()
        except OSError as error:
            raise GenerateError(
                f"cannot make a temporary folder: {error.strerror}; set TMPDIR to another folder"
            ) from error
        project = generate_project(configuration, Path(self._temporary.name))
        for kind in ("force_include", "force_include_editable"):
            build_data[kind][str(project.root_folder)] = project.python_root
        build_data["shared_data"].update((str(file), place) for file, place in project.shared_files())

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was generated."""
        if self.target_name == "wheel":
            self._temporary.cleanup()


@hookimpl
def hatch_register_build_hook() -> type[RosidlProtoBuildHook]:
    """Return the hook, for hatchling."""
    return RosidlProtoBuildHook
