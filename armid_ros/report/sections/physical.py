# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether the links are bodies, and which constraints hold them there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification import PhysicalCertificate
from armid_ros.model.pseudo_inertia import Consistency
from armid_ros.report.page import Section


@dataclass(frozen=True)
class PhysicalSection(Section):
    """
    The certificate of a fit among bodies.

    Attributes
    ----------
    certificate : PhysicalCertificate
        What shows it.
    exports : mapping of str to sequence of str
        Files for other programs, and what each has no place for.

    """

    title: ClassVar[str] = 'Physical consistency'
    template: ClassVar[str] = 'physical.html'

    certificate: PhysicalCertificate
    exports: Mapping[str, Sequence[str]]

    @property
    def rows(self) -> list[tuple[Consistency, float, bool]]:
        """Link, its smallest size relative to the prior's, whether it is at its limit."""
        given = self.certificate
        return [
            (link, float(share), link.link in given.active)
            for link, share in zip(given.links, given.shares, strict=True)
        ]

    @property
    def without_place(self) -> dict[str, Counter[str]]:
        """Effects, and how many values of each, that the files have no place for."""
        return {
            file: Counter(line.split(':')[0] for line in lines)
            for file, lines in self.exports.items()
        }

    @property
    def cost(self) -> tuple[float, float]:
        """Torque error that the constraints cost [%]: training data, blocks left out."""
        given = self.certificate
        return 100.0 * (given.misfit_ratio - 1.0), 100.0 * (given.held_out_ratio - 1.0)
