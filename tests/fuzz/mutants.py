# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Mutants: of bytes, of the records of an MCAP file, of texts and of documents."""

from copy import deepcopy
import struct
from xml.etree import ElementTree

from hypothesis import strategies as st
import yaml

# The dumper in C, where there is one, is five times as fast.
_DUMPER = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)
#: Values at which code breaks.
INTEGERS = (0, 1, 2, 21, 22, 255, 256, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**62)
INTEGERS += (2**63 - 1, 2**63, 2**64 - 1)
PLACE = st.floats(0.0, 1.0, exclude_max=True)
TEXTS = (
    '', '0', '-1', '1e999', '-inf', 'nan', '1e308', '1e-320', '9' * 5000, 'x' * 5000, 'null', '~',
    '2001-01-01', '2001-99-99', '1:60:60', '\x1b[2J', '[' * 200, '{', '}', '&a [*a]', '*a',
    '!!binary x', '!!python/object:os.system {}', '0x' + 'f' * 4000, 'true', '<x/>', '&lol;', '\0',
    '..', '/dev/zero', '\N{SNOWMAN}', "'", '"', '# ', '- ', ': ', '  ', '\t',
    '${1/0}', '$(env HOME)',
)  # fmt: skip
WEIRD = st.one_of(
    st.sampled_from(
        [None, True, [], {}, '', 'x' * 5000, '\x1b[2J', float('nan'), float('inf'), -1, -1.0, 0,
         1e308, -1e308, 1e-320, 1e12, 10**4000, 2**63, [[]], {'a': 1}, '2001-01-01', 'nan']
    ),
    st.floats(),
    st.integers(),
    st.text(max_size=5),
)  # fmt: skip

BYTE_EDIT = st.tuples(
    st.sampled_from(['flip', 'set', 'cut', 'insert', 'delete', 'swap']),
    PLACE,
    st.integers(0, 255),
    st.integers(1, 64),
)


def edited_bytes(content, edits):
    """Return bytes with some edits, each an operation, a place, a value and a length."""
    content = bytearray(content)
    for operation, place, value, length in edits:
        at = int(place * max(len(content), 1))
        if operation == 'flip':
            content[at : at + 1] = bytes(byte ^ (value or 1) for byte in content[at : at + 1])
        elif operation == 'set':
            content[at : at + length] = bytes([value]) * len(content[at : at + length])
        elif operation == 'cut':
            del content[at:]
        elif operation == 'insert':
            content[at:at] = bytes([value]) * length
        elif operation == 'delete':
            del content[at : at + length]
        else:
            other = value * len(content) // 256
            one, two = content[at : at + length], content[other : other + length]
            content[at : at + len(two)], content[other : other + len(one)] = two, one
    return bytes(content)


def records(content):
    """Return where the records of a whole MCAP file begin and end."""
    found, position = [], 8
    while position + 9 <= len(content):
        (length,) = struct.unpack_from('<Q', content, position + 1)
        if position + 9 + length > len(content):
            break
        found.append((position, position + 9 + length))
        position += 9 + length
    return found


RECORD_EDIT = st.tuples(
    st.sampled_from(['opcode', 'length', 'field', 'delete', 'twice', 'swap', 'bytes']),
    PLACE,
    PLACE,
    st.sampled_from(INTEGERS),
    st.sampled_from([1, 2, 4, 8]),
)


def edited_records(content, edits):
    """Return an MCAP file with some of its records edited; checksums are left as they are."""
    parts = [content[begin:end] for begin, end in records(content)]
    tail = content[records(content)[-1][1] :]
    for operation, which, where, value, width in edits:
        if not parts:
            break
        number = int(which * len(parts))
        part = bytearray(parts[number])
        if operation == 'opcode':
            part[0] = value & 0xFF
        elif operation == 'length':
            part[1:9] = struct.pack('<Q', value)
        elif operation in ('field', 'bytes'):
            # The heads of records are short, and what is in them matters most.
            span = min(len(part), 64) if operation == 'field' else len(part)
            at = min(int(where * span), len(part) - 1)
            part[at : at + width] = (value & (2 ** (8 * width) - 1)).to_bytes(width, 'little')[
                : len(part) - at
            ]
        elif operation == 'delete':
            del parts[number]
            continue
        elif operation == 'twice':
            parts.insert(number, parts[number])
            continue
        else:
            other = int(where * len(parts))
            parts[number], parts[other] = parts[other], parts[number]
            continue
        parts[number] = bytes(part)
    return content[:8] + b''.join(parts) + tail


TEXT_EDIT = st.tuples(
    st.sampled_from(['token', 'insert', 'line', 'twice', 'swap', 'cut', 'indent']),
    PLACE,
    st.sampled_from(TEXTS),
    PLACE,
)


def edited_text(text, edits):
    """Return a text with tokens and lines edited."""
    for operation, place, new, other in edits:
        lines = text.split('\n')
        number, second = int(place * len(lines)), int(other * len(lines))
        line = lines[number]
        if operation == 'token':
            words = line.split(' ')
            at = int(other * len(words))
            words[at] = new
            lines[number] = ' '.join(words)
        elif operation == 'insert':
            at = int(other * (len(line) + 1))
            lines[number] = line[:at] + new + line[at:]
        elif operation == 'line':
            lines[number] = new
        elif operation == 'twice':
            lines.insert(second, line)
        elif operation == 'swap':
            lines[number], lines[second] = lines[second], line
        elif operation == 'cut':
            del lines[number:]
        else:
            lines[number] = ' ' * int(8 * other) + line.lstrip()
        text = '\n'.join(lines)
    return text


TREE_EDIT = st.tuples(
    st.lists(PLACE, max_size=6),
    st.sampled_from(['set', 'delete', 'twice', 'rename', 'scale']),
    WEIRD,
)


def edited_tree(tree, edits):
    """Return a document of maps, lists and scalars with some of its nodes edited."""
    tree = deepcopy(tree)
    for path, operation, value in edits:
        value = deepcopy(value)  # hypothesis draws one object several times
        holder, key, node = None, None, tree
        for place in path:
            keys = list(node) if isinstance(node, dict) else []
            if isinstance(node, list):
                keys = list(range(len(node)))
            if not len(keys):
                break
            holder, key = node, keys[int(place * len(keys))]
            node = node[key]
        if holder is None:
            if operation == 'set':
                tree = value
                break
            continue
        if operation == 'set':
            holder[key] = value
        elif operation == 'delete':
            del holder[key]
        elif operation == 'scale' and isinstance(node, float):
            holder[key] = node * 1e200
        elif operation == 'twice' and isinstance(holder, list):
            holder.insert(key, deepcopy(node))
        elif operation == 'rename' and isinstance(holder, dict):
            holder[str(value)[:50]] = holder.pop(key)
    return tree


def to_yaml(tree):
    """Return a document as YAML."""
    return yaml.dump(tree, Dumper=_DUMPER, sort_keys=False, allow_unicode=True)


NUMBERS = ('nan', 'inf', '-inf', '1e999', '1e308', '1e-320', '0', '-1', '', 'x', '0 0', '1 2 3 4')
XML_EDIT = st.tuples(
    st.sampled_from(['attribute', 'delete', 'twice', 'move', 'tag', 'drop', 'text']),
    PLACE,
    PLACE,
    st.one_of(st.sampled_from(NUMBERS), st.sampled_from(TEXTS), st.floats().map(str)),
)


def edited_xml(text, edits):
    """Return an XML document with some of its elements edited."""
    root = ElementTree.fromstring(text)
    for operation, which, where, value in edits:
        parents = {child: parent for parent in root.iter() for child in parent}
        nodes = list(root.iter())
        node = nodes[int(which * len(nodes))]
        if operation in ('attribute', 'drop') and node.attrib:
            name = list(node.attrib)[int(where * len(node.attrib))]
            if operation == 'drop':
                del node.attrib[name]
            else:
                node.set(name, value)
        elif operation == 'tag':
            node.tag = nodes[int(where * len(nodes))].tag
        elif operation == 'text':
            node.text = value
        elif node in parents and operation == 'delete':
            parents[node].remove(node)
        elif node in parents and operation == 'twice':
            parents[node].append(node)
        elif node in parents and operation == 'move':
            target = nodes[int(where * len(nodes))]
            if node not in target.iter() and target not in node.iter():
                parents[node].remove(node)
                target.append(node)
    return ElementTree.tostring(root, encoding='unicode').replace('\0', '')
