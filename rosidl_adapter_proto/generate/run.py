"""A run, from a request to an output folder: `generate` is what every command and hook calls."""

from __future__ import annotations

import keyword
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rosidl_adapter_proto.errors import GenerateError, SchemaError
from rosidl_adapter_proto.generate.fingerprint import fingerprint
from rosidl_adapter_proto.generate.lock import check_numbers, read_lock, sequential_numbers, write_lock
from rosidl_adapter_proto.generate.manifest import is_intact, read_manifest
from rosidl_adapter_proto.generate.output_tree import (
    Changes,
    changes,
    check_ours,
    discard_left_over,
    make_manifest,
    write,
)
from rosidl_adapter_proto.generate.request import Request
from rosidl_adapter_proto.generate.settings import Options
from rosidl_adapter_proto.generate.targets import Generation, Progress
from rosidl_adapter_proto.generate.targets.proto import proto_text as render_proto
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.closure import closure
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.schema.numbering import (
    HashNumbering,
    Numbering,
    SequentialNumbering,
)
from rosidl_adapter_proto.schema.proto import ProtoFile, check_names, check_nesting, proto_file


@dataclass(frozen=True)
class Result:
    """What a run did, or would do.

    Attributes:
        interfaces: What was generated.
        changes: What changed in the output folder.
        lock_changed: Whether the lock file changed.
        warnings: What the user should know; that a lock file was made, among others.
    """

    interfaces: tuple[TypeName, ...]
    changes: Changes
    lock_changed: bool = False
    warnings: tuple[str, ...] = ()

    @property
    def is_stale(self) -> bool:
        """Whether the folder or the lock file were not what the definitions make of them."""
        return self.changes.any or self.lock_changed


def generate(
    request: Request,
    catalog: Catalog,
    output: Path,
    options: Options = Options(),
    *,
    check: bool = False,
    renumber: bool = False,
    progress: Progress | None = None,
) -> Result:
    """Generate everything for a request into a folder.

    Args:
        request: What to generate.
        catalog: Where definitions come from.
        output: The folder to write; it then holds what this call makes, and nothing that an earlier one made.
        options: How to generate.
        check: Only find out what would change.
        renumber: Let fields get other numbers than the folder was generated with: what was serialized with it cannot
            be read any more.
        progress: Is called while interfaces are done.

    Raises:
        DefinitionError: A definition is missing or not valid.
        SchemaError: An interface cannot be mapped to protobuf, or the lock file disagrees.
        GenerateError: The folder is not ours, has other numbers or cannot be written, or protoc failed.
    """
    check_ours(output)
    lock_text = read_lock(options)
    old = read_manifest(output)
    if (
        old is not None
        and is_intact(output, old)
        and old.fingerprint == fingerprint(request, catalog, options, lock_text, old.interfaces)
    ):
        if not check:
            discard_left_over(output)
        unchanged = Changes((), (), len(old.outputs))
        return Result(old.interfaces, unchanged, False, _warnings(catalog, old.interfaces))

    names = closure(catalog, request.packages, request.types, events=options.events)
    numbering = _numbering(options, lock_text)
    files = _generate_files(names, request, catalog, options, numbering, progress)
    new_lock_text = numbering.lock_text() if isinstance(numbering, SequentialNumbering) else lock_text
    numbers = sequential_numbers(numbering, options, output, None if renumber else old)
    if old is not None and not renumber:
        check_numbers(output, old, numbers, options, lock_exists=lock_text is not None)
    new_fingerprint = fingerprint(request, catalog, options, new_lock_text, names)
    manifest = make_manifest(new_fingerprint, names, files, numbers)
    changed = changes(output, files)
    # An unchanged run does not repeat those of definitions, since it parses nothing.
    warnings = (*_definition_warnings(catalog, names), *_warnings(catalog, names))
    if not check:
        # The lock file comes first: numbers that nothing uses yet do no harm, but used ones that are not kept do.
        if new_lock_text is not None and new_lock_text != lock_text:
            write_lock(options, lock_text, new_lock_text)
            if lock_text is None:
                warnings += (f"{options.lock_file} is new: it keeps the numbers of fields, so commit it",)
        changed = write(output, manifest, files)
    return Result(tuple(names), changed, new_lock_text != lock_text, warnings)


def check_definitions(request: Request, catalog: Catalog, options: Options = Options()) -> list[TypeName]:
    """Check all that can be wrong with definitions, and return what the request asks for, dependencies included.

    It is quick, since it stops where protoc and files begin: a build may call it before all else.

    Raises:
        DefinitionError: A definition is missing or not valid.
        SchemaError: An interface cannot be mapped to protobuf, or the lock file disagrees.
        GenerateError: The lock file cannot be read, or the name of the Python package is none.
    """
    names = closure(catalog, request.packages, request.types, events=options.events)
    _proto_files(names, request, catalog, options, _numbering(options, read_lock(options)))
    return names


def proto_text(name: TypeName, catalog: Catalog, options: Options = Options()) -> str:
    """Return the `.proto` file of an interface.

    Raises:
        DefinitionError: A definition is missing or not valid.
        SchemaError: The interface cannot be mapped to protobuf.
    """
    numbering = _numbering(options, read_lock(options))
    interface = catalog.definition(name).interface
    file = proto_file(interface, numbering, catalog.definition_name, events=options.events)
    return render_proto(file)


def _generate_files(
    names: list[TypeName],
    request: Request,
    catalog: Catalog,
    options: Options,
    numbering: Numbering,
    progress: Progress | None,
) -> dict[str, bytes]:
    """Return the content of every file of the output folder, by its path."""
    # They are slow to import, and a run with nothing to do does not need them.
    from rosidl_adapter_proto.generate import protoc
    from rosidl_adapter_proto.generate.outputs import all_files

    protos = _proto_files(names, request, catalog, options, numbering)
    texts = {file.path: render_proto(file) for file in protos}
    wanted = tuple(file for file in protos if _is_wanted(file.source.name, request))
    descriptors = protoc.compile_protos(texts, [file.path for file in wanted])
    return all_files(Generation(request, options, catalog, wanted, texts, descriptors), progress)


def _proto_files(
    names: Sequence[TypeName], request: Request, catalog: Catalog, options: Options, numbering: Numbering
) -> list[ProtoFile]:
    _check_python_root(options.python_root)
    # What is only referred to is numbered elsewhere. Its numbers make no difference here, and belong into no lock file.
    others = SequentialNumbering.from_lock("", None)
    protos = [
        proto_file(
            catalog.definition(name).interface,
            numbering if _is_wanted(name, request) else others,
            catalog.definition_name,
            events=options.events,
        )
        for name in names
    ]
    check_names(protos)
    check_nesting(protos)
    for name in names:
        _check_length(name)
    return protos


def _check_length(name: TypeName) -> None:
    excess = len(f"{name.name}{_LONGEST_ENDING}") - _LONGEST_FILE_NAME
    if excess > 0:
        raise SchemaError(
            f"{name}: the name is {excess} characters too long for generated files, whose names have at most "
            f"{_LONGEST_FILE_NAME}, {_LONGEST_ENDING!r} included; shorten it"
        )


_LONGEST_FILE_NAME = 255
"""What file systems take."""
_LONGEST_ENDING = "_adapter.py"
"""The longest that the name of an interface gets in the name of a file."""


def _check_python_root(name: str) -> None:
    taken = {*sys.stdlib_module_names, "rosidl_adapter_proto"}
    if keyword.iskeyword(name) or not name.isidentifier():
        raise GenerateError(f"{name!r} cannot be the name of a Python package")
    if name in taken:
        raise GenerateError(
            f"{name!r} is the name of another Python package; choose one for --python-root alone"
        )


def _is_wanted(name: TypeName, request: Request) -> bool:
    return request.dependencies or name.package in request.packages or name in request.types


def _definition_warnings(catalog: Catalog, names: Iterable[TypeName]) -> Iterator[str]:
    return (each for name in names for each in catalog.definition(name).interface.warnings)


def _warnings(catalog: Catalog, names: Iterable[TypeName]) -> tuple[str, ...]:
    return tuple(
        f"{winner.name} is defined differently by {winner.file} and {loser.file}; "
        f"the first is used, since {winner.origin} comes before {loser.origin}"
        for winner, loser in catalog.shadowed(names)
    )


def _numbering(options: Options, lock_text: str | None) -> Numbering:
    if options.numbering == SequentialNumbering.name:
        return SequentialNumbering.from_lock(str(options.lock_file), lock_text)
    return HashNumbering()
