# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where a report comes from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.report.page import Section
from armid_ros.report.provenance import Provenance


@dataclass(frozen=True)
class Origin(Section):
    """Files with their hashes, versions, settings, seed."""

    title: ClassVar[str] = 'Provenance'
    template: ClassVar[str] = 'origin.html'

    provenance: Provenance
