# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a reader should know of the data is said before any physics."""

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import trajectories
from armid_ros.diagnosis.data.gate import check_data
from armid_ros.identification.rows.signals import conditioning, SignalSettings
import pytest

from tests.diagnosis.conftest import Bench, URDF


@pytest.mark.parametrize('stated', ['damping="0.3"', 'friction="0.5"'])
def test_friction_that_a_description_states_and_a_model_lacks_is_said(stated):
    joint = '<joint name="elbow" type="revolute">'
    assert joint in URDF
    bench = Bench(urdf=URDF.replace(joint, f'{joint}<dynamics {stated}/>'))
    recordings = bench.recordings()
    used = conditioning(recordings, SignalSettings())

    def notes(arm):
        return check_data(arm, recordings, used, trajectories(recordings, used))[1]

    (said,) = [note for note in notes(ArmModel(bench.robot)) if '<dynamics>' in note]
    assert 'elbow' in said
    assert 'shoulder' not in said
    assert not any('<dynamics>' in note for note in notes(bench.arm))
