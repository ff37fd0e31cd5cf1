"""The ament_cmake hook: what the CMake files of `templates/cmake` run for every interface package that is built.

    python -m rosidl_adapter_proto.hooks.ament COMMAND @ARGUMENTS_FILE

`parse` and `check` run when the package is configured, so that our errors, which name the place, come before those of
ROS. `generate` runs when it is built. It writes two folders: `package` with what is generated of the package itself,
and `dependencies` with the packages that it needs and that nobody has installed: those of a ROS that came as binaries.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from rosidl_adapter_proto.errors import Error
from rosidl_adapter_proto.generate import (
    Options,
    Request,
    check_definitions,
    generate,
    tool_files,
)
from rosidl_adapter_proto.generate.configuration import NUMBERINGS
from rosidl_adapter_proto.generate.index import RESOURCE_TYPE, generated_packages, installed_packages
from rosidl_adapter_proto.generate.manifest import read_manifest
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.interfaces.sources import (
    Source,
    Sources,
    folder_source,
    interface_source,
    prefix_sources,
    prefixes,
    store_source,
)

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
    """

    package: str
    interfaces: tuple[str, ...]
    dependencies: tuple[Path, ...]
    output: Path
    options: Options

    def own_source(self) -> Source:
        """Return the definitions of the package.

        Raises:
            DefinitionError: An interface is not in a folder msg, srv or action.
        """
        return interface_source(self.package, self.interfaces)

    def sources(self) -> Sources:
        """Return where definitions come from: the package, its dependencies, ROS, and the embedded store.

        Raises:
            DefinitionError: An interface is not in a folder msg, srv or action.
        """
        dependencies = [folder_source(folder) for folder in self.dependencies]
        return Sources((self.own_source(), *dependencies, *prefix_sources(), store_source()))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command of the hook, and return its exit code; errors go to the standard error, as compilers write them."""
    parser = _parser()
    given = parser.parse_args(arguments)
    build = Build(
        given.package,
        tuple(given.interface),
        tuple(given.dependency),
        given.output,
        Options(given.numbering, given.lock_file, given.events, given.python_root),
    )
    try:
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
    check_definitions(Request((build.package,)), build.sources(), build.options)


def generate_package(build: Build) -> None:
    """Generate a package, and those of its dependencies that are not installed.

    Raises:
        Error: Something is wrong with a definition, or files cannot be written.
    """
    sources = build.sources()
    own = Request((build.package,), dependencies=False)
    result = generate(own, sources, build.output / PACKAGE_FOLDER, build.options)
    for warning in result.warnings:
        print(f"Warning: {warning}", file=sys.stderr)
    needed = [name for name in result.interfaces if name.package != build.package]
    folder = build.output / DEPENDENCIES_FOLDER
    missing = _missing(needed, sources, build.options, folder)
    if missing or read_manifest(folder) is not None:
        generate(Request(missing, dependencies=False), sources, folder, build.options)
    files = [sources.definition(name).file for name in result.interfaces]
    _write_depfile(build.output, [file for file in files if Path(file).is_file()])


def _missing(needed: Iterable[TypeName], sources: Sources, options: Options, folder: Path) -> tuple[str, ...]:
    """Return the packages to generate: those that are not installed from the same definitions in the same way.

    What this build has generated once it goes on generating: the installed package that it finds is its own.
    """
    manifest = read_manifest(folder)
    outputs = manifest.outputs if manifest else ()
    made_here = {PurePosixPath(path).name for path in outputs if path.startswith(f"index/{RESOURCE_TYPE}/")}
    installed = installed_packages(prefixes())
    return tuple(
        package
        for package, generated in generated_packages(needed, sources, options).items()
        if package in made_here or package not in installed or installed[package].generated != generated
    )


def _write_depfile(output: Path, files: Iterable[str | Path]) -> None:
    stamp = output / STAMP_FILE
    target, *needs = [str(file).replace(" ", r"\ ") for file in (stamp, *files, *tool_files())]
    (output / DEPFILE).write_text(f"{target}: " + " \\\n  ".join(needs) + "\n", encoding="utf-8")
    stamp.touch()


COMMANDS = {"parse": parse, "check": check, "generate": generate_package}


def _parser() -> argparse.ArgumentParser:
    default = Options()
    parser = argparse.ArgumentParser(
        prog="python -m rosidl_adapter_proto.hooks.ament", fromfile_prefix_chars="@"
    )
    parser.add_argument("command", choices=COMMANDS)
    parser.add_argument("--package", required=True)
    parser.add_argument("--interface", action="append", required=True)
    parser.add_argument("--dependency", action="append", type=Path, default=[])
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--numbering", choices=NUMBERINGS, default=default.numbering)
    parser.add_argument("--lock-file", type=Path, default=default.lock_file)
    parser.add_argument("--events", action="store_true")
    parser.add_argument("--python-root", default=default.python_root)
    return parser


if __name__ == "__main__":
    sys.exit(main())
