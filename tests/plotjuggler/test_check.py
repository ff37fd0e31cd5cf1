"""`rosidl-proto plotjuggler check`: which contracts a plugin meets."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from rosidl_adapter_proto.cli import program
from rosidl_adapter_proto.plotjuggler.check import Report, check_plugin
from tests.plotjuggler import wat

CAREFUL = "(if (result i32) (local.get $self) (then (i32.store (local.get $out) (i32.const 0)) (i32.const 4))"
CAREFUL += " (else (i32.const 0)))"
MODULE_CAREFUL = "(if (result i32) (i64.eqz (local.get $self)) (then (i32.const -2)) (else (i32.const -3)))"
CREATE_ONE = "(i64.extend_i32_u (i32.eqz (local.get $claim)))"
BOTH = wat.MALLOC + """
  (func (export "pj_parser_parse") (param i32 i32 i32 i32) (result i32) (i32.const 0))"""


def reports(plugin: bytes) -> dict[str, Report]:
    return {report.dialect.name: report for report in check_plugin(plugin)}


def unmet(plugin: bytes) -> dict[str, str]:
    """Return what a plugin does not meet in the one dialect that it serves."""
    (report,) = [each for each in check_plugin(plugin) if each.served]
    return {point.name: point.remark for point in report.points if not point.met}


def test_what_meets_a_contract() -> None:
    found = reports(wat.plugin(CAREFUL, malloc=BOTH))
    assert [name for name, report in found.items() if report.met] == ["released", "page"]
    assert not found["module"].served
    assert unmet(wat.plugin(CAREFUL, malloc="", function="pj_parser_parse")) == {}
    assert unmet(wat.module(MODULE_CAREFUL, create=CREATE_ONE)) == {}


ZERO = "refuses messages for no parser (self 0)"
GARBAGE = "takes or refuses messages of no sense"
QUOTED = 'plugin_type: "MessageParser"\nname: a\nencoding: b'
UNMET = {
    wat.plugin(): {
        ZERO: "byte 0: the number of pairs has 4 bytes, but 1 are left",
        GARBAGE: "byte 0: the number of pairs has 4 bytes, but 1 are left",
    },
    wat.plugin(CAREFUL, malloc=""): {"exports malloc (i32) -> i32": "it does not"},
    wat.plugin(CAREFUL, more='(import "env" "f" (func))'): {"imports nothing but WASI": "env.f"},
    wat.plugin(CAREFUL.replace("(i32.const 0)))", "(unreachable)))")): {
        ZERO: "it was stopped: wasm `unreachable` instruction executed"
    },
    wat.plugin("(i32.store (local.get $out) (i32.const 0)) (i32.const 4)"): {
        ZERO: "pj_parser_decode with self 0 returned 4"
    },
    wat.plugin(CAREFUL, manifest=QUOTED): {
        "has a manifest": "manifest: the released PlotJuggler sees the plugin_type '\"MessageParser\"' instead of"
        " 'MessageParser': it keeps quotes and comments"
    },
    wat.plugin(CAREFUL, create="(unreachable)"): {
        "takes an empty schema, or refuses it": "it was stopped: wasm `unreachable` instruction executed",
        GARBAGE: "it was stopped: wasm `unreachable` instruction executed",
    },
    wat.plugin("(if (i32.eqz (local.get $self)) (then (return (i32.const 0)))) (i32.const 2000000)"): {
        GARBAGE: "message 0: it says that it wrote 2000000 bytes, but an output has at most 1048576"
    },
    wat.module(MODULE_CAREFUL): {
        "makes none for a claim that it has not": "pj_module_create(1) did not return 0",
    },
    wat.module("(i32.const -1)", create="(i64.const 0)"): {
        "makes a parser for each claim": "pj_module_create(0) returned 0"
    },
    wat.module("(i32.const 0)", create=CREATE_ONE): {
        "refuses messages for no parser (token 0)": "pj_module_parse returned 0",
        GARBAGE: "message 0: it says that its output is 0 bytes at 0, but its memory has 262144",
    },
    wat.module(MODULE_CAREFUL, create=CREATE_ONE, memory="2"): {
        "declares a maximum of its memory, of at most 256 MiB": "it has none"
    },
    wat.module(MODULE_CAREFUL, create=CREATE_ONE, memory="2 8192"): {
        "declares a maximum of its memory, of at most 256 MiB": "512 MiB"
    },
    wat.module(MODULE_CAREFUL, create=CREATE_ONE, more='(import "wasi_unstable" "f" (func))'): {
        "imports nothing": "wasi_unstable.f"
    },
    wat.module(MODULE_CAREFUL, create=CREATE_ONE, more='(func $s (export "_start")) (start $s)'): {
        "exports neither _start nor other names with pj_module_": "_start",
        "has no start section": "",
    },
    wat.module(MODULE_CAREFUL, abi="(i32.const 3)"): {
        "starts, and has version 1 of the ABI": "plugin: pj_module_abi returned 3; 1 is the only one there is"
    },
    wat.module(MODULE_CAREFUL, manifests=(json.dumps([]).encode(),)): {
        "has a manifest": "pj_parser_module_manifest: the document: not an object"
    },
}


@pytest.mark.parametrize("plugin", UNMET, ids=range(len(UNMET)))
def test_what_is_not_met(plugin: bytes) -> None:
    assert unmet(plugin) == UNMET[plugin]


def test_wrong_types_of_functions() -> None:
    plugin = wat.wasm('(module (func (export "pj_parser_parse") (param i64) (result f32) (f32.const 0)))')
    assert unmet(plugin)["exports pj_parser_parse (i32, i32, i32, i32) -> i32"] == "it is (i64) -> f32"


def test_the_command(tmp_path: Path) -> None:
    file = tmp_path / "echo.wasm"
    file.write_bytes(wat.plugin(CAREFUL, function="pj_parser_parse"))
    result = CliRunner().invoke(program, ["plotjuggler", "check", str(file)])
    assert result.exit_code == 0
    assert result.output == (
        "released (PlotJuggler 3.13 to 3.17): not served; pj_parser_decode is missing\n"
        "\n"
        "page (PlotJuggler's page on WASM plugins): met\n"
        "  yes  imports nothing but WASI\n"
        "  yes  exports pj_plugin_manifest () -> i32\n"
        "  yes  exports pj_parser_create (i32, i32, i32) -> i32\n"
        "  yes  exports pj_parser_set_array_policy (i32, i32, i32) -> nothing\n"
        "  yes  exports pj_parser_parse (i32, i32, i32, i32) -> i32\n"
        "  yes  exports pj_parser_destroy (i32) -> nothing\n"
        "  yes  exports malloc (i32) -> i32\n"
        "  yes  exports its memory\n"
        "  yes  starts, and has memory for outputs\n"
        "  yes  has a manifest: encoding echo\n"
        "  yes  takes an empty schema, or refuses it: takes it\n"
        "  yes  refuses messages for no parser (self 0)\n"
        "  yes  takes a policy for arrays for no parser\n"
        "  yes  takes or refuses messages of no sense: refused 0 of 5\n"
        "\n"
        "module (parser modules of PlotJuggler 4, which are experimental): not served; pj_module_parse is missing\n"
        "\n"
        "echo.wasm meets page\n"
    )
    file.write_bytes(wat.plugin())
    result = CliRunner().invoke(program, ["plotjuggler", "check", str(file)])
    assert result.exit_code == 1
    assert "  NO   refuses messages for no parser (self 0): byte 0: the number of pairs" in result.output
    assert result.output.endswith("echo.wasm meets none of them\n")


def test_the_command_without_an_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "wasmtime", None)
    result = CliRunner().invoke(program, ["plotjuggler", "check", "echo.wasm"], standalone_mode=False)
    assert str(result.exception).startswith("running plugins needs wasmtime (")
    assert str(result.exception).endswith("): pip install 'rosidl-adapter-proto[plotjuggler]'")
