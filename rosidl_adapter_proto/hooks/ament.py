"""The ament_cmake hook: what the CMake files of `templates/cmake` run for every interface package that is built.

    python -m rosidl_adapter_proto.hooks.ament COMMAND @ARGUMENTS_FILE

`parse` and `check` run when the package is configured, so that our errors, which name the place, come before those of
ROS. `generate` runs when it is built. It writes two folders: `package` with what is generated of the package itself,
which CMake installs, and `dependencies` with the packages that it needs and that do not come with its dependencies:
those of a ROS that came as binaries. `install` installs these. What fails is an error here, and a warning of CMake.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import rosidl_adapter_proto
from rosidl_adapter_proto.errors import Error, GenerateError, RequestError
from rosidl_adapter_proto.generate import Options, Request, check_definitions, generate
from rosidl_adapter_proto.generate.lock import is_kept
from rosidl_adapter_proto.generate.manifest import read_manifest
from rosidl_adapter_proto.generate.output_tree import install
from rosidl_adapter_proto.generate.outputs import places
from rosidl_adapter_proto.generate.request import find_catalog
from rosidl_adapter_proto.generate.settings import OPTIONS, Kind, Setting, check_lock_file_is_used
from rosidl_adapter_proto.generate.targets.index import (
    RESOURCE_FOLDER,
    generated_packages,
    installed_package,
    is_skipped,
)
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.closure import closure
from rosidl_adapter_proto.interfaces.find import Source, interface_source
from rosidl_adapter_proto.interfaces.model import messages, references
from rosidl_adapter_proto.schema.numbering import SequentialNumbering

PACKAGE_FOLDER = "package"
DEPENDENCIES_FOLDER = "dependencies"
STAMP_FILE = "stamp"
"""Is touched when all is done."""
DEPFILE = "depfile"
"""Says what the stamp depends on, for make or ninja."""


@dataclass(frozen=True)
class Build:
    """A package that is built.

    Attributes:
        package: Its name.
        interfaces: Its definitions, each a base folder, a colon, and a path such as `msg/Track.msg`.
        dependencies: The `share` folders of the packages that it depends on.
        output: The folder to write.
        options: How to generate.
        prefix: The prefix to install to.
        python_folder: The folder of Python packages in that.
    """

    package: str
    interfaces: tuple[str, ...]
    dependencies: tuple[Path, ...]
    output: Path
    options: Options
    prefix: Path
    python_folder: str

    def own_source(self) -> Source:
        """Return the definitions of the package.

        Raises:
            DefinitionError: An interface is not in a folder msg, srv or action.
        """
        return interface_source(self.package, self.interfaces)

    def catalog(self) -> Catalog:
        """Return where definitions come from: the package, its dependencies, ROS, and the embedded store.

        Raises:
            DefinitionError: An interface is not in a folder msg, srv or action.
        """
        return find_catalog(self.dependencies, None, [self.own_source()])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command of the hook, and return its exit code; errors go to the standard error, as compilers write them."""
    parser = _parser()
    given = parser.parse_args(arguments)
    try:
        build = Build(
            given.package,
            tuple(given.interface),
            tuple(given.dependency),
            given.output,
            _options(given),
            given.prefix,
            given.python_folder,
        )
        COMMANDS[given.command](build)
    except Error as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def parse(build: Build) -> None:
    """Parse the definitions of a package, whatever they refer to.

    Raises:
        DefinitionError: One is not valid.
    """
    for definition in build.own_source().packages[build.package].values():
        definition.interface  # noqa: B018  # it is parsed when it is asked for


def check(build: Build) -> None:
    """Check the definitions of a package, and of all that it refers to.

    Raises:
        Error: Something is wrong with one.
    """
    catalog = build.catalog()
    _check_dependencies(build, catalog)
    check_definitions(Request((build.package,), dependencies=False), catalog, build.options)


def generate_package(build: Build) -> None:
    """Generate a package, and those of its dependencies that nobody provides.

    Raises:
        Error: Something is wrong with a definition, or files cannot be written.
    """
    catalog = build.catalog()
    _check_dependencies(build, catalog)
    own = Request((build.package,), dependencies=False)
    renumber = is_kept(build.options)
    result = generate(own, catalog, build.output / PACKAGE_FOLDER, build.options, renumber=renumber)
    for warning in result.warnings:
        print(f"Warning: {warning}", file=sys.stderr)
    needed = {name.package for name in result.interfaces} - {build.package}
    missing = tuple(sorted(needed - _provided(build, catalog)))
    folder = build.output / DEPENDENCIES_FOLDER
    if missing or read_manifest(folder) is not None:
        others = Request(missing, dependencies=False)
        generate(others, catalog, folder, build.options, renumber=renumber)
    _write_depfile(build)


def _check_dependencies(build: Build, catalog: Catalog) -> None:
    """Check that no package that the definitions refer to was built without protobuf types.

    They could be made here, but with other field numbers than that package will have once its own are made.

    Raises:
        Error: There is one, or a definition is not valid.
    """
    needed = {
        name.package
        for definition in catalog.package(build.package).values()
        for message in messages(definition.interface, events=build.options.events)
        for _, name in references(message)
    }
    for folder in build.dependencies:
        if folder.name in needed and is_skipped(folder.parents[1], folder.name):
            raise GenerateError(
                f"{build.package} refers to {folder.name}, which was built without protobuf types: "
                f"a warning says why when {folder.name} is built"
            )


def _provided(build: Build, catalog: Catalog) -> set[str]:
    """Return the packages that come with the dependencies of a package.

    A dependency that was built with this hook, from the same definitions and in the same way, has seen to everything
    that it needs itself. What else happens to be installed may be gone tomorrow, and does not count.
    """
    provided: set[str] = set()
    for folder in build.dependencies:
        name = folder.name
        try:
            installed = installed_package(folder.parents[1], name)
        except GenerateError:
            continue  # another version of this program has made it: it is made again, here
        if installed == generated_packages(catalog.package(name), catalog, build.options)[name]:
            provided.update(each.package for each in closure(catalog, [name], events=build.options.events))
    return provided


def _write_depfile(build: Build) -> None:
    """Write what the output depends on, besides the definitions, which CMake knows."""
    needs = [Path(rosidl_adapter_proto.__file__)]
    needs += [folder.parents[1] / RESOURCE_FOLDER / folder.name for folder in build.dependencies]
    if build.options.numbering == SequentialNumbering.name:
        needs.append(build.options.lock_file)
    stamp = build.output / STAMP_FILE
    target, *files = [str(file).replace(" ", r"\ ") for file in (stamp, *filter(os.path.exists, needs))]
    try:
        (build.output / DEPFILE).write_text(f"{target}: " + " \\\n  ".join(files) + "\n", encoding="utf-8")
        stamp.touch()
    except OSError as error:
        raise GenerateError(f"cannot write to {build.output}: {error.strerror} ({error.filename})") from None


def install_dependencies(build: Build) -> None:
    """Install the dependencies that were generated. Packages that are built at the same time may install the same ones.

    Raises:
        GenerateError: Files cannot be written.
    """
    install(build.output / DEPENDENCIES_FOLDER, build.prefix, places(build.python_folder))


COMMANDS = {
    "parse": parse,
    "check": check,
    "generate": generate_package,
    "install": install_dependencies,
}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m rosidl_adapter_proto.hooks.ament", usage=argparse.SUPPRESS, fromfile_prefix_chars="@"
    )
    parser.add_argument("command", choices=COMMANDS)
    parser.add_argument("--package", required=True)
    parser.add_argument("--interface", action="append", required=True)
    parser.add_argument("--dependency", action="append", type=Path, default=[])
    parser.add_argument("--output", type=Path, required=True)
    for each in OPTIONS:
        parser.add_argument(f"--{each.name}", type=partial(_option_value, each), default=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, default=Path())  # that paths of options are relative to
    parser.add_argument("--prefix", type=Path, default=Path())
    parser.add_argument("--python-folder", default="")
    return parser


def _option_value(option: Setting, text: str) -> Any:
    value = option.from_text(text)
    try:
        option.check(value)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return value


def _options(given: argparse.Namespace) -> Options:
    """Return how to generate.

    Raises:
        RequestError: A lock file was given that there is no use for.
    """
    values = {each: getattr(given, each.attribute, each.default) for each in OPTIONS}
    if hasattr(given, "lock_file"):
        try:
            check_lock_file_is_used(getattr(given, "numbering", Options().numbering))
        except ValueError as error:
            raise RequestError(f"ROSIDL_PROTO_LOCK_FILE {error}") from None
    return Options.of(
        {
            each.name: given.folder / value if each.kind is Kind.PATH else value
            for each, value in values.items()
        }
    )


if __name__ == "__main__":
    sys.exit(main())
