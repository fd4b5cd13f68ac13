# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Editing of single attributes and elements of an XML text; all other bytes stay, comments included.

A parser, which handles comments and CDATA, finds the positions of elements in the text. Edits
replace bytes at these positions.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
import re
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

_ATTRIBUTE = re.compile(rb"""([^\s=<>"'/]+)\s*=\s*("[^"]*"|'[^']*')""")


@dataclass
class Element:
    """
    An element and its positions in the text [bytes].

    Attributes
    ----------
    name : str
        Tag of the element.
    attributes : mapping of str to str
        Values of the attributes by name.
    start : int
        First byte of the start tag.
    start_end : int
        First byte after the start tag.
    end : int
        First byte of the end tag; equal to `start` if the element is empty ('<x/>').
    stop : int
        First byte after the element.
    children : list of Element
        Child elements in the order of the text.

    """

    name: str
    attributes: Mapping[str, str]
    start: int
    start_end: int = 0
    end: int = 0
    stop: int = 0
    children: list[Element] = field(default_factory=list)

    def find(self, name: str) -> Element | None:
        """Return the first child with a tag; None without one."""
        return next(self.all(name), None)

    def all(self, name: str) -> Iterator[Element]:
        """Return the children with a tag."""
        return (child for child in self.children if child.name == name)

    @property
    def empty(self) -> bool:
        """Whether the element has no end tag, as '<x/>'."""
        return self.end == self.start


class XmlText:
    """
    An XML text with edits.

    Parameters
    ----------
    text : str
        Well-formed XML.

    Attributes
    ----------
    root : Element
        Root element of the text before the edits.

    """

    def __init__(self, text: str) -> None:
        self._bytes = text.encode('utf-8')
        self._edits: list[tuple[int, int, bytes]] = []
        self.root = self._parse()

    def set_attributes(self, element: Element, values: Mapping[str, str]) -> None:
        """Set attributes of an element; existing attributes keep their position and quotes."""
        tag = self._bytes[element.start : element.start_end]
        spans = {match[1].decode(): match.span(2) for match in _ATTRIBUTE.finditer(tag)}
        behind = max((stop for _, stop in spans.values()), default=1 + len(element.name.encode()))
        for name, value in values.items():
            if name in spans:
                first, last = (element.start + place for place in spans[name])
                quote = self._bytes[first : first + 1]
                self._edits.append((first, last, quote + value.encode() + quote))
            else:
                place = element.start + behind
                self._edits.append((place, place, f' {name}={quoteattr(value)}'.encode()))

    def append(self, parent: Element, lines: list[str]) -> None:
        """Add lines of XML as the last children of an element, indented as its children are."""
        indent = self._indent(parent)
        inner = self._indent(parent.children[-1]) if parent.children else indent + '  '
        added = ''.join(f'\n{inner}{line}' for line in lines)
        if parent.empty:
            slash = self._bytes.rindex(b'/', parent.start, parent.start_end)
            closed = f'>{added}\n{indent}</{parent.name}>'
            while self._bytes[slash - 1 : slash].isspace():
                slash -= 1
            self._edits.append((slash, parent.stop, closed.encode()))
            return
        place = parent.end
        while self._bytes[place - 1 : place].isspace():
            place -= 1
        tail = '' if b'\n' in self._bytes[place : parent.end] else f'\n{indent}'
        self._edits.append((place, place, (added + tail).encode()))

    def remove(self, element: Element) -> None:
        """Remove an element."""
        self._edits.append((element.start, element.stop, b''))

    def text(self) -> str:
        """Return the text with the edits."""
        result, last = [], 0
        for first, stop, new in sorted(self._edits, key=lambda edit: edit[:2]):
            result += [self._bytes[last:first], new]
            last = stop
        return b''.join([*result, self._bytes[last:]]).decode('utf-8')

    def _indent(self, element: Element) -> str:
        line = self._bytes[self._bytes.rfind(b'\n', 0, element.start) + 1 : element.start]
        return line.decode() if not line.strip() else ''

    def _parse(self) -> Element:
        parser = expat.ParserCreate('utf-8')
        stack: list[Element] = []
        roots: list[Element] = []

        def begin(name: str, attributes: dict[str, str]) -> None:
            start = parser.CurrentByteIndex
            element = Element(name, attributes, start, self._tag_end(start))
            (stack[-1].children if stack else roots).append(element)
            stack.append(element)

        def finish(name: str) -> None:
            element = stack.pop()
            if self._bytes[element.start : element.start_end].endswith(b'/>'):
                element.end, element.stop = element.start, element.start_end
            else:
                element.end = parser.CurrentByteIndex
                element.stop = self._tag_end(element.end)

        parser.StartElementHandler = begin
        parser.EndElementHandler = finish
        parser.Parse(self._bytes, True)
        return roots[0]

    def _tag_end(self, start: int) -> int:
        """Return the position after the tag at `start`; quoted values may contain '>'."""
        match = re.compile(rb"""<(?:[^"'>]|"[^"]*"|'[^']*')*>""").match(self._bytes, start)
        assert match is not None
        return match.end()
