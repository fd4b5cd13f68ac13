# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Causes that act for a part of the time: what, and in which seconds."""

from armid_ros.diagnosis import diagnosis_document
from armid_ros.identification import identify
import numpy as np
import pytest

from tests.diagnosis.conftest import diagnosed
from tests.diagnosis.test_payload import held_by, MASS

#: Seconds in which the payload is held, and by how much they may be wrong.
START, STOP, WITHIN = 2.5, 6.5, 1.0


@pytest.fixture(scope='module')
def two_days(upright):
    """Return a model, what it was identified from, and a day with a payload for some seconds."""
    before, body = upright.recordings(seed=1), held_by(upright.robot)

    def held(motion, tau):
        inside = (motion.t > START) & (motion.t < STOP)
        return body(motion, tau) * inside[:, np.newaxis]

    model = identify(upright.arm, before, rng=np.random.default_rng(0)).arm
    return model, before, upright.recordings(held, seed=2), upright.recordings(held, seed=3)


@pytest.mark.slow
def test_a_payload_that_is_picked_up_and_put_down_is_named_with_its_seconds(two_days):
    model, _, after, new = two_days
    found = diagnosed(model, after, validate=new)
    assert any('held-out' in note for note in found.notes)
    assert [one.name for one in found.findings] == ['payload'], found.summary
    assert found.findings[0].values[0] == pytest.approx(MASS, rel=0.1)
    spans = diagnosis_document(found)['spans']
    assert [one['recording'] for one in spans] == [one.source for one in after]
    for one in spans:
        assert one['start'] == pytest.approx(START, abs=WITHIN)
        assert one['stop'] == pytest.approx(STOP, abs=WITHIN)


@pytest.mark.long
def test_a_cause_that_acts_throughout_has_no_seconds(two_days, upright):
    model, before, *_ = two_days
    after = upright.recordings(held_by(upright.robot), seed=3)
    found = diagnosed(model, after, baseline=before)
    assert found.findings[0].name == 'payload' and not found.spans
