# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Textbook model selection, for comparison with the diagnosis.

Forward selection by the Bayesian information criterion pools all rows and takes their errors as
independent and identically distributed. It uses no noise floor, no held-out data and no
replication.
Catalogue, filters, columns and free rigid parameters are those of the diagnosis.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.baseline import excited_parameters, refitted_arm
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import Rows
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.prepare import choose_filters
from armid_ros.diagnosis.search.candidates import Causes
from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.hyperparameters import Hyperparameters
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.odds import CauseInformation
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.recording import Recording
import numpy as np
import scipy.linalg

#: Smallest share of a candidate's columns that is independent of the free parameters.
_LEAST_VISIBLE = 0.02
#: Share of the squares of a candidate below which a direction of its values stays zero.
_DEPENDENT = 1e-6
#: Prior standard deviation of the values in their unit; large enough that they are free.
_FREE = 1e3


def bic_selection(
    arm: ArmModel,
    recordings: Sequence[Recording],
    settings: DiagnosisSettings,
    rng: np.random.Generator,
) -> list[Cause]:
    """
    Return the effects that forward selection adds by the BIC, in the order of selection.

    Parameters
    ----------
    arm : ArmModel
        The arm as described; its rigid body and known effects are free.
    recordings : sequence of Recording
        Data with torques.
    settings : DiagnosisSettings
        Catalogue of effects.
    rng : numpy.random.Generator
        Draws the random states from which base parameters are found.

    """
    used = choose_filters(arm, recordings, (), settings, rng)
    data = trajectories(recordings, used)
    base, _ = excited_parameters(arm, arm.base_parameters(rng), data)
    one = [np.ones(arm.robot.n_joints)] * len(data)
    pooled_rows = Evidence.over_noise(data, one)
    alike = np.sqrt(pooled_rows.power(pooled_rows.residuals(refitted_arm(arm, base, data, one))))
    rows = Rows.over_noise(Evidence.over_noise(data, [alike] * len(data)))
    nuisance = Nuisance.of(rows, memoized_arm(arm), rng)
    catalogue = Causes(settings.kinds, nuisance, False, frozenset())
    pooled = Hyperparameters(1.0, 0.0, 0.0, 1.0, 1.0)
    count = sum(nuisance.count)
    chosen: list[Cause] = []
    while True:
        posterior = nuisance.posterior(pooled)
        squares = nuisance.squares_of_diagnosed(posterior)
        best, cause = 0.0, None
        for candidate in catalogue.causes(nuisance, posterior):
            known = CauseInformation.of([candidate], nuisance, posterior, pooled=True)
            if known.visible[0] < _LEAST_VISIBLE:
                continue
            matrix, vector = known.matrix[0], known.vector[0]
            fitted = scipy.linalg.lstsq(matrix, vector, cond=_DEPENDENT)[0]
            after = max(squares - float(fitted @ vector), 1e-300)
            change = count * np.log(after / squares) + known.size * np.log(count)
            if change < best:
                best, cause = change, candidate
        if cause is None:
            return chosen
        chosen.append(cause)
        nuisance = nuisance.and_cause(cause, _FREE)
