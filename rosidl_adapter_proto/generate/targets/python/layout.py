"""Lays generated Python out as black does, which takes black itself twenty times as long as all the rest.

This is no formatter: it knows the forms of statement that generated modules have, as the functions of `Layout`, and
how black lays out each that is too long for a line. What it does not know, it leaves in a line that is too long; and a
module with such a line, unless it is settled that black cannot split it either, is left to black as a whole
(`Layout.is_complete`). Black has no other reason to change a module: tests hold every form against it at every length.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

LINE_LENGTH = 88
"""That of black, without a configuration."""


def quoted(value: str | bytes) -> str:
    """Return the literal of a value with the quotes that black prefers: double ones, unless that takes more escapes."""
    text = repr(value)
    prefix, literal = ("b", text[1:]) if isinstance(value, bytes) else ("", text)
    body = literal[1:-1]
    if literal[0] == '"' or body.count('"') > body.count("\\'"):
        return text
    return f'{prefix}"{_ESCAPE_OR_QUOTE.sub(_requoted, body)}"'


_ESCAPE_OR_QUOTE = re.compile(r"\\.|\"")


def _requoted(match: re.Match[str]) -> str:
    return {"\\'": "'", '"': '\\"'}.get(match[0], match[0])


class Layout:
    """The layout of one module.

    Every function returns the lines of something at an indentation, without the last line break.
    """

    def __init__(self) -> None:
        """Begin a module."""
        self._settled: set[str] = set()

    def is_complete(self, text: str) -> bool:
        """Whether black has nothing to change in a module: each line fits, or is one that cannot be split."""
        return all(_fits(line) or line in self._settled for line in text.split("\n"))

    def statement(self, text: str, indent: str = "") -> str:
        """Lay out a call, the assignment of a name or a call, or the head of a class, without strings that matter."""
        return "\n".join(self._statement(text, indent))

    def import_from(self, module: str, name: str, indent: str = "") -> str:
        """Lay out the import of a name, which may be `name as other`."""
        line = f"{indent}from {module} import {name}"
        if _fits(line):
            return line
        return self.settled(f"{indent}from {module} import (\n{indent}    {name},\n{indent})")

    def assignment(self, target: str, value: str, indent: str = "") -> str:
        """Lay out the assignment of a literal that is no list; the target may have an annotation."""
        line, head, inner = f"{indent}{target} = {value}", f"{indent}{target} = (", f"{indent}    {value}"
        if _fits(line) or not (_is_string(value) and value.isascii() and _fits(head)):
            return line
        # Black splits a line for nothing only behind an annotation.
        if not _fits(inner) and ":" not in target:
            return self.settled(line)
        return "\n".join((head, self.settled(inner), f"{indent})"))

    def dictionary(
        self, target: str, items: Sequence[tuple[str, str | Sequence[str]]], indent: str = ""
    ) -> str:
        """Lay out the assignment of a dictionary; values are literals, or lists of literals."""
        texts = [f"{key}: {value if isinstance(value, str) else _list(value)}" for key, value in items]
        line = f"{indent}{target} = {{{', '.join(texts)}}}"
        if _fits(line) or not line.isascii():
            return line
        comma = "," if len(items) > 1 else ""
        inner = indent + "    "
        lines = [f"{indent}{target} = {{"]
        for (key, value), text in zip(items, texts, strict=True):
            if _fits(inner + text + comma):
                lines.append(inner + text + comma)
            elif isinstance(value, str):
                lines.append(self._whole(inner + text + comma, value))
            else:
                behind = "," if len(value) > 1 else ""
                elements = [self._whole(f"{inner}    {each}{behind}", each) for each in value]
                lines += [f"{inner}{key}: [", *elements, f"{inner}]{comma}"]
        return "\n".join([*lines, indent + "}"])

    def tuple_of(self, target: str, elements: Sequence[str], indent: str = "") -> str:
        """Lay out the assignment of a tuple of calls; of several, each has a line."""
        if len(elements) == 1 and _fits(line := f"{indent}{target} = ({elements[0]},)"):
            return line
        inner = indent + "    "
        lines = [line for each in elements for line in self._brackets(each + ",", inner)]
        return "\n".join((f"{indent}{target} = (", *lines, f"{indent})"))

    def field_in_progress(self, type_name: str, indent: str) -> str:
        """Lay out the two variables that a conversion has for its errors."""
        line = f'{indent}type_name, field = "{type_name}", ""'
        if _fits(line):
            return line
        inner = indent + "    "
        name = self._whole(f'{inner}"{type_name}",', f'"{type_name}"')
        return "\n".join((f"{indent}type_name, field = (", name, f'{inner}"",', f"{indent})"))

    def argument(self, name: str, annotation: str, default: str, indent: str) -> str:
        """Lay out an argument that has a line of its own and may be None."""
        line = f"{indent}{name}: {annotation} | None = {default},"
        if _fits(line):
            return line
        inner = indent + "    "
        lines: Iterable[str] = (f"{inner}{annotation} | None",)
        if not _fits(f"{inner}{annotation} | None"):
            lines = (*self._brackets(annotation, inner), f"{inner}| None")
        return "\n".join((f"{indent}{name}: (", *lines, f"{indent}) = {default},"))

    def definition(self, name: str, argument: str, returns: str, body: str, indent: str) -> str:
        """Lay out the head of a function with one argument, and ` ...` or nothing behind it."""
        line = f"{indent}def {name}({argument}) -> {returns}:{body}"
        if _fits(line):
            return line
        inner = indent + "    "
        last: Iterable[str] = self._brackets(f") -> {returns}:{body}", indent)
        if "[" not in returns and not _fits(f"{indent}) -> {returns}:{body}"):
            last = (f"{indent}) -> (", self.settled(inner + returns), f"{indent}):{body}")
        return "\n".join((f"{indent}def {name}(", f"{inner}{argument},", *last))

    def comment(self, lines: Iterable[str], indent: str) -> str:
        """Lay out a comment, above what it is about."""
        return self.settled("\n".join(f"{indent}# {_comment_text(line)}".rstrip() for line in lines))

    def docstring(self, first: str, lines: Sequence[str], indent: str) -> str:
        """Lay out the docstring of a class or function; its first line may be empty."""
        if any(line.endswith("\\") for line in lines):  # black leaves these as they are
            return self.plain_docstring(first, lines, indent)
        lines = [_without_leading_tabs(line) for line in lines]
        depths = [len(line) - len(line.lstrip()) for line in lines if line.strip()]
        if not depths:
            return self.settled(f'{indent}"""{first}"""')
        return self.plain_docstring(first, [line[min(depths) :].rstrip() for line in lines], indent)

    def plain_docstring(self, first: str, lines: Sequence[str], indent: str) -> str:
        """Lay out text that stands where black knows no docstring, such as behind an attribute."""
        indented = [indent + line if line else "" for line in lines]
        return self.settled("\n".join((f'{indent}"""{first}', *indented, f'{indent}"""')))

    def settled(self, text: str) -> str:
        """Return text whose long lines cannot be split."""
        self._settled.update(line for line in text.split("\n") if not _fits(line))
        return text

    def _statement(self, text: str, indent: str) -> Iterator[str]:
        target, equals, value = text.partition(" = ")
        if _fits(indent + text) or not equals or value.endswith(")"):
            yield from self._brackets(text, indent)
            return
        inner = indent + "    "
        call, alternative, zeros = value.partition(" or ")
        if _fits(inner + value):
            lines: Iterable[str] = (inner + value,)
        elif alternative:
            lines = (*self._brackets(call, inner), f"{inner}or {zeros}")
        else:
            yield indent + text
            return
        yield from (f"{indent}{target} = (", *lines, f"{indent})")

    def _brackets(self, text: str, indent: str) -> Iterator[str]:
        """Split at the last brackets that hold something, and what is in them at its commas, as far as is needed."""
        if _fits(indent + text):
            yield indent + text
            return
        brackets = None if " or " in text else _last_brackets(text)
        if brackets is None:
            yield self.settled(indent + text) if _NAME.fullmatch(text) else indent + text
            return
        start, end = brackets
        inner, parts = indent + "    ", _parts(text[start:end])
        yield indent + text[:start]
        if len(parts) == 1 or _fits(inner + text[start:end]):
            yield from self._brackets(text[start:end], inner)
        else:
            for part in parts:
                yield from self._brackets(part + ",", inner)
        yield indent + text[end:]

    def _whole(self, line: str, value: str) -> str:
        """Return a line with a literal; a string cannot be split."""
        return self.settled(line) if _is_string(value) else line


_NAME = re.compile(r"[\w.]+,?")


def _fits(line: str) -> bool:
    """Whether a line is short enough, however wide the characters are that are not ASCII."""
    return len(line) <= LINE_LENGTH and (
        line.isascii() or sum(1 + (not each.isascii()) for each in line) <= LINE_LENGTH
    )


def _is_string(literal: str) -> bool:
    return literal[-1] in "'\""


def _without_leading_tabs(line: str) -> str:
    text = line.lstrip()
    return line[: len(line) - len(text)].expandtabs(4) + text


def _list(elements: Iterable[str]) -> str:
    return f"[{', '.join(elements)}]"


def _comment_text(line: str) -> str:
    """Return a line as black has it: only type comments have a form."""
    if line.lstrip().startswith("type:") and "\N{NO-BREAK SPACE}" not in line:
        return f"type: {line.partition(':')[2].strip()}"
    return line


_OPENING, _CLOSING = "([", ")]"


def _last_brackets(text: str) -> tuple[int, int] | None:
    """Return where what is in the last brackets starts and ends, not counting those with nothing in them."""
    depth = end = 0
    for index in range(len(text) - 1, -1, -1):
        if text[index] in _CLOSING:
            end = end if depth else index
            depth += 1
        elif text[index] in _OPENING:
            depth -= 1
            if not depth and end > index + 1:
                return index + 1, end
    return None


def _parts(text: str) -> list[str]:
    """Split at the commas that are in no brackets."""
    parts, start, depth = [], 0, 0
    for index, character in enumerate(text):
        depth += (character in _OPENING) - (character in _CLOSING)
        if character == "," and not depth:
            parts.append(text[start:index])
            start = index + 2
    return [*parts, text[start:]]
