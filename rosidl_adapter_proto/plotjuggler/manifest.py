"""The manifest of a plugin: what `pj_plugin_manifest` says, as YAML."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a plugin says of itself.

    Attributes:
        name: What it is called.
        encoding: The encoding of the messages that it parses, such as `ros2msg`.
    """

    name: str
    encoding: str


def read_manifest(text: str) -> Manifest:
    """Read a manifest."""
    values = dict(line.split(":", 1) for line in text.splitlines() if ":" in line)
    return Manifest(values["name"].strip(), values["encoding"].strip())
