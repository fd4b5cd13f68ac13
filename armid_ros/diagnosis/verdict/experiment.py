# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The experiment that would separate two names."""

from __future__ import annotations

from collections.abc import Sequence

#: What shows each effect best, as an engineer would do it.
_SHOWN_BY = {
    'viscous_friction': 'constant velocities, slow to fast, in both directions',
    'coulomb_friction': 'slow constant velocity in both directions',
    'stribeck_friction': 'constant velocities from 0.01 to 1 rad/s in both directions',
    'asymmetric_friction': 'static holds beside slow motion in both directions',
    'quadratic_friction': 'constant velocities up to the limit',
    'load_dependent_friction': 'the same motion with and without a known payload',
    'presliding_hysteresis': 'triangles of less than 0.02 rad at two rates',
    'thermal_friction': 'the same motion cold and after half an hour of work',
    'coupled_joint_friction': 'motion of one joint of the pair at a time',
    'torque_offset': 'static holds over the range of positions',
    'torque_drift': 'the same static hold, repeated for half an hour',
    'torque_gain': 'the same motion with and without a known payload',
    'torque_crosstalk': 'one joint loaded while the other one stands still',
    'torque_lag': 'a sweep of frequency up to half of the bandwidth',
    'time_delay': 'the same motion at two speeds, and a sweep of frequency',
    'encoder_offset': 'hard stops, or a payload at two poses',
    'rotor_inertia': 'fast motion of the joint in two postures of the arm',
    'payload': 'the same motion with and without the tool',
    'link_inertia': 'fast motion beside static holds',
    'gravity_magnitude': 'fast motion beside static holds',
    'base_tilt': 'static holds with the first joint turned around',
    'joint_elasticity': 'a sweep of frequency through the resonance',
    'backlash': 'slow reversals with the load pulling and pushing',
    'torque_ripple': 'slow constant velocity at three speeds',
    'joint_spring': 'static holds over the range, with and without a payload',
    'joint_coupling': 'static holds of one joint of the pair at many positions of the other',
    'soft_limit': 'slow motion into and out of the end of the range',
    'actuator_saturation': 'the same motion at rising amplitudes',
    'human_interaction': 'the same motion with the contact released',
    'interface_slack': 'the same motion at two tensions of the strap',
}


def separating(name: str, rival: str, joints: Sequence[str]) -> str:
    """Say which experiment separates two names."""
    where = f' of {", ".join(joints)}' if joints else ''
    return (
        f'To separate {name} from {rival}{where}: {_SHOWN_BY.get(name, "faster motion")}, '
        f'and {_SHOWN_BY.get(rival, "faster motion")}.'
    )
