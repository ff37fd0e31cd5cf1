"""Reads .idl files: OMG IDL 4.2 text to the model, as far as ROS 2 interfaces use it.

The grammar is in `grammar.lark`. What ROS 2's own `rosidl_parser` accepts is accepted, with the same result.
`syntax.py` makes a tree of a text, `definitions.py` reads what is in it, and `interface.py` makes an interface of that.
"""

from __future__ import annotations

from dataclasses import replace

from rosidl_adapter_proto.interfaces.idl.definitions import read_definitions
from rosidl_adapter_proto.interfaces.idl.file import File
from rosidl_adapter_proto.interfaces.idl.interface import read_interface
from rosidl_adapter_proto.interfaces.idl.syntax import syntax_tree
from rosidl_adapter_proto.interfaces.model import Interface, Location, TypeName
from rosidl_adapter_proto.interfaces.problem import problem

MAX_CHARACTERS = 10_000_000
"""The longest file that is read."""


def parse_idl(text: str, name: TypeName, file: str) -> Interface:
    """Read one .idl file: a message, a service or an action.

    Args:
        text: The content of the file.
        name: What the place of the file says that it defines: `package/namespace/Stem`.
        file: What errors call the file.

    Raises:
        DefinitionError: The text is not OMG IDL 4.2, not supported by ROS 2, or defines something else.
    """
    content = File(text.removeprefix("\ufeff"), file)
    if len(text) > MAX_CHARACTERS:
        message = f"the file is longer than {MAX_CHARACTERS} characters"
        raise problem(message, content.text, Location(file, 1))
    read_definitions(content, (), syntax_tree(content).children)
    interface = read_interface(content, name, text)
    return replace(interface, warnings=tuple(dict.fromkeys(content.warnings)))
