# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Ways in which a search for effects fools itself, each reproduced beside what the diagnosis does.

The data and the library are the same for both; what differs is the one step that is wrong.

"""

from dataclasses import dataclass, replace

from armid_ros.diagnosis import DiagnosisSettings
from armid_ros.diagnosis.data.evidence import Evidence, noise_floor
from armid_ros.diagnosis.data.rows import Rows
from armid_ros.diagnosis.search.candidates import Causes
from armid_ros.diagnosis.search.hyperparameters import Hyperparameters
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.odds import CauseInformation
from armid_ros.effects import Action, CATALOGUE, Effect, Quantity
import numpy as np
import pytest
from scipy import stats

from benchmarks.bic_selection import bic_selection
from tests.diagnosis.conftest import diagnosed, drag, TORQUE_NOISE
from tests.diagnosis.test_floor import cut

SETTINGS = DiagnosisSettings()


def shaken(recordings, size, seed):
    """Return recordings with noisier encoders."""
    rng = np.random.default_rng(seed)
    return [replace(r, q=r.q + size * rng.normal(size=r.q.shape)) for r in recordings]


def significant(arm, data, sigma, names):
    """Return the most significant of some effects by chi squared, if it is at 5 % of them all."""
    nuisance = Nuisance.of(
        Rows.over_noise(Evidence.over_noise(data, sigma)), arm, np.random.default_rng(0)
    )
    posterior = nuisance.posterior(Hyperparameters(1.0, 0.0, 0.0, 1.0, 1.0))
    kinds = tuple(CATALOGUE[name] for name in names)
    causes = Causes(kinds, nuisance, False, frozenset()).causes(nuisance, posterior)
    p = {}
    for cause in causes:
        known = CauseInformation.of([cause], nuisance, posterior, pooled=True)
        matrix, vector = known.matrix[0], known.vector[0]
        gain = float(vector @ np.linalg.lstsq(matrix, vector, rcond=1e-6)[0])
        name = cause.effect.name
        p[name] = min(p.get(name, 1.0), float(stats.chi2.sf(gain, known.size)))
    best = min(p, key=p.get)
    return best if p[best] < 0.05 / len(causes) else None


FRICTION = (
    'stribeck_friction',
    'asymmetric_friction',
    'quadratic_friction',
    'load_dependent_friction',
    'torque_offset',
    'rotor_inertia',
    'torque_gain',
)


def test_noise_of_the_torque_sensor_alone_makes_a_false_stribeck_friction(bench):
    by_sensor, by_floor = [], []
    for seed in range(1, 7):
        data = cut(shaken(bench.recordings(seed=seed), 3e-4, seed))
        everywhere = [replace(part, unsure=np.zeros_like(part.unsure)) for part in data]
        sensor = [np.full(2, TORQUE_NOISE * np.linalg.norm(part.used.taps)) for part in data]
        floor = [noise_floor(part, bench.arm).sigma for part in data]
        assert np.all(np.mean(floor, axis=0) > np.mean(sensor, axis=0))
        by_sensor.append(significant(bench.arm, everywhere, sensor, FRICTION))
        by_floor.append(significant(bench.arm, data, floor, FRICTION))
    assert by_sensor.count('stribeck_friction') >= 5
    assert by_floor.count(None) >= 5


@pytest.mark.slow
def test_information_criteria_over_pooled_rows_invent_effects(bench):
    invented, named = [], []
    for seed in range(1, 3):
        recordings = shaken(bench.recordings(seed=seed), 2e-4, seed)
        rng = np.random.default_rng(0)
        invented.append(len(bic_selection(bench.arm, recordings, SETTINGS, rng)))
        named.append(len(diagnosed(bench.arm, recordings).findings))
    assert np.mean(np.array(invented) > 0) >= 0.5
    assert named == [0] * len(invented)


def test_what_most_recordings_cannot_show_is_found_in_the_two_that_can(bench):
    slow = [bench.recordings(drag(0.003), seed=seed)[0] for seed in range(4)]
    fast = [bench.recordings(drag(0.003), seed=seed)[2] for seed in range(2)]
    found = diagnosed(bench.arm, [*slow, *fast], settings=DiagnosisSettings(material=0.0))
    (finding,) = found.findings
    assert (finding.name, finding.joints) == ('quadratic_friction', ('elbow',))


def test_what_is_in_one_recording_only_is_no_offset(bench):
    recordings = bench.recordings()
    recordings[1] = replace(recordings[1], tau=np.add(recordings[1].tau, [0.0, 0.3]))
    assert 'torque_offset' not in {f.name for f in diagnosed(bench.arm, recordings).findings}


@pytest.mark.slow
def test_a_surrogate_for_a_name_that_is_not_in_the_library_is_provisional(bench):
    library = tuple(name for name in CATALOGUE if name != 'quadratic_friction')
    found = diagnosed(
        bench.arm, bench.recordings(drag(0.1)), settings=DiagnosisSettings(library=library)
    )
    assert found.verdict in ('unknown', 'partial')
    whole = diagnosed(bench.arm, bench.recordings(drag(0.1)))
    assert (whole.verdict, whole.findings[0].name) == ('named', 'quadratic_friction')


@dataclass(frozen=True)
class MeasuredTorque(Effect):
    """A share of the measured torque: with the rigid body it makes any residual."""

    name = 'measured_torque'
    summary = 'a share of what is to be explained'
    quantities = (Quantity('share', ''),)

    def columns(self, motion, arm):
        """Return the measured torque minus that of the arm: the residual itself."""
        columns = np.zeros((len(motion), motion.n_joints, len(self.joints)))
        left = motion.tau - arm.torque(motion)
        for position, joint in enumerate(self.indices(motion.joints)):
            columns[:, joint, position] = left[:, joint]
        return columns

    def action(self, values, arm):
        """Act in no way: there is nothing physical in it."""
        return Action()


@pytest.mark.parametrize('hide', [None, drag(0.1)])
def test_columns_made_of_the_measured_torque_explain_nothing(bench, hide):
    found = diagnosed(
        bench.arm, bench.recordings(hide), settings=DiagnosisSettings(own=(MeasuredTorque,))
    )
    assert 'measured_torque' not in {f.name for f in found.findings}
