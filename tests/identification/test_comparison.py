# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
import json

from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.identification.comparison import compare, Parameters, read_parameters
import numpy as np
import pytest


def parameters(values, std, source='a'):
    names = [ParameterName(f'Izz{k + 1}', f'joint_{k + 1}', 'kg m^2') for k in range(len(values))]
    table = {name: (float(v), float(s)) for name, v, s in zip(names, values, std, strict=True)}
    return Parameters(source, 'arm', table, 5.0)


def test_a_list_of_changes_is_free_of_chance_finds_in_19_of_20_cases():
    rng = np.random.default_rng(0)
    std = rng.uniform(0.1, 1.0, 50)
    found = 0
    for _ in range(400):
        first, second = (parameters(std * rng.normal(size=50), std) for _ in range(2))
        found += bool(compare(first, second).changed)
    assert 0.02 < found / 400 < 0.085


def test_a_real_change_is_found_and_sized():
    before = parameters([1.0, 2.0, 3.0], [0.01, 0.01, 0.01])
    after = parameters([1.0, 2.2, 3.01], [0.01, 0.02, 0.01])
    (change,) = compare(before, after).changed
    assert change.parameter.joint == 'joint_2'
    assert change.deviations == pytest.approx(0.2 / np.hypot(0.01, 0.02))


def test_what_only_one_has_is_listed():
    comparison = compare(parameters([1.0], [0.1]), parameters([1.0, 2.0], [0.1, 0.1]))
    assert [name.joint for name in comparison.only_after] == ['joint_2']
    assert comparison.only_before == ()


def test_known_exactly_and_equal_is_no_change():
    assert compare(parameters([1.0], [0.0]), parameters([1.0], [0.0])).changed == ()


class TestRefusals:
    """What cannot be compared is refused by name."""

    def test_nothing_in_common(self):
        other = Parameters('b', 'arm', {ParameterName('x', '', 'm'): (0.0, 1.0)}, None)
        with pytest.raises(ModelError, match='a and b have no identified parameter in common'):
            compare(parameters([1.0], [0.1]), other)

    def test_an_empty_folder(self, tmp_path):
        with pytest.raises(ModelError, match=r'neither identification\.json nor model\.yaml'):
            read_parameters(tmp_path)

    def test_no_file(self, tmp_path):
        with pytest.raises(ModelError, match='No such file'):
            read_parameters(tmp_path / 'identification.json')

    def test_another_document(self, tmp_path):
        path = tmp_path / 'identification.json'
        path.write_text(json.dumps({'schema': 'other'}))
        with pytest.raises(ModelError, match='schema'):
            read_parameters(path)

    def test_a_broken_document(self, tmp_path):
        path = tmp_path / 'identification.json'
        path.write_text('{"schema":')
        with pytest.raises(ModelError, match='neither JSON nor YAML'):
            read_parameters(path)

    def test_a_row_without_a_name(self, tmp_path):
        path = tmp_path / 'identification.json'
        rows = [{'joint': 'a', 'value': 1, 'std': 1, 'unit': ''}]
        document = {'schema': 'armid/identification/1', 'robot': 'x', 'parameters': rows}
        path.write_text(json.dumps(document))
        with pytest.raises(ModelError, match='name'):
            read_parameters(path)
