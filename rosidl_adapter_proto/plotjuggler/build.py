"""Builds the parser plugins with the pinned compiler: the only place that runs it.

One program makes both files: it has the functions of PlotJuggler 3, as its document has them and as its releases call
them, and of PlotJuggler 4, and imports nothing.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import rosidl_adapter_proto
from rosidl_adapter_proto.errors import PluginError

# Versions of the compiler build other bytes: the extra `plotjuggler` has the same one.
ZIGLANG = "0.15.2"
INSTALL = f"pip install ziglang=={ZIGLANG}"


@dataclass(frozen=True, slots=True)
class Recipe:
    """What differs between the plugins."""

    encoding: str  # of messages, as PlotJuggler names it
    description: str


RECIPES = (
    Recipe("protobuf", "Series of protobuf messages, by the FileDescriptorSet of their type"),
    Recipe("ros2msg", "Series of ROS 2 messages in CDR, by the text that defines their type"),
)

# Relative to the folder of the core, where the compiler runs: so no path of this machine comes into a plugin.
_SOURCES = (
    *(
        "wasm/system.cpp",
        "wasm/memory.cpp",
        "wasm/plotjuggler3.cpp",
        "wasm/plotjuggler4.cpp",
        "wasm/plugin.cpp",
    ),
    *("src/error.cpp", "src/flat.cpp", "src/plan.cpp", "src/proto_to_cdr.cpp", "src/text.cpp"),
)
# Only what every host has: WebAssembly 1.0, and copying of memory. 256 MiB is what PlotJuggler 4 allows.
_MEMORY_MAXIMUM = 256 << 20
_STACK_SIZE = 512 << 10
_FLAGS = (
    *("-target", "wasm32-wasi", "-mcpu=mvp+bulk_memory"),
    *("-std=c++17", "-Os", "-fignore-exceptions", "-fno-rtti", "-ffunction-sections", "-fdata-sections"),
    *("-Wall", "-Wextra", "-Werror", "-Iinclude", "-Isrc"),
    *("-mexec-model=reactor", "-Wl,--gc-sections", "-Wl,--strip-all"),
    *(f"-Wl,--max-memory={_MEMORY_MAXIMUM}", f"-Wl,-z,stack-size={_STACK_SIZE}"),
)
_MANIFEST_SECTION = b"pj_parser_module_manifest"


def build_plugins(output: Path) -> list[Path]:
    """Build `protobuf.wasm` and `ros2msg.wasm`. What the same sources give is the same, byte for byte.

    The first time takes longer: the compiler builds its C++ library, and keeps it in the user's cache folder
    (`ZIG_GLOBAL_CACHE_DIR` names another).

    Args:
        output: The folder that they go to. It is made, and plugins in it are replaced.

    Returns:
        Their paths.

    Raises:
        PluginError: The compiler is not installed, has another version or fails; or the folder cannot be written.
    """
    _check_compiler()
    plugins = []
    try:
        output.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".building-", dir=output) as folder:
            for recipe in RECIPES:
                built = _compile(recipe, Path(folder).resolve())
                built.write_bytes(built.read_bytes() + _custom_section(_module_manifest(recipe)))
                built.chmod(0o644)
                plugins.append(built.replace(output / built.name))
    except OSError as error:
        raise PluginError(
            f"cannot write plugins to {output}: {error.strerror}; choose another folder"
        ) from error
    return plugins


def core_folder() -> Path:
    """Return the sources of the core: those in the wheel, or those of the source tree."""
    package = Path(rosidl_adapter_proto.__file__).parent
    shipped = package / "core"
    return shipped if shipped.is_dir() else package.parent / "core"


def source_digest() -> str:
    """Return a short name for all that plugins are made of, the same wherever the same sources are."""
    core = core_folder()
    files = [file for part in ("include", "src", "wasm") for file in (core / part).rglob("*.?pp")]
    digest = hashlib.sha256(rosidl_adapter_proto.__version__.encode())
    for file in [Path(__file__), *sorted(files)]:
        digest.update(f"\n{file.name}\n".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def manifest_text(recipe: Recipe) -> str:
    """Return the manifest for PlotJuggler 3: YAML that is also what its releases split at colons, one in each line."""
    lines = {
        "plugin_type": "MessageParser",
        "name": f"rosidl_adapter_proto {recipe.encoding}",
        "version": rosidl_adapter_proto.__version__,
        "description": recipe.description,
        "author": "the authors of rosidl_adapter_proto",
        "license": "Apache-2.0",
        "encoding": recipe.encoding,
    }
    return "".join(f"{key}: {value}\n" for key, value in lines.items())


def _module_manifest(recipe: Recipe) -> bytes:
    """Return the manifest for PlotJuggler 4."""
    claim = {
        "claim_id": "all",
        "encoding": recipe.encoding,
        "type_name": "*",
        "routes": ["scalar"],
        "priority": 0,
    }
    manifest = {
        "module_abi": 1,
        "id": f"rosidl_adapter_proto.{recipe.encoding}",
        "name": f"rosidl_adapter_proto {recipe.encoding}",
        "version": rosidl_adapter_proto.__version__,
        "claims": [claim],
    }
    return json.dumps(manifest).encode()


def _check_compiler() -> None:
    try:
        version = importlib.metadata.version("ziglang")
    except importlib.metadata.PackageNotFoundError:
        raise PluginError(f"building plugins needs the package ziglang {ZIGLANG}: {INSTALL}") from None
    if version != ZIGLANG:
        raise PluginError(f"building plugins needs ziglang {ZIGLANG}, and {version} is installed: {INSTALL}")


def _compile(recipe: Recipe, folder: Path) -> Path:
    """Compile a plugin into a folder, in which a later one finds what both have in common."""
    manifest, plugin = folder / "manifest.cpp", folder / f"{recipe.encoding}.wasm"
    text = json.dumps(manifest_text(recipe))  # C++ writes such text alike
    manifest.write_text(
        "namespace rosidl_proto::plugin {\n"
        f"extern const char kManifest[];\nconst char kManifest[] = {text};\n"
        "}  // namespace rosidl_proto::plugin\n",
        encoding="utf-8",
    )
    core = core_folder()
    schema = [file.relative_to(core).as_posix() for file in sorted(core.glob("src/schema/*.cpp"))]
    process = subprocess.run(
        [
            *(sys.executable, "-m", "ziglang", "c++", *_FLAGS),
            *(*_SOURCES, *schema, f"wasm/{recipe.encoding}.cpp", str(manifest), "-o", str(plugin)),
        ],
        cwd=core,
        env={**os.environ, "ZIG_LOCAL_CACHE_DIR": str(folder / "cache")},
        capture_output=True,
        check=False,
    )
    if process.returncode != 0:
        said = process.stderr.decode(errors="replace").strip()
        raise PluginError(
            f"the compiler failed to build {plugin.name}, with exit code {process.returncode}:\n{said}"
        )
    return plugin


def _custom_section(content: bytes) -> bytes:
    """Return a custom section for the end of a module (https://webassembly.github.io/spec/core/binary/modules.html)."""
    body = _unsigned(len(_MANIFEST_SECTION)) + _MANIFEST_SECTION + content
    return b"\0" + _unsigned(len(body)) + body


def _unsigned(value: int) -> bytes:
    """Return LEB128."""
    digits = bytearray()
    while value >= 0x80:
        digits.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*digits, value])
