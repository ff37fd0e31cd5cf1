"""The package `things`: what there is to convert, and names that could collide."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
from tests.folders import write_package

# protoc before 26 has an option for fields with the same JSON name, but does not heed it in proto3.
PROTOC_TAKES_JSON_CONFLICTS = tuple(map(int, version("grpcio-tools").split(".")[:2])) >= (1, 66)

DEFINITIONS = {
    "msg/Everything.msg": """\
# What there is.
# More of it.
bool flag
byte raw 7
char letter
int8 small
uint16 medium -0
float32 single 1.5
float64 double_value
int64 large
string name "you"
string<=3 short
wstring wide "ä"
wstring<=2 short_wide
byte[] raws [1, 2]
uint8[<=4] blob
int16[] shorts [5]
int16[3] three_shorts [1, 2, 3]
float32[] singles
float64[2] two_doubles
uint32[<=2] few
bool[2] flags
string[] names ["a", "b"]
wstring[] wides
Part part
Part[] parts
Part[2] two_parts
Part[<=1] few_parts
uint8 DEBUG=10
# What it is called.
string NAME="x"
float32 LIMIT=inf
""",
    "msg/Part.msg": "int32 x 3\nstd_msgs/Header header\n",
    "msg/PartAdapter.msg": "int32 y\n",
    "msg/Type.msg": "int32 from\nint32 y\n",
    "msg/Service.msg": "Header header\n",
    "msg/Header.msg": "std_msgs/Header header\nHeader2 other\n",
    "msg/Header2.msg": f"int32 x_1\n{'int32 x1' if PROTOC_TAKES_JSON_CONFLICTS else ''}\nint32 self\nint32 int\n",
    "msg/Nothing.msg": "",
    "msg/Taken.idl": """
        module things { module msg {
            module Taken_Constants { const long fields = 3; const long new = 4; const long custom_type = 5; };
            struct Taken { long cls; };
        }; };
    """,
    "srv/Set.srv": "int8 a 1\nint8 A=3\n---\nbool ok\n",
    "srv/Header.srv": "int8 a\n---\n",
    "srv/HeaderAdapter.srv": "Header header\n---\n",
    "action/Go.action": "int32 order\n---\nint32[] sequence\n---\nfloat32 part\n",
}


def generate_things(root: Path) -> Path:
    """Generate the package below `root`, and return the output folder."""
    write_package(root / "things", DEFINITIONS)
    catalog = Catalog((folder_source(root / "things"), store_source()))
    generate(Request(("things",)), catalog, root / "out", Options(python_root="things_root"))
    return root / "out"
