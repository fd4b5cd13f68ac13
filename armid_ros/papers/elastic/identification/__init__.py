# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Two links driven through springs: identification in three steps.

Rigid least squares; subspaces of each joint on its own, with computed interaction torques as
inputs; physical parameters, tuned to closed-loop step responses. ``identify_two_inertia`` does
all of them. Source: Oaki and Adachi 2008.

"""

from armid_ros.papers.elastic.identification.files import Accelerometers, read_runs
from armid_ros.papers.elastic.identification.interaction import (
    coupled_response,
    decibel_error,
    decouple,
    DecoupledJoint,
    interaction_torques,
    joint_signals,
)
from armid_ros.papers.elastic.identification.physical import (
    DecoupledFit,
    fit_joint,
    ideal_response,
)
from armid_ros.papers.elastic.identification.rigid import fit_rigid, RigidFit
from armid_ros.papers.elastic.identification.spectra import measured_response
from armid_ros.papers.elastic.identification.subspace import identify_subspace, Signals, StateSpace
from armid_ros.papers.elastic.identification.three_steps import (
    identify_two_inertia,
    MeasuredJoint,
    TwoInertiaIdentification,
)
from armid_ros.papers.elastic.identification.tuning import tune, Tuning

__all__ = [
    'identify_two_inertia',
    'TwoInertiaIdentification',
    'MeasuredJoint',
    'read_runs',
    'Accelerometers',
    'fit_rigid',
    'RigidFit',
    'decouple',
    'coupled_response',
    'DecoupledJoint',
    'ideal_response',
    'interaction_torques',
    'joint_signals',
    'decibel_error',
    'measured_response',
    'identify_subspace',
    'Signals',
    'StateSpace',
    'fit_joint',
    'DecoupledFit',
    'tune',
    'Tuning',
]
