# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A joint that stands still is held by dry friction, or by more than that."""

from dataclasses import replace
from types import SimpleNamespace

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.next_run.steps import next_steps
from armid_ros.diagnosis.verdict.remaining_misfit import blocking_excess
from armid_ros.motion import Motion
from armid_ros.recording import Recording
from armid_ros.report.diagnosis_report import tone_of
import numpy as np
import pytest

from tests.diagnosis.conftest import diagnosed

RATE, MOVING, END = 200.0, 8.0, 12.0


def coming_to_rest(bench, held, seed=0):
    """Return recordings of an arm that stops, and whose elbow is held by a torque then [N m]."""
    rng = np.random.default_rng(seed)
    result = []
    for k, speed in enumerate((1.0, 1.5, 2.0)):
        t = np.arange(round(END * RATE)) / RATE
        fade = np.where(t < MOVING, np.sin(np.pi * t / MOVING) ** 2, 0.0)
        phase = 2.0 * np.pi * speed * (0.5 + 0.3 * k) * t
        q = 0.8 * fade[:, np.newaxis] * np.sin(phase[:, np.newaxis] * [0.37, 0.53] + [k, 2.0])
        dq = np.gradient(q, 1.0 / RATE, axis=0)
        ddq = np.gradient(dq, 1.0 / RATE, axis=0)
        motion = Motion(bench.robot.joints, t, q, dq, ddq)
        tau = bench.torque(motion) + np.outer(t > MOVING + 0.5, [0.0, held])
        noise = 0.03 * rng.normal(size=q.shape)
        angles = q + 2e-5 * rng.normal(size=q.shape)
        result.append(
            Recording(joints=bench.robot.joints, t=t, q=angles, tau=tau + noise, source=str(k))
        )
    return result


@pytest.mark.slow
@pytest.mark.parametrize(
    ('held', 'baseline'), [(0.28, False), pytest.param(-0.28, True, marks=pytest.mark.long)]
)
def test_what_friction_holds_is_no_gap(bench, held, baseline):
    before = coming_to_rest(bench, 0.0, seed=1) if baseline else []
    found = diagnosed(bench.arm, coming_to_rest(bench, held), baseline=before)
    assert found.verdict == 'consistent', found.summary


@pytest.mark.slow
@pytest.mark.parametrize(
    ('part', 'baseline'),
    [
        pytest.param('recordings', False, marks=pytest.mark.long),
        ('recordings', True),
        pytest.param('validate', True, marks=pytest.mark.long),
    ],
)
def test_more_than_friction_holds_is_said(bench, baseline, part):
    """An arm that leans on a table stands still, and no row of it tells a model anything."""
    before = coming_to_rest(bench, 0.0, seed=1) if baseline else []
    free, held = coming_to_rest(bench, 0.0), coming_to_rest(bench, 9.0, seed=2)
    after, new = (held, []) if part == 'recordings' else (free, held)
    found = diagnosed(bench.arm, after, validate=new, baseline=before)
    assert found.verdict == 'unknown', found.summary
    assert 'elbow' in found.summary and 'a brake' in found.summary
    assert found.where[0].joint == 'elbow'


def excess_of(bench, left, torque, informative):
    """Return by how much the elbow is held beyond friction, in rows of 20 ms."""
    part = SimpleNamespace(
        t=0.02 * np.arange(len(left)),
        torque=np.column_stack([np.ones(len(left)), torque]),
        informative=np.column_stack([np.ones(len(left), dtype=bool), informative]),
        at_rows=bench.motion(1.0, 6.0, 0).select(slice(len(left))),
        used=SimpleNamespace(cutoff_hz=5.0),
    )
    evidence = Evidence((part,), (np.full(2, 0.05),), (np.full(2, 0.05),))
    residual = np.column_stack([np.zeros(len(left)), left])
    return blocking_excess(bench.arm, evidence, [residual], 3.0)[1]


def test_waves_that_a_filter_makes_of_a_jerk_are_no_stop(bench):
    rows = np.arange(100)
    turning = (rows > 40) & (rows < 70)
    wave = 4.0 * np.sin(2.0 * np.pi * 5.0 * 0.02 * rows)
    lasting = np.where(turning, 4.0, 0.0)
    assert excess_of(bench, wave, np.ones(100), ~turning) == 0.0
    assert excess_of(bench, lasting, np.ones(100), ~turning) > 2.0


@pytest.mark.parametrize('baseline', [False, pytest.param(True, marks=pytest.mark.long)])
def test_a_joint_that_never_moves_is_said_not_to_be_checked(bench, baseline):
    """Nothing of it is known: not how much may hide there, and not that the model may be used."""
    rng = np.random.default_rng(0)

    def without_elbow(seed):
        for part in coming_to_rest(bench, 0.0, seed):
            q = part.q * [1.0, 0.0]
            dq = np.gradient(q, 1.0 / RATE, axis=0)
            motion = Motion(part.joints, part.t, q, dq, np.gradient(dq, 1.0 / RATE, axis=0))
            yield replace(part, q=q, tau=bench.torque(motion) + 0.03 * rng.normal(size=q.shape))

    before = coming_to_rest(bench, 0.0, seed=1) if baseline else []
    found = diagnosed(bench.arm, list(without_elbow(0)), baseline=before)
    assert found.verdict == 'consistent', found.summary
    assert found.not_checked == ('elbow',)
    *_, unchecked = found.summary.split('. ')
    assert 'Not checked' in unchecked and found.summary.count('elbow') == 1
    steps = next_steps(found)
    assert any(step.startswith('Move elbow') for step in steps)
    assert not any(step.startswith('Use') for step in steps)
    moved = replace(found, data=())
    with_doubt = replace(moved, doubt='It is poor.')
    assert [tone_of(one) for one in (found, moved, with_doubt)] == ['fair', 'good', 'fair']
    assert tone_of(replace(found, verdict='unknown')) == 'bad'
