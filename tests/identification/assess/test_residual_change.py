# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a model leaves of a joint: more of it than chance is a change, and so is less."""

from armid_ros.identification.assess.compare import residual_changes
from armid_ros.identification.assess.grade_limits import FREEDOM
from armid_ros.identification.parameters_file import KnownFit
import numpy as np
import pytest


def fit(rms, torque=1.0, recordings=1, **others):
    """Return a model that leaves so much of a torque of 1 N m."""
    rms = dict(zip('abcdef', rms, strict=False))
    errors = {joint: 100.0 * left / torque for joint, left in rms.items()}
    return KnownFit('good', '', rms, errors, recordings, **others)


def p_values(before, after):
    return [one.p_value for one in residual_changes(before, after)]


def test_chances_are_uniform_where_motions_alone_make_a_difference():
    rng = np.random.default_rng(0)
    left = np.sqrt(rng.chisquare(FREEDOM, size=(2, 2000)) / FREEDOM)
    found = [p_values(fit([a]), fit([b]))[0] for a, b in left.T]
    assert 0.04 < np.mean(np.array(found) < 0.05) < 0.06


def test_ten_times_as_much_is_beyond_chance_and_so_is_a_tenth():
    before, after = fit([0.01, 0.01]), fit([0.011, 0.1])
    same, more = residual_changes(before, after)
    assert same.p_value > 0.5 and more.p_value < 1e-4
    assert more.ratio == pytest.approx(10.0)
    assert p_values(after, before) == pytest.approx(p_values(before, after))


def test_more_recordings_show_smaller_changes():
    few, many = (p_values(fit([0.1], recordings=n), fit([0.2], recordings=n))[0] for n in (1, 4))
    assert few > 0.05 > 0.005 > many


def test_more_torque_leaves_more():
    before, after = fit([0.01]), fit([0.1], torque=10.0)
    assert p_values(before, after) == pytest.approx([1.0])
    assert p_values(after, before) == pytest.approx([1.0])


def test_what_filters_leave_of_torques_without_noise_is_no_change():
    assert p_values(fit([1e-9]), fit([1e-6])) == [1.0]


def test_residuals_of_other_rows_are_not_compared():
    assert residual_changes(fit([0.1]), fit([9.0], as_diagnosed=True)) == ()
    assert residual_changes(fit([0.1]), None) == ()
