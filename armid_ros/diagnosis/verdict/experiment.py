# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The experiment that would separate two names."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.effects import CATALOGUE, Effect


def separating(name: str, rival: str, joints: Sequence[str]) -> str:
    """Say which experiment separates two names."""
    where = f' of {", ".join(joints)}' if joints else ''
    shown = dict.fromkeys(CATALOGUE.get(one, Effect).shown_by for one in (name, rival))
    return f'To separate {name} from {rival}{where}: {", and ".join(shown)}.'
