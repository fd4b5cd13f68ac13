# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis beside another machine asks for ties to it, and is refused where nothing can."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose, DiagnosisSettings
from armid_ros.diagnosis.ties.diagnosis import diagnose_beside
from armid_ros.effects.tied import Partner
from armid_ros.errors import ModelError
from armid_ros.papers.exo.plant.leg_pair import leg_pair
from armid_ros.recording import recorded_together, Recording
import numpy as np
import pytest

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
    found = diagnose_beside(
        arm,
        together,
        partner,
        settings=DiagnosisSettings(everything=True),
        rng=np.random.default_rng(0),
    )
    assert {tie.name for finding in found.findings for tie in finding.ties} == set(TIED)


def test_recordings_from_before_do_not_hide_springs(arm, partner, together) -> None:
    before = together[:1]
    found = diagnose_beside(arm, together, partner, baseline=before, rng=np.random.default_rng(0))
    assert {tie.name for finding in found.findings for tie in finding.ties} == set(TIED)


def test_a_partner_to_which_nothing_explains_ties_is_refused(arm, partner, together) -> None:
    settings = DiagnosisSettings(partner=partner)
    with pytest.raises(ModelError, match='diagnose_beside'):
        diagnose(arm, together, settings=settings, rng=np.random.default_rng(0))


def test_without_a_partner_it_is_the_diagnosis_of_the_arm_alone(monkeypatch, arm) -> None:
    asked = {}
    monkeypatch.setattr(
        'armid_ros.diagnosis.ties.diagnosis.diagnose', lambda *_, **more: asked.update(more)
    )
    diagnose_beside(arm, [], None, rng=np.random.default_rng(0))
    assert asked['tied'] is None
    assert asked['settings'] == DiagnosisSettings()
