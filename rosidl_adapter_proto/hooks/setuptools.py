"""The setuptools hook, which ament_python packages use as well.

setuptools calls `finalize_distribution_options` for every project that is built in this environment. Of those with
`[tool.rosidl-proto]` in their pyproject.toml or setup.cfg, it extends two commands: `build_py` generates when it runs,
and what it made is then packages and data files like the project's own, for wheels, editable installs and
`setup.py install` alike; `develop`, which `colcon build --symlink-install` uses, links the generated packages to
where the project itself is imported from.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from setuptools import Distribution
from setuptools.command.build_py import build_py
from setuptools.errors import SetupError

FOLDER_NAME = "rosidl_proto"
"""The folder below the build folder that is generated into."""


def finalize_distribution_options(distribution: Distribution) -> None:
    """Extend the commands of a project that has a configuration."""
    folder = _project_folder()
    if not any(_mentions_us(folder / name) for name in ("pyproject.toml", "setup.cfg")):
        return
    # A project may have nothing but what is generated, and setuptools would then not run build_py.
    distribution.has_pure_modules = lambda: True  # type: ignore[attr-defined, method-assign, unused-ignore]
    # Commands that are made before build_py runs keep this list, and see what it adds. An editable wheel has data files
    # only where the distribution says so under this name.
    distribution.data_files = list(distribution.data_files or ())
    distribution.has_data = distribution.has_data_files  # type: ignore[attr-defined, unused-ignore]
    for name, extend in (("build_py", _build_py), ("develop", _develop)):
        command: Any = distribution.get_command_class(name)
        if not hasattr(command, "rosidl_proto_project"):
            distribution.cmdclass[name] = extend(command, folder)


def _project_folder() -> Path:
    """Return where the configuration is: beside setup.py, which colcon links into its build folder."""
    setup = Path("setup.py")
    return setup.resolve().parent if setup.is_symlink() else Path.cwd()


def _mentions_us(file: Path) -> bool:
    """Tell whether to look closer: this runs in the builds of projects that know nothing of us."""
    try:
        text = file.read_bytes()
    except OSError:
        return False
    return b"rosidl-proto" in text or b"[tool.rosidl_proto]" in text  # misspelt, which is an error


def _build_py(base: type[build_py], folder: Path) -> type[build_py]:
    class BuildPy(base):  # type: ignore[misc]
        """Generates, and then builds what was generated with the rest."""

        rosidl_proto_project = folder

        def run(self) -> None:
            """Generate, and build."""
            add_to_distribution(self.distribution, folder, self)
            # These were read before there was anything generated.
            self.packages = self.distribution.packages
            self.package_dir = self.distribution.package_dir
            self.package_data = self.distribution.package_data
            self.__dict__.pop("data_files", None)
            super().run()

        def get_source_files(self) -> list[str]:
            """Return the sources, with the lock file: without it, builds from them would make up other numbers."""
            return [*super().get_source_files(), *_lock_files(folder)]

    return BuildPy


def _lock_files(folder: Path) -> list[str]:
    """Return the lock file of a project, if it has one in its folder."""
    from rosidl_adapter_proto.errors import RequestError
    from rosidl_adapter_proto.generate.configuration import read_configuration

    try:
        configuration = read_configuration(folder)
    except RequestError:
        return []  # whoever builds is told
    file = os.path.relpath(configuration.values["lock-file"]) if configuration else ""
    return [file] if os.path.isfile(file) and not file.startswith(os.pardir) else []


def _develop(base: Any, folder: Path) -> Any:
    if not hasattr(base, "install_for_development"):
        return base  # newer versions of setuptools install an editable wheel instead

    class Develop(base):  # type: ignore[misc]
        """Generates, and links the namespace package to where the project is imported from."""

        rosidl_proto_project = folder

        def run(self) -> None:
            """Link what is generated, or take the link away, and do the rest."""
            if self.uninstall:
                for link in Path(self.egg_path).iterdir():
                    if link.is_symlink() and FOLDER_NAME in os.readlink(link).split(os.sep):
                        link.unlink()
            else:
                root = add_to_distribution(self.distribution, folder, self)
                if root is not None:
                    link = Path(self.egg_path, root.name)
                    if link.is_symlink():
                        link.unlink()
                    link.symlink_to(root.resolve())
            super().run()

    return Develop


def add_to_distribution(distribution: Any, folder: Path, command: Any) -> Path | None:
    """Generate what a project names, and make it part of what is built.

    Args:
        distribution: The project.
        folder: The folder that has its configuration.
        command: A command that runs.

    Returns:
        The folder of the generated namespace package; None if the project has no configuration after all.

    Raises:
        SetupError: Nothing can be generated.
    """
    from rosidl_adapter_proto.errors import Error
    from rosidl_adapter_proto.generate.configuration import read_configuration
    from rosidl_adapter_proto.hooks.project import generate_project

    output = Path(command.get_finalized_command("build").build_base, FOLDER_NAME)
    try:
        configuration = read_configuration(folder)
        if configuration is None:
            return None
        project = generate_project(configuration, output)
    except Error as error:
        raise SetupError(f"rosidl-proto: {error}") from error
    distribution.packages = list(distribution.packages or ())
    distribution.package_dir = dict(distribution.package_dir or {})
    distribution.package_data = dict(distribution.package_data or {})
    for name, package_folder in project.packages():
        if name not in distribution.packages:
            distribution.packages.append(name)
        distribution.package_dir[name] = os.path.relpath(package_folder)
        files = [file for file in sorted(package_folder.iterdir()) if file.is_file()]
        distribution.package_data[name] = [file.name for file in files if file.suffix != ".py"]
    for file, place in project.shared_files():
        distribution.data_files.append((os.path.dirname(place), [os.path.relpath(file)]))
    return project.root_folder
