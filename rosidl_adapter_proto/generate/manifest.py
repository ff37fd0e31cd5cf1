"""The manifest of an output folder: what it was made from, and every file that was made."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.interfaces.model import TypeName

MANIFEST_NAME = ".rosidl-proto.json"
_VERSION = 2


@dataclass(frozen=True)
class SequentialNumbers:
    """The sequential numbers that an output folder knows.

    Attributes:
        lock_file: The path of the lock file that they are from, relative to the folder.
        fields: The numbers of each message, by its ROS name and the field's, those of removed fields included.
    """

    lock_file: str
    fields: Mapping[str, Mapping[str, int]]


@dataclass(frozen=True)
class Manifest:
    """What is known of an output folder.

    Attributes:
        fingerprint: A digest of everything that the files depend on.
        interfaces: The interfaces they were made from, dependencies included.
        outputs: The digest of each file, by its path relative to the folder.
        numbers: The numbers of fields; None if they are hashes.
    """

    fingerprint: str
    interfaces: tuple[TypeName, ...]
    outputs: Mapping[str, str]
    numbers: SequentialNumbers | None = None

    def to_json(self) -> bytes:
        """Return the content of the manifest file."""
        content = {
            "version": _VERSION,
            "fingerprint": self.fingerprint,
            "interfaces": list(map(str, self.interfaces)),
            "outputs": dict(self.outputs),
            "numbers": asdict(self.numbers) if self.numbers else None,
        }
        return (json.dumps(content, indent=1) + "\n").encode()


def read_manifest(output: Path) -> Manifest | None:
    """Return the manifest of a folder, or None if it has none.

    Raises:
        GenerateError: The manifest is damaged, of another version, or names files outside the folder.
    """
    file = output / MANIFEST_NAME
    try:
        return _parse(json.loads(file.read_bytes()))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise GenerateError(f"cannot read {file}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise GenerateError(
            f"{file} is not a manifest that this version of rosidl-proto reads ({error}); "
            f"remove {output} and generate it again"
        ) from None


def _parse(content: Any) -> Manifest:
    if content["version"] != _VERSION:
        raise ValueError(f"it has version {content['version']}, not {_VERSION}")
    outputs = dict(content["outputs"])
    for path in outputs:
        if not {"", ".", ".."}.isdisjoint(path.split("/")):
            raise ValueError(f"it names {path!r}, which is not inside the folder")
    numbers = None if content["numbers"] is None else _parse_numbers(content["numbers"])
    interfaces = tuple(map(TypeName.parse, content["interfaces"]))
    return Manifest(content["fingerprint"], interfaces, outputs, numbers)


def _parse_numbers(content: Any) -> SequentialNumbers:
    return SequentialNumbers(
        content["lock_file"],
        {
            message: {name: int(number) for name, number in fields.items()}
            for message, fields in content["fields"].items()
        },
    )


def is_intact(output: Path, manifest: Manifest) -> bool:
    """Tell whether every file that was made is still as it was."""
    for path, expected in manifest.outputs.items():
        try:
            if digest((output / path).read_bytes()) != expected:
                return False
        except OSError:
            return False
    return True


def digest(content: bytes) -> str:
    """Return the digest by which contents are compared."""
    return hashlib.sha256(content).hexdigest()
