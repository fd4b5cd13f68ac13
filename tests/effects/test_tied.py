# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Springs to a machine that was recorded beside the arm."""

from dataclasses import replace

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.effects.tied import Partner
from armid_ros.errors import ModelError
from armid_ros.identification.rows.signals import Conditioning, segments
from armid_ros.motion import Motion
from armid_ros.papers.exo.plant.leg_pair import (
    leg_pair,
    pair_torques,
    PairMotion,
    stepping,
    TiedPair,
)
from armid_ros.recording import recorded_together, Recording
import numpy as np
import pytest

STIFFNESS = np.array([1.0e4, 2.0e4, 5.0e3, 3.0e4])
SLACK = np.array([0.001, 0.002, 0.003, 0.0015])


@pytest.fixture(scope='module')
def pair() -> TiedPair:
    return leg_pair(STIFFNESS)


@pytest.fixture(scope='module')
def motions(pair) -> PairMotion:
    return stepping(pair, np.linspace(0.0, 0.456, 457))


@pytest.fixture(scope='module')
def together(pair, motions) -> Motion:
    """Return the motion of the exoskeleton with the points of its wearer beside it."""
    own = Recording(
        joints=pair.robot.joints, t=motions.own.t, q=motions.own.q, tau=motions.own.q * 0.0
    )
    other = Recording(joints=pair.other.joints, t=motions.own.t, q=motions.other.q)
    recording = recorded_together(own, other, pair.other, pair.ties)
    (seen,) = segments(recording, Conditioning(1000.0, 200.0, 1))
    return seen


@pytest.mark.parametrize('slack', [False, True])
def test_ties_to_recorded_points_are_those_of_the_pair(pair, motions, together, slack) -> None:
    ties, values = Partner(pair.other, pair.ties).tied(pair.robot, slack=slack), STIFFNESS
    if slack:
        pair, ties = pair.with_slack(SLACK), ties.with_shape(SLACK[:, np.newaxis])
    else:
        values = np.column_stack([STIFFNESS, np.zeros(4)]).ravel()
    inside = np.searchsorted(motions.own.t, together.t - 1e-6)
    expected = pair_torques(pair, together, motions.other.select(inside)).tau
    arm = ArmModel(pair.robot).with_effect(ties, values)
    np.testing.assert_allclose(arm.torque(together), expected, rtol=1e-4, atol=2e-2)


def test_what_cannot_be_tied_is_refused_by_name(pair, motions) -> None:
    partner = Partner(pair.other, pair.ties, 'human_legs')
    arm = ArmModel(pair.robot).with_effect(partner.tied(pair.robot, slack=False))
    with pytest.raises(ModelError, match=r'swing_shank.*human_legs.*--partner'):
        arm.torque(motions.own)  # without the partner
    with pytest.raises(ModelError, match='exo_swing_knee'):
        twice = (pair.ties[0], replace(pair.ties[0], name='again'))
        Partner(pair.other, twice).tied(pair.robot, slack=False)
    with pytest.raises(ModelError, match="'exo_stance_hip'"):
        partner.tied(pair.robot, ('exo_stance_hip',), slack=True)


def test_a_model_file_keeps_ties_and_slack(pair, together, tmp_path) -> None:
    partner = Partner(pair.other, pair.ties, 'human_legs')
    straps = partner.tied(pair.robot, ('exo_swing_hip',), slack=True).with_shape([0.002])
    arm = ArmModel(pair.robot).with_effect(straps, [4e3])
    springs = partner.tied(pair.robot, ('exo_stance_ankle', 'exo_swing_knee'), slack=False)
    arm = arm.with_effect(springs, [1e4, 5.0, 2e4, 0.0])
    save_model(tmp_path / 'model.yaml', arm, 'exoskeleton_legs')
    again = load_model(tmp_path / 'model.yaml')
    assert again.effects == arm.effects
    np.testing.assert_allclose(again.torque(together), arm.torque(together), atol=1e-9)


def test_where_the_partner_was_not_recorded_there_is_a_gap(pair, motions) -> None:
    t = motions.own.t
    kept = (t < 0.15) | (t > 0.3)
    own = Recording(joints=pair.robot.joints, t=t, q=motions.own.q, tau=motions.own.q * 0.0)
    other = Recording(joints=pair.other.joints, t=t[kept], q=motions.other.q[kept])
    both = recorded_together(own, other, pair.other, pair.ties)
    assert not np.any((both.t > 0.15) & (both.t < 0.3))
    assert both.partner is not None
    expected = motions.other.q[np.isin(t, both.t)]
    np.testing.assert_allclose(both.partner.q, expected, atol=1e-9)
