"""Where the built plugins are."""

from __future__ import annotations

import os
from pathlib import Path

from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.plotjuggler.build import RECIPES, build_plugins, source_digest

# In a folder for each version of the sources, so that none serves for another. Git ignores it; wheels have it.
SHIPPED = Path(__file__).parent / "built"


def plugin_path(encoding: str) -> Path:
    """Return a built plugin: the one that the wheel brought, or one in the user's cache folder, built now if need be.

    Args:
        encoding: The encoding of the messages that it parses: `protobuf` or `ros2msg`.

    Raises:
        RequestError: There is no plugin for that encoding.
        PluginError: It has to be built, and cannot be.
    """
    encodings = [recipe.encoding for recipe in RECIPES]
    if encoding not in encodings:
        raise RequestError(f"there is no plugin for {encoding}, only for {' and '.join(encodings)}")
    digest = source_digest()
    cached = _cache_folder() / digest
    for folder in (SHIPPED / digest, cached):
        plugin = folder / f"{encoding}.wasm"
        if plugin.is_file():
            return plugin
    return next(plugin for plugin in build_plugins(cached) if plugin.stem == encoding)


def build_shipped_plugins() -> list[Path]:
    """Build the plugins that the next wheel brings, and return their paths. Errors are those of `build_plugins`."""
    return build_plugins(SHIPPED / source_digest())


def _cache_folder() -> Path:
    """Return where users have it (https://specifications.freedesktop.org/basedir-spec/latest/#variables)."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    caches = Path(named) if os.path.isabs(named) else Path.home() / ".cache"
    return caches / "rosidl_adapter_proto" / "plotjuggler"
