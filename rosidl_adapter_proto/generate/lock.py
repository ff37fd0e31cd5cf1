"""Keeps sequential numbers: reads and writes the lock file, and holds it against what an output folder knows.

The lock file is the record of every number that was given. It can be lost, or another one can be taken, as when the
program runs in another folder. So an output folder remembers the numbers that it was generated with, and takes no
others without being told to.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from rosidl_adapter_proto.errors import GenerateError, RequestError
from rosidl_adapter_proto.generate.manifest import MANIFEST_NAME, Manifest, SequentialNumbers
from rosidl_adapter_proto.generate.output_tree import alone_in, replace_file
from rosidl_adapter_proto.generate.settings import Options
from rosidl_adapter_proto.schema.numbering import HashNumbering, Numbering, SequentialNumbering

_ON_PURPOSE = (
    "if nothing is left that was serialized with the old numbers, give --renumber, or remove {output} and generate "
    "it again"
)


def read_lock(options: Options) -> str | None:
    """Return the text of the lock file; None where there is none yet, or none is needed.

    Raises:
        GenerateError: It cannot be read.
    """
    if options.numbering != SequentialNumbering.name:
        return None
    try:
        return options.lock_file.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise GenerateError(
            f"cannot read {options.lock_file}: {reason}; name the lock file with --lock-file"
        ) from None


def write_lock(options: Options, old_text: str | None, new_text: str) -> None:
    """Write the lock file.

    Raises:
        GenerateError: It cannot be written, or is no longer what was read.
    """
    try:
        with alone_in(options.lock_file.parent):
            if read_lock(options) != old_text:
                raise GenerateError(f"another run has changed {options.lock_file}; run this one again")
            replace_file(options.lock_file, new_text.encode())
    except OSError as error:
        raise GenerateError(f"cannot write {options.lock_file}: {error.strerror}") from error


def drop(options: Options, names: Iterable[str]) -> dict[str, int]:
    """Take entries that were never released out of the lock file.

    Args:
        options: Say where it is.
        names: Fields, as `std_msgs/msg/String.data`, and whole messages.

    Returns:
        The numbers that are free now, by the full names of their fields.

    Raises:
        RequestError: There is no lock file.
        SchemaError: It is damaged, or has no such entry.
        GenerateError: It cannot be read or written.
    """
    text = read_lock(options)
    if text is None:
        raise RequestError(f"there is no {options.lock_file}; name the lock file with --lock-file")
    numbering = SequentialNumbering.from_lock(str(options.lock_file), text)
    dropped = {
        f"{name.partition('.')[0]}.{field}": number
        for name in names
        for field, number in numbering.drop(name).items()
    }
    write_lock(options, text, numbering.lock_text())
    return dropped


def is_kept(options: Options) -> bool:
    """Tell whether a lock file keeps the numbers.

    A build then takes what it says, be it that of another branch: the build's folder is nobody's record.
    """
    return options.numbering == SequentialNumbering.name and os.path.exists(options.lock_file)


def sequential_numbers(
    numbering: Numbering, options: Options, output: Path, old: Manifest | None
) -> SequentialNumbers | None:
    """Return what an output folder has to remember of the numbers of a run; None if they are hashes.

    Args:
        numbering: Has numbered what the run makes.
        options: Say where the lock file is.
        output: The folder.
        old: What it remembers; numbers of messages that are no longer made stay known.
    """
    if not isinstance(numbering, SequentialNumbering):
        return None
    known = old.numbers.fields if old is not None and old.numbers is not None else {}
    place = Path(os.path.relpath(options.lock_file, output)).as_posix()
    return SequentialNumbers(place, {**known, **numbering.given})


def check_numbers(
    output: Path, old: Manifest, new: SequentialNumbers | None, options: Options, *, lock_exists: bool
) -> None:
    """Check that what is in an output folder keeps its numbers.

    Args:
        output: The folder.
        old: What it was made of.
        new: The numbers of this run; None if they are hashes.
        options: Say where the lock file is.
        lock_exists: Whether it was there before this run.

    Raises:
        GenerateError: A field would get another number.
    """
    on_purpose = _ON_PURPOSE.format(output=output)
    if (old.numbers is None) != (new is None):
        was, now = (HashNumbering.name, SequentialNumbering.name)[:: 1 if old.numbers is None else -1]
        raise GenerateError(
            f"{output} was generated with numbering {was!r} ({output / MANIFEST_NAME}), and is to have {now!r}, "
            f"which gives every field another number; choose another folder with --output, or, {on_purpose}"
        )
    if old.numbers is None or new is None:
        return
    changed = _first_changed(old.numbers.fields, new.fields)
    if changed is None:
        return
    name, was_number, number = changed
    lock = (
        f"{options.lock_file} has" if lock_exists else f"there is no {options.lock_file}, and a new one has"
    )
    used = Path(os.path.normpath(output / old.numbers.lock_file))
    if os.path.exists(used) and not (lock_exists and used.samefile(options.lock_file)):
        remedy = f"give the lock file that {output} was generated with: --lock-file {used}"
    else:
        remedy = f"restore {options.lock_file} from version control"
    raise GenerateError(
        f"{name} has number {was_number} in {output / MANIFEST_NAME}, but {lock} {number or 'none'} for it; "
        f"{remedy}; or, {on_purpose}"
    )


def _first_changed(
    old: Mapping[str, Mapping[str, int]], new: Mapping[str, Mapping[str, int]]
) -> tuple[str, int, int | None] | None:
    """Return the first field that has lost its number, with that and the one it has now."""
    for message, fields in old.items():
        for field, number in fields.items():
            now = new[message].get(field)
            if now != number:
                return f"{message}.{field}", number, now
    return None
