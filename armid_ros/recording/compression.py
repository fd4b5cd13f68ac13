# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Decompression of parts of bags, with a limit of the decompressed size.

A few compressed bytes can expand to any size. At most the size that the bag states is
decompressed. Content of a different size is damaged.

"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
import threading
from typing import BinaryIO

from armid_ros.errors import RecordingError
from armid_ros.recording.source import ReadSettings
import lz4.frame
import zstandard

_Buffer = bytes | memoryview
#: Exceptions that decompressors raise for damaged data.
CORRUPT = (zstandard.ZstdError, RuntimeError, MemoryError, OverflowError, ValueError)
#: First bytes of a zstd frame; no CDR message begins with them.
ZSTD = b'\x28\xb5\x2f\xfd'


def decompressed(stored: _Buffer, compression: str, size: int, settings: ReadSettings) -> bytes:
    """
    Return the decompressed content of a complete zstd or lz4 frame.

    Parameters
    ----------
    stored : buffer
        The compressed frame.
    compression : {'zstd', 'lz4'}
        Format of the frame.
    size : int
        Size of the content that the bag states [bytes].
    settings : ReadSettings
        The memory limit.

    Raises
    ------
    one of CORRUPT
        The frame is damaged, or its content has another size.
    RecordingError
        The content exceeds the memory limit.

    """
    if compression == 'zstd':
        stated = int(zstandard.frame_content_size(stored))
    else:
        stated = int(lz4.frame.get_frame_info(stored)['content_size']) or -1
    if stated not in (-1, size):  # -1: the frame states no size
        raise ValueError(f'the damaged chunk states {stated} bytes of content instead of {size}')
    settings.require(size, 'a chunk')
    if not size:
        return b''
    if compression == 'zstd':
        content = _ZSTD.decompressor.decompress(stored, max_output_size=size)
    else:
        decompressor = lz4.frame.LZ4FrameDecompressor()
        content = bytes(decompressor.decompress(stored, max_length=size))
        if not decompressor.eof and decompressor.decompress(b'', max_length=1):
            raise ValueError(f'the damaged chunk has more than {size} bytes')
    if len(content) != size:
        raise ValueError(f'the damaged chunk has {len(content)} bytes instead of {size}')
    return content


class _Zstd(threading.local):
    """One zstd decompressor per thread, which is reused because creation takes long."""

    def __init__(self) -> None:
        self.decompressor = zstandard.ZstdDecompressor()


_ZSTD = _Zstd()


def partly_decompressed(stored: _Buffer, compression: str, size: int) -> bytes:
    """Decompress a truncated zstd or lz4 frame as far as possible, up to ``size`` bytes."""
    if compression == 'zstd':
        decompressor = zstandard.ZstdDecompressor().decompressobj()
    else:
        decompressor = lz4.frame.LZ4FrameDecompressor()
    content, step = bytearray(), 1024  # bytes
    with suppress(*CORRUPT, EOFError):
        for at in range(0, len(stored), step):
            # Each block of a compressor can be decompressed alone.
            content += decompressor.decompress(bytes(stored[at : at + step]))
            if len(content) >= size:
                break
    return bytes(content[:size])


def unpacked(stream: BinaryIO, settings: ReadSettings, content_name: str) -> Iterator[bytes]:
    """
    Yield the decompressed content of a zstd file or message in pieces of 1 MiB.

    A limit is needed, as not every writer states the size of the content in the frame.

    Parameters
    ----------
    stream : file
        The compressed data.
    settings : ReadSettings
        The memory limit.
    content_name : str
        Name of the content in error messages, such as 'a compressed message'.

    Raises
    ------
    RecordingError
        The data are damaged, or their content exceeds the limit.

    """
    size = 0
    try:
        with zstandard.ZstdDecompressor().stream_reader(
            stream, read_across_frames=True
        ) as content:
            while piece := content.read(1 << 20):
                size += len(piece)
                settings.require(size, content_name)
                yield piece
    except CORRUPT as error:
        raise RecordingError(f'{content_name} is damaged: {error}') from error
