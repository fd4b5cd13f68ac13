# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a user knows of how often effects happen."""

from armid_ros.diagnosis import diagnose, DiagnosisSettings
from armid_ros.errors import ModelError
import numpy as np
import pytest

from tests.diagnosis.test_payload import held_by


@pytest.mark.parametrize(
    ('never', 'named'),
    [
        ('payload', 'link_inertia'),
        pytest.param('link_inertia', 'payload', marks=pytest.mark.long),
    ],
)
def test_what_never_happens_is_not_named_where_something_else_explains_as_much(
    upright, never, named
):
    """A load of an inner link has the same ten values as that link."""
    hidden = upright.recordings(held_by(upright.robot, link=1))
    settings = DiagnosisSettings(prior={never: 'never'})
    found = diagnose(upright.arm, hidden, settings=settings, rng=np.random.default_rng(0))
    (one,) = found.findings
    assert one.name == named and not one.rivals
    assert any(never in note and 'never' in note for note in found.notes)


@pytest.mark.parametrize(
    'prior', [{'paylaod': 'often'}, {'payload': 'sometimes'}, {'payload': ''}]
)
def test_an_unknown_word_is_named(prior):
    with pytest.raises(ModelError, match='prior'):
        DiagnosisSettings(prior=prior)
