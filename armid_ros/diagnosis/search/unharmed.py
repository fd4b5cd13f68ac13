# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
No patch makes a model worse.

In no joint, on the data it was found in or on others, may the patched model leave more than the
given one beyond what blocks of the data differ by, unless what is left is no gap.

"""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import block_rows
from armid_ros.diagnosis.search.explain import Explanation
from armid_ros.diagnosis.settings import DiagnosisSettings
import numpy as np
import numpy.typing as npt

#: Deviations beyond which a joint is surely worse, and share of its squares that nobody would
#: call worse.
_SURELY, _SLIGHTLY = 3.0, 0.05


def harmed(
    explanation: Explanation, unseen: Evidence | None, settings: DiagnosisSettings
) -> tuple[str, ...]:
    """Return the joints in which the patched model is worse than the given one."""
    if not explanation.steps:
        return ()
    before, after = explanation.given, explanation.fitted.arm
    sets = [explanation.evidence, *([] if unseen is None else [unseen])]
    worse = np.any([_worse(before, after, evidence, settings) for evidence in sets], axis=0)
    return tuple(j for j, bad in zip(before.robot.joints, worse, strict=True) if bad)


def _worse(
    before: ArmModel, after: ArmModel, evidence: Evidence, settings: DiagnosisSettings
) -> npt.NDArray[np.bool_]:
    data, sigma = evidence.data, evidence.sigma
    squares = [
        [
            (part.residual(arm) * part.informative / s) ** 2
            for part, s in zip(data, sigma, strict=True)
        ]
        for arm in (before, after)
    ]
    block, _ = block_rows(data)
    joints = range(squares[0][0].shape[1])
    sums = [
        np.array([np.bincount(block, np.concatenate(rows)[:, j]) for j in joints])
        for rows in squares
    ]
    more = sums[1] - sums[0]
    spread = more.std(axis=1, ddof=1) * np.sqrt(more.shape[1])
    total = more.sum(axis=1)
    floor = np.maximum(sums[0].sum(axis=1), evidence.count)
    left = [part.residual(after) for part in evidence.data]
    gap = evidence.chi2_per_row(left) > evidence.as_good(settings) + evidence.matters(settings)
    surely = (total > _SURELY * spread) & (total > _SLIGHTLY * floor)
    by_far = total > (settings.thresholds.same_fit - 1.0) * floor
    return np.asarray((surely | by_far) & gap)
