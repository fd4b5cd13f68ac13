# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a user knows of how often effects happen."""

from armid_ros.diagnosis import diagnose, DiagnosisSettings
from armid_ros.errors import ModelError
import numpy as np
import pytest

from tests.diagnosis.test_payload import held_by


def test_what_never_happens_is_not_named_where_something_else_explains_as_much(upright):
    """A load of an inner link has the same ten values as that link."""
    hidden = upright.recordings(held_by(upright.robot, link=1))
    named = []
    for other in ('payload', 'link_inertia'):
        settings = DiagnosisSettings(prior={other: 'never'})
        found = diagnose(upright.arm, hidden, settings=settings, rng=np.random.default_rng(0))
        (one,) = found.findings
        assert not one.rivals and f'prior knowledge given: {other} never' in found.notes
        named.append(one.name)
    assert named == ['link_inertia', 'payload']


@pytest.mark.parametrize(
    'prior', [{'paylaod': 'often'}, {'payload': 'sometimes'}, {'payload': ''}]
)
def test_an_unknown_word_is_named(prior):
    with pytest.raises(ModelError, match='prior'):
        DiagnosisSettings(prior=prior)
