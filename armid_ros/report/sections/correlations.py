# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which parameters the data tell apart badly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.estimate import Estimate
from armid_ros.motion import FloatArray
from armid_ros.report.charts import image_data, script_json
from armid_ros.report.families import full_label, parameter_families
from armid_ros.report.page import Section
from armid_ros.report.statistics import correlations
from markupsafe import Markup
import numpy as np

#: Correlation from which two parameters are hard to tell apart.
STRONG = 0.9
_POSITIVE, _NEGATIVE = (0.0, 0.447, 0.698), (0.835, 0.369, 0.0)


@dataclass(frozen=True)
class Correlations(Section):
    """
    Correlation of every pair of parameters.

    Attributes
    ----------
    estimate : Estimate
        P parameters with covariance.
    links : sequence of str
        Names of the links, in the order of their numbers.

    """

    title: ClassVar[str] = 'Correlations'
    template: ClassVar[str] = 'correlations.html'
    strong: ClassVar[float] = STRONG

    estimate: Estimate
    links: Sequence[str] = ()

    @property
    def families(self) -> list[tuple[str, float]]:
        """Kinds of parameters in the order of the picture, and their share of its width [%]."""
        names = self.estimate.parameters
        kinds = parameter_families(names)
        return [(kind, 100.0 * len(members) / len(names)) for (kind, _), members in kinds.items()]

    @property
    def labels(self) -> list[str]:
        """Labels in the order of the picture."""
        names = self.estimate.parameters
        kinds = parameter_families(names).values()
        return [full_label(names[k], self.links) for members in kinds for k in members]

    @property
    def picture(self) -> str:
        """Return the matrix as an image of one pixel an entry, transparent where it is zero."""
        rho = self._sorted()
        return image_data(np.where((rho >= 0.0)[..., None], _POSITIVE, _NEGATIVE), rho)

    @property
    def json(self) -> Markup:
        """Names and correlations in percent, for the reader's pointer."""
        percent = np.rint(100.0 * self._sorted()).astype(int).tolist()
        return script_json({'labels': self.labels, 'percent': percent})

    @property
    def pairs(self) -> Sequence[tuple[str, str, float]]:
        """Pairs that are hard to tell apart, the strongest first."""
        rho = self._sorted()
        first, second = np.nonzero(np.triu(np.abs(rho) > STRONG, 1))
        order = np.argsort(-np.abs(rho[first, second]))
        labels = self.labels
        return [
            (labels[first[k]], labels[second[k]], float(rho[first[k], second[k]])) for k in order
        ]

    def _sorted(self) -> FloatArray:
        order = [k for ks in parameter_families(self.estimate.parameters).values() for k in ks]
        return correlations(self.estimate)[np.ix_(order, order)]
