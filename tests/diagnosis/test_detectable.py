# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What silence is worth: the smallest size of each effect that the data would show."""

from armid_ros.diagnosis import diagnosis_document, DiagnosisSettings
from armid_ros.effects import CATALOGUE
import numpy as np
import pytest

from tests.diagnosis.conftest import diagnosed, on_elbow

#: Whatever is told from noise matters.
EVERYTHING = DiagnosisSettings(material=0.0)


@pytest.fixture(scope='module')
def sizes(bench):
    """Return the smallest sizes that show in recordings in which nothing is hidden."""
    found = diagnosed(bench.arm, bench.recordings(), settings=EVERYTHING)
    assert found.verdict == 'consistent'
    rows = diagnosis_document(found)['detectable']
    return {(row['name'], tuple(row['joints'])): row for row in rows}


@pytest.fixture(scope='module')
def rows(bench):
    """Return rows of the document of an arm that is as its model, by the usual settings."""
    found = diagnosed(bench.arm, bench.recordings())
    document = diagnosis_document(found)
    assert 'torque_offset' not in document['not_visible']
    return {(row['name'], *row['joints']): row for row in document['detectable']}


def elbow(shape):
    """Return a torque of the elbow of some size, from a motion."""
    return lambda size: lambda m, tau: on_elbow(size * shape(m))


@pytest.mark.slow
@pytest.mark.parametrize(
    ('name', 'hide'),
    [
        ('torque_offset', elbow(lambda m: np.ones(len(m)))),
        pytest.param(
            'torque_ripple', elbow(lambda m: np.sin(9.0 * m.q[:, 1])), marks=pytest.mark.long
        ),
    ],
)
def test_the_size_that_shows_is_right_within_a_factor_of_four(bench, sizes, name, hide):
    size = sizes[name, ('elbow',)]['min_detectable']
    for factor, there in ((0.25, False), (4.0, True)):
        hidden = bench.recordings(hide(factor * size), seed=5)
        found = diagnosed(bench.arm, hidden, settings=EVERYTHING)
        names = {n for f in found.findings for n in (f.name, *f.ambiguous_with)}
        assert (name in names) is there, f'{factor} times {size:.3g}: {found.summary}'


def test_of_what_data_do_not_tell_apart_no_size_is_stated(bench, sizes):
    """An asymmetry of Coulomb friction is an offset, which is fitted beside it."""
    for joint in bench.robot.joints:
        assert sizes['asymmetric_friction', (joint,)]['parameter'] == 'viscous_asymmetry'
        assert sizes['torque_offset', (joint,)]['min_detectable'] < 0.01


@pytest.mark.long
def test_a_size_that_is_small_print_is_not_said_to_show(rows, sizes):
    assert sizes['torque_gain', ('elbow',)]['min_detectable'] < 0.002
    assert rows['torque_gain', 'elbow']['min_detectable'] == pytest.approx(0.01, rel=0.1)


def test_every_effect_of_the_catalogue_is_listed(sizes):
    names = {name for name, _ in sizes}
    already = {'viscous_friction', 'coulomb_friction'}
    # temperatures were not measured
    named = {name for name, kind in CATALOGUE.items() if not (kind.learned or kind.lasting)}
    assert named - already <= names
    assert all(
        row['min_detectable'] is None or row['min_detectable'] > 0 for row in sizes.values()
    )


def test_a_size_has_the_unit_of_the_effect_whose_it_is(sizes):
    """Gravity is searched as a vector; a tilt of the base is an angle."""
    tilt = sizes['base_tilt', ()]
    assert tilt['parameter'] in ('tilt_x', 'tilt_y') and tilt['unit'] == 'rad'
    assert 0.0 < tilt['min_detectable'] < 0.1
