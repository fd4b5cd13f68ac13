# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Decompress data with a limit of the size.

A few compressed bytes can expand to any size, so the stated size is the limit. Content of another
size counts as damaged, and no more than the stated size is decompressed.

"""

from __future__ import annotations

from collections.abc import Iterator
import threading
from typing import BinaryIO

from armid_ros.errors import RecordingError
import lz4.frame
import zstandard

_Buffer = bytes | memoryview
#: Exceptions of the decompressors for damaged data.
CORRUPT = (zstandard.ZstdError, RuntimeError, MemoryError, OverflowError, ValueError)
#: First bytes of a zstd frame; no CDR message begins with them.
ZSTD = b'\x28\xb5\x2f\xfd'


def stated_size(stored: _Buffer, compression: str) -> int | None:
    """Return the content size that a compressed frame states; None if it states none."""
    if compression == 'zstd':
        size = int(zstandard.frame_content_size(stored))
        return size if size >= 0 else None
    size = int(lz4.frame.get_frame_info(stored)['content_size'])
    return size or None


def decompressed(stored: _Buffer, compression: str, size: int) -> bytes:
    """
    Return the content of a frame.

    Parameters
    ----------
    stored : buffer
        The frame.
    compression : {'zstd', 'lz4'}
        Its kind.
    size : int
        Size that the content must have [bytes].

    Raises
    ------
    RecordingError
        The frame is damaged, or its content has another size.

    """
    try:
        said = stated_size(stored, compression)
        if said is not None and said != size:
            raise RecordingError(f'holds {said} bytes, but {size} are stated')
        if not size:
            return b''
        if compression == 'zstd':
            content = _ZSTD.decompressor.decompress(stored, max_output_size=size)
        else:
            decompressor = lz4.frame.LZ4FrameDecompressor()
            content = bytes(decompressor.decompress(stored, max_length=size))
            if not decompressor.eof and decompressor.decompress(b'', max_length=1):
                raise RecordingError(f'holds more than the {size} bytes stated')
    except CORRUPT as error:
        raise RecordingError(str(error) or 'it cannot be decompressed') from error
    if len(content) != size:
        raise RecordingError(f'holds {len(content)} bytes, but {size} are stated')
    return content


class _Zstd(threading.local):
    """One decompressor per thread: making one takes as long as decompressing 20 kB."""

    def __init__(self) -> None:
        self.decompressor = zstandard.ZstdDecompressor()


_ZSTD = _Zstd()


def partly_decompressed(stored: _Buffer, compression: str, size: int) -> bytes:
    """Return the readable content of a truncated frame, at most ``size`` bytes."""
    content = bytearray()
    try:
        _decompress_into(content, stored, compression, size)
    except (*CORRUPT, EOFError):
        pass
    return bytes(content[:size])


def _decompress_into(content: bytearray, data: _Buffer, compression: str, size: int) -> None:
    """Append the content of a frame until ``size`` bytes, or one step more, are reached."""
    if compression == 'zstd':
        decompressor = zstandard.ZstdDecompressor().decompressobj()
    else:
        decompressor = lz4.frame.LZ4FrameDecompressor()
    step = 1024  # bytes
    for at in range(0, len(data), step):
        # Each block that a compressor writes can be decompressed on its own.
        content += decompressor.decompress(bytes(data[at : at + step]))
        if len(content) >= size:
            break


def unpacked(stream: BinaryIO) -> Iterator[bytes]:
    """
    Yield the content of a zstd file, a piece at a time.

    Raises
    ------
    RecordingError
        The file is damaged, or ends within a frame.

    """
    try:
        with zstandard.ZstdDecompressor().stream_reader(
            stream, read_across_frames=True
        ) as content:
            while piece := content.read(1 << 20):
                yield piece
    except CORRUPT as error:
        raise RecordingError(f'the compressed file is damaged: {error}') from error


def message_content(data: bytes, limit: int) -> bytes:
    """
    Decompress a message that rosbag2 compressed on its own.

    Not every writer states the size of the content in the frame, so that a limit is needed.

    Raises
    ------
    RecordingError
        If the message is damaged, or its content exceeds the limit.

    """
    content = bytearray()
    try:
        _decompress_into(content, data, 'zstd', limit + 1)
    except (*CORRUPT, EOFError) as error:
        raise RecordingError(f'a compressed message is damaged: {error}') from error
    if len(content) > limit:
        raise RecordingError(f'a compressed message takes more than {limit} bytes')
    return bytes(content)
