"""The manifest of an output folder: what it was made from, and every file that was made."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from rosidl_adapter_proto.errors import GenerateError

MANIFEST_NAME = ".rosidl-proto.json"
_VERSION = 1


@dataclass(frozen=True)
class Manifest:
    """What is known of an output folder.

    Attributes:
        fingerprint: A digest of everything that the files depend on.
        interfaces: The names of the interfaces they were made from, dependencies included.
        outputs: The digest of each file, by its path relative to the folder.
    """

    fingerprint: str
    interfaces: tuple[str, ...]
    outputs: Mapping[str, str]

    def to_json(self) -> bytes:
        """Return the content of the manifest file."""
        content = {
            "version": _VERSION,
            "fingerprint": self.fingerprint,
            "interfaces": list(self.interfaces),
            "outputs": dict(self.outputs),
        }
        return (json.dumps(content, indent=1) + "\n").encode()


def read_manifest(output: Path) -> Manifest | None:
    """Return the manifest of a folder, or None if it has none.

    Raises:
        GenerateError: The manifest is damaged, or names files outside the folder.
    """
    file = output / MANIFEST_NAME
    try:
        content = json.loads(file.read_bytes())
        if content["version"] != _VERSION:
            raise ValueError(f"version {content['version']}")
        manifest = Manifest(
            str(content["fingerprint"]), tuple(content["interfaces"]), dict(content["outputs"])
        )
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise GenerateError(f"cannot read {file}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError) as error:
        raise GenerateError(
            f"{file} is not a manifest that this version of rosidl-proto reads ({error}); "
            f"remove {output} and generate it again"
        ) from None
    for path in manifest.outputs:
        parts = PurePosixPath(path)
        if parts.is_absolute() or ".." in parts.parts:
            raise GenerateError(f"{file} names {path!r}, which is not inside {output}; remove the folder")
    return manifest


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
