# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What armid compare prints, writes and refuses; the numbers are of identification/assess."""

import json

import pytest

from .conftest import armid

FRICTION = ('viscous_coefficient', 'elbow', 'N m s/rad')
INERTIA = ('Izz1 + Iyy2', 'shoulder', 'kg m^2')
JOINTS = ('shoulder', 'elbow')


def rows_of(values):
    """Return rows of parameters; values of name, joint and unit to value and deviation."""
    return [
        dict(zip(('name', 'joint', 'unit'), name, strict=True)) | {'value': value, 'std': std}
        for name, (value, std) in values.items()
    ]


def write(folder, **document):
    """Write an identification of no commands, of independent parameters."""
    folder.mkdir(exist_ok=True)
    std = [row['std'] for row in document['parameters']]
    rows = [[0.0] * k + [one**2] for k, one in enumerate(std)]
    schema = {'schema': 'armid/identification/1', 'validation': [], 'covariance': rows}
    (folder / 'identification.json').write_text(json.dumps(schema | document))
    return folder


def identified(folder, friction, errors=(4.0, 4.0), inertia=0.5, **others):
    """Write an identification with a given friction, and errors of shoulder and elbow [%]."""
    document = {
        'robot': 'arm',
        'parameters': rows_of({FRICTION: (friction, 0.002), INERTIA: (inertia, 0.01)}),
        'training': {
            'bags': [folder.name],
            'relative_error_percent': max(errors),
            'joint_relative_error_percent': dict(zip(JOINTS, errors, strict=True)),
            'rms': dict(zip(JOINTS, (0.01 * error for error in errors), strict=True)),
        },
    }
    return write(folder, **(document | others))


def unusable(folder, friction):
    """Write an identification that describes no arm."""
    reasons = ['Halves of the data predict each other to 86.7 % in elbow.']
    return identified(folder, friction, errors=(4.0, 86.0), grade='unusable', reasons=reasons)


@pytest.fixture
def compared(tmp_path):
    """Return a function that compares two results: what it prints, its page and its document."""

    def compare(first, second, *more, code=0):
        out = tmp_path / 'out'
        text = armid('compare', first, second, *more, '--out', out, code=code).output
        page = (out / 'report.html').read_text()
        return ' '.join(text.split()), page, json.loads((out / 'comparison.json').read_text())

    return compare


def test_a_change_is_printed_with_its_interval_and_shown(tmp_path, compared):
    first, second = (
        identified(tmp_path / name, friction, robot='/a/long path/arm.urdf')
        for name, friction in (('a', 0.08), ('b', 0.1))
    )
    text, page, _ = compared(first, second)
    for fact in ('1 of 2', 'elbow', '0.0200 ± 0.0055', '+25 %'):
        assert fact in text
    assert '+25 %' in page and INERTIA[0] in page
    assert '/a/long' not in page[: page.index('</h1>')]
    assert 'http' not in page.split('<main>')[1].split('<script>')[0]


def test_a_model_that_describes_no_arm_is_said_first_and_nothing_is_unchanged(tmp_path, compared):
    text, page, document = compared(
        identified(tmp_path / 'a', 0.08), second := unusable(tmp_path / 'b', 0.081)
    )
    source = str(second / 'identification.json')
    assert text.startswith(f'UNUSABLE: {source}')
    assert 'elbow' in text and '86.7 %' in text
    assert '>unusable<' in page and 'unchanged' not in page
    assert [one['source'] for one in document['unusable']] == [source]


def test_a_model_that_describes_no_arm_ends_a_strict_run(tmp_path, compared):
    first, second = identified(tmp_path / 'a', 0.08), unusable(tmp_path / 'b', 0.0805)
    third = identified(tmp_path / 'c', 0.081)
    for pair, code in (((first, second), 3), ((second, first), 3), ((first, third), 0)):
        compared(*pair, '--strict', code=code)
