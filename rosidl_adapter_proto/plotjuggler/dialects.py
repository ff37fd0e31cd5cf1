"""The three contracts between a plugin and what runs it: which functions there are, and how outputs are written.

`released` is what PlotJuggler 3.13 to 3.17 calls, `page` is its page docs/wasm_plugins.md, and `module` is the ABI for
parser modules that version 4 has frozen (parser_module_abi.h, version 1), whose loader is in no release yet. One file
can serve all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.engine import Program, Signature
from rosidl_adapter_proto.plotjuggler.output import ReadLayout, read_module, read_page, read_released


@dataclass(frozen=True, slots=True)
class Function:
    """A function that a plugin exports.

    Attributes:
        name: Its name.
        signature: Its types.
        needed: Whether a plugin without it cannot be run here; others are asked for by the contract alone.
    """

    name: str
    signature: Signature
    needed: bool = True


@dataclass(frozen=True, slots=True)
class Dialect:
    """One of the contracts.

    Attributes:
        name: What we call it.
        title: What it is, for people.
        functions: Its functions.
        parse: The function that parses a message; only plugins of this dialect have it.
        allocator: The function that gives memory.
        read_layout: Reads an output.
    """

    name: str
    title: str
    functions: tuple[Function, ...]
    parse: str
    allocator: str
    read_layout: ReadLayout


def _function(name: str, parameters: str = "", results: str = "", needed: bool = True) -> Function:
    return Function(name, Signature(tuple(parameters.split()), tuple(results.split())), needed)


_COMMON = (
    _function("pj_plugin_manifest", "", "i32"),
    _function("pj_parser_create", "i32 i32 i32", "i32"),
    _function("pj_parser_set_array_policy", "i32 i32 i32", "", needed=False),
)

DIALECTS = {
    each.name: each
    for each in (
        Dialect(
            "released",
            "PlotJuggler 3.13 to 3.17",
            (
                *_COMMON,
                _function("pj_parser_decode", "i32 i32 i32 i32", "i32"),
                _function("pj_parser_destroy", "i32", "", needed=False),
                _function("malloc", "i32", "i32", needed=False),
            ),
            "pj_parser_decode",
            "malloc",
            read_released,
        ),
        Dialect(
            "page",
            "PlotJuggler's page on WASM plugins",
            (*_COMMON, _function("pj_parser_parse", "i32 i32 i32 i32", "i32")),
            "pj_parser_parse",
            "malloc",
            read_page,
        ),
        Dialect(
            "module",
            "parser modules of PlotJuggler 4, which are experimental",
            (
                _function("pj_module_abi", "", "i32"),
                _function("pj_module_create", "i32", "i64"),
                _function("pj_module_destroy", "i64"),
                _function("pj_module_bind", "i64 i64 i64", "i32"),
                _function("pj_module_parse", "i64 i64 i64 i64 i64", "i32"),
                _function("pj_module_last_error", "i64 i64 i64", "i64"),
                _function("pj_module_alloc", "i64", "i64"),
                _function("pj_module_free", "i64 i64"),
                _function("_initialize", needed=False),
            ),
            "pj_module_parse",
            "pj_module_alloc",
            read_module,
        ),
    )
}


def unmet(dialect: Dialect, program: Program, all_functions: bool = False) -> list[str]:
    """Return what a plugin has not, or has with other types, of the functions of a dialect and its memory."""
    found = []
    for function in dialect.functions:
        signature = program.functions.get(function.name)
        if signature is None and (function.needed or all_functions):
            found.append(f"it does not export {function.name}")
        elif signature is not None and signature != function.signature:
            found.append(f"{function.name} is {signature} instead of {function.signature}")
    if "memory" not in program.other_exports:
        found.append("it does not export its memory")
    return found


def served_dialects(program: Program) -> tuple[str, ...]:
    """Return the names of the dialects that a plugin can be run in.

    Raises:
        PluginError: There are none; the text says what it lacks for those that it has the parse function of.
    """
    lacks = {name: unmet(dialect, program) for name, dialect in DIALECTS.items()}
    served = tuple(name for name, reasons in lacks.items() if not reasons)
    if served:
        return served
    begun = [name for name, dialect in DIALECTS.items() if dialect.parse in program.functions]
    if begun:
        reasons = "; ".join(f"as {name}: {', '.join(lacks[name])}" for name in begun)
        raise PluginError(f"{program.name}: no parser plugin that can be run: {reasons}")
    functions = ", ".join(each.parse for each in DIALECTS.values())
    raise PluginError(f"{program.name}: no parser plugin of PlotJuggler: it exports none of {functions}")
