# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis of an arm with another machine names the ties between them."""

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import DiagnosisSettings
from armid_ros.effects.tied import Partner
from armid_ros.papers.exo.plant.leg_pair import leg_pair
from armid_ros.recording import recorded_together, Recording
import pytest

from tests.diagnosis.conftest import diagnosed
from tests.hidden.leg_pair import Straps, walks

#: Steps that fit twice into a recording [s].
SECONDS, PERIODS = 3.0, (1.3, 1.1)
TIED = ('swing_shank', 'swing_thigh')


@pytest.fixture(scope='module')
def arm() -> ArmModel:
    return ArmModel(leg_pair().robot)


@pytest.fixture(scope='module')
def partner() -> Partner:
    pair = leg_pair()
    return Partner(pair.other, pair.ties, 'human_legs')


@pytest.fixture(scope='module')
def together(arm, partner) -> list[Recording]:
    """Record the exoskeleton tied to one leg of its wearer."""
    recordings = []
    for walk in walks(Straps(TIED, 1e4), 0, seconds=SECONDS, periods=PERIODS):
        own = Recording(joints=arm.robot.joints, t=walk.t, q=walk.exo, tau=walk.tau)
        other = Recording(joints=partner.robot.joints, t=walk.t, q=walk.human)
        recordings.append(recorded_together(own, other, partner.robot, partner.ties))
    return recordings


def test_springs_are_named_where_all_effects_are_asked_for(arm, partner, together) -> None:
    settings = DiagnosisSettings(everything=True, partner=partner)
    found = diagnosed(arm, together, settings=settings)
    assert {tie.name for finding in found.findings for tie in finding.ties} == set(TIED)
