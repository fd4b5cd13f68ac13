# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names that others made needless are asked once more when those have gone."""

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search import explain, prune
from armid_ros.diagnosis.search.candidates import as_given
from armid_ros.diagnosis.search.trial import Accepted, Named
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE
import numpy as np
import pytest

from tests.diagnosis.conftest import TORQUE_NOISE
from tests.diagnosis.test_floor import cut

LIBRARY = ('viscous_friction', 'torque_offset', 'joint_spring')
VISCOUS, STIFFNESS = 0.4, 0.5


@pytest.fixture
def prune_by(bench, monkeypatch):
    """Prune what explains two effects, in an order that is told."""

    def hidden(motion, tau):
        return np.array([VISCOUS, 0.0]) * motion.dq + np.array([0.0, STIFFNESS]) * motion.q

    data = tuple(cut(bench.recordings(hidden)))
    sigma = (np.full(2, TORQUE_NOISE),) * len(data)
    evidence, settings = Evidence.over_noise(data, sigma), DiagnosisSettings(library=LIBRARY)
    question = as_given(bench.arm, data, 4, LIBRARY)
    way = explain.Search(question, evidence, settings).forward()
    assert [one.named.effect.name for one in way.taken] == ['viscous_friction', 'joint_spring']

    def pruned(*order, also=()):
        needless = iter(order)
        monkeypatch.setattr(prune.Retrial, 'needless', lambda *_: next(needless))
        step = way.taken[0].step
        more = [Named(CATALOGUE[name].on(bench.robot, ('elbow',)), (0,)) for name in also]
        taken = [*way.taken, *(Accepted(own, step, np.ones(1)) for own in more)]
        return prune.pruned(prune.Retrial(question, evidence, settings), taken)

    return pruned


@pytest.mark.parametrize('dropped', [0, 1])
def test_a_name_that_is_needed_after_all_comes_back(prune_by, dropped):
    steps, fitted = prune_by(dropped, None, None)
    names = [own.effect.name for own in fitted.named]
    values = dict(zip(names, fitted.values, strict=True))
    assert values['viscous_friction'] == pytest.approx([VISCOUS], rel=0.01)
    assert values['joint_spring'][0] == pytest.approx(STIFFNESS, rel=0.01)
    assert [step.trial.candidate.effect.name for step in steps] == names


def test_names_come_back_best_first(prune_by):
    _, fitted = prune_by(0, 0, None, None, None)
    assert [own.effect.name for own in fitted.named] == ['viscous_friction', 'joint_spring']


def test_a_name_comes_back_once(prune_by):
    _, fitted = prune_by(0, None, 1, None)
    assert [own.effect.name for own in fitted.named] == ['joint_spring']


def test_what_nothing_needs_stays_away(prune_by):
    _, fitted = prune_by(2, None, also=('torque_offset',))
    assert [own.effect.name for own in fitted.named] == ['viscous_friction', 'joint_spring']
