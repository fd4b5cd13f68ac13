# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
import json

from armid_ros.cli import main
from armid_ros.cli.commands import COMMANDS
from armid_ros.files import result_folder
from click.testing import CliRunner
import pytest

FRICTION = ('viscous_coefficient', 'elbow', 'N m s/rad')
INERTIA = ('Izz1 + Iyy2', 'shoulder', 'kg m^2')


@pytest.fixture(autouse=True)
def command(monkeypatch):
    monkeypatch.setitem(COMMANDS, 'compare', 'compare')


def identified(folder, friction, robot='arm'):
    """Write an identification with a given friction."""
    folder.mkdir()
    rows = [
        dict(zip(('name', 'joint', 'unit'), name, strict=True)) | {'value': value, 'std': std}
        for name, value, std in ((FRICTION, friction, 0.002), (INERTIA, 0.5, 0.01))
    ]
    document = {
        'schema': 'armid/identification/1',
        'robot': robot,
        'parameters': rows,
        'training': {'relative_error_percent': 4.0},
        'validation': [],
    }
    (folder / 'identification.json').write_text(json.dumps(document))
    return folder


def armid(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def test_a_change_is_said_in_words_and_on_a_page(tmp_path):
    first, second = identified(tmp_path / 'a', 0.08), identified(tmp_path / 'b', 0.1)
    result = armid('compare', first, second, '--out', tmp_path / 'out')
    assert result.exit_code == 0, result.output
    assert '1 of 2 parameters changed beyond uncertainty, at elbow' in result.output
    assert 'of elbow rose from 0.08 to 0.1 (+25 %), by 0.0200 ± 0.0055 N m s/rad' in result.output
    page = (tmp_path / 'out' / 'report.html').read_text()
    assert 'rose from 0.08 to 0.1' in page
    assert 'Izz1 + Iyy2' in page
    assert 'http' not in page.split('<main>')[1].split('<script>')[0]


def test_what_stayed_is_said_to_have_stayed(tmp_path):
    first, second = identified(tmp_path / 'a', 0.08), identified(tmp_path / 'b', 0.081)
    result = armid('compare', first, second, '--out', tmp_path / 'out')
    assert 'None of 2 parameters changed beyond its uncertainty' in result.output


def test_json_is_for_programs(tmp_path):
    first, second = identified(tmp_path / 'a', 0.08), identified(tmp_path / 'b', 0.1)
    file = second / 'identification.json'
    result = armid('compare', first, file, '--out', tmp_path / 'out', '--json')
    document = json.loads(result.output)
    assert document['schema'] == 'armid/comparison/1'
    assert [row['changed'] for row in document['parameters']] == [True, False]
    assert document == json.loads((tmp_path / 'out' / 'comparison.json').read_text())


def test_bad_input_is_one_line_and_code_2(tmp_path):
    first = identified(tmp_path / 'a', 0.08)
    result = armid('compare', first, tmp_path / 'nothing', '--out', tmp_path / 'out')
    assert result.exit_code == 2
    assert 'nothing' in result.output
    assert len(result.output.strip().splitlines()) == 1
    assert not (tmp_path / 'out').exists()


def test_results_are_not_written_over_those_of_another_kind_unless_forced(tmp_path):
    first, second = identified(tmp_path / 'a', 0.08), identified(tmp_path / 'b', 0.1)
    before = (first / 'identification.json').read_text()
    refused = armid('compare', first, second, '--out', first)
    assert refused.exit_code == 2
    assert 'holds armid/identification/1, not armid/comparison/1' in refused.stderr
    assert '--force' in refused.stderr and len(refused.stderr.splitlines()) == 1
    assert not (first / 'report.html').exists()
    assert armid('compare', first, second, '--out', first, '--force').exit_code == 0
    assert (first / 'identification.json').read_text() == before
    assert armid('compare', first, second, '--out', tmp_path / 'c').exit_code == 0
    assert armid('compare', second, first, '--out', tmp_path / 'c').exit_code == 0


def test_an_escape_sequence_in_a_name_does_not_reach_the_terminal(tmp_path):
    first, second = identified(tmp_path / 'a', 0.08), identified(tmp_path / 'b', 0.1)
    for folder in (first, second):
        path = folder / 'identification.json'
        path.write_text(path.read_text().replace('elbow', r'elb\u001b[2Jow'))
    result = armid('compare', first, second, '--out', tmp_path / 'out')
    assert '\x1b' not in result.output and r'elb\x1b[2Jow' in result.output


def test_a_second_run_in_one_folder_is_refused(tmp_path):
    first, second = identified(tmp_path / 'a', 0.08), identified(tmp_path / 'b', 0.1)
    with result_folder(tmp_path / 'out', 'armid/comparison/1'):
        refused = armid('compare', first, second, '--out', tmp_path / 'out')
    assert refused.exit_code == 2 and 'another run is writing into it' in refused.stderr
