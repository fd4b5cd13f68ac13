# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings as a reader calls them: names, and of the folders what tells them apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath


def short_names(sources: Sequence[str]) -> dict[str, str]:
    """
    Return what each source is called: the end of its path that no other one has.

    Parameters
    ----------
    sources : sequence of str
        Paths, or any other names.

    """
    every = list(dict.fromkeys(source for source in sources if source))
    parts = {source: PurePath(source).parts for source in every}
    names = {}
    for source in every:
        own = parts[source]
        for count in range(1, len(own) + 1):
            end = own[-count:]
            if sum(other[-count:] == end for other in parts.values()) == 1:
                break
        names[source] = '/'.join(part.strip('/') for part in own[-count:])
    return names


def with_names(text: str, names: Mapping[str, str]) -> str:
    """Return a text with names in the place of sources, the longest first."""
    for source in sorted(names, key=len, reverse=True):
        text = text.replace(source, names[source])
    return text
