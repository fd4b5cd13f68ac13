# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command line: what it writes, prints and refuses."""

import inspect
import json
from pathlib import Path
import re
import shlex
import subprocess
import sys

import armid_ros as ar
from armid_ros.cli import choices
from armid_ros.cli.commands import main
from armid_ros.cli.terminal import progress_line, say
from armid_ros.diagnosis.settings import HOW_OFTEN
from armid_ros.effects import CATALOGUE, USUAL_EFFECTS
from armid_ros.effects.catalogue import EXAMPLES
from armid_ros.excitation import CRITERIA, SPEED_CLASSES, TARGETS
from armid_ros.excitation.schedule import MAX_DURATION
from armid_ros.identification.fitting.least_squares import ESTIMATORS
from armid_ros.recording.columns import TIME_UNITS
from armid_ros.robots import load_robot
import click
from click.shell_completion import ShellComplete
from click.testing import CliRunner
import pytest

from .conftest import armid, ROBOT

IDENTIFY = ('identify', '{bag}', '--robot', ROBOT, '--out', 'o')
PHYSICAL = (*IDENTIFY, '--physical')
SIMULATE = ('simulate', '--robot', ROBOT, '--out', 'o')
VISCOUS = 'viscous_friction:viscous_coefficient'


@pytest.mark.parametrize('command', main.list_commands(None))
def test_every_command_explains_itself_with_an_example(command):
    assert 'Example: armid ' in armid(command, '--help').output


def test_options_of_a_project_are_taken_and_printed_where_none_is_typed(
    bags, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    project = tmp_path / 'armid.toml'
    project.write_text(f'robot = "{ROBOT}"\n[inspect]\ngravity = "moon"\n')
    taken = armid('inspect', bags[0], '--gravity', 'earth').stderr
    assert f'--robot {ROBOT}' in taken and 'moon' not in taken
    for text in ('[inspect]\ngravty = "moon"\n', 'gravty = "moon"\n'):
        project.write_text(text)
        assert 'gravity' in armid('inspect', bags[0], code=2).stderr
    project.write_text(f'robot = "{ROBOT}"\npackage = "mine=."\nclearance = 0.1\n')
    assert '--package mine=.\n' in armid('inspect', bags[0]).stderr


def test_the_robot_of_a_project_does_not_replace_that_of_an_exported_model(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'armid.toml').write_text('robot = "humanoid_arm"\n')
    ar.save_model(tmp_path / 'model.yaml', ar.ArmModel.of(ROBOT), str(ROBOT))
    armid('export', 'model.yaml', '--to', 'urdf', '--out', 'arm.urdf')
    assert ar.load_robot('arm.urdf').joints == ar.load_robot(ROBOT).joints


#: What takes long to import, and the packages of armid_ros that import it.
HEAVY = (
    *('numpy', 'scipy', 'pinocchio', 'coal', 'matplotlib', 'rich', 'rosbags', 'rclpy', 'dask'),
    *('armid_ros.arm', 'armid_ros.effects', 'armid_ros.recording', 'armid_ros.report'),
)


def test_help_and_version_import_nothing_that_computes():
    """The whole tree of commands is built, with what completion and help take from it."""
    program = f"""
import sys
from armid_ros.cli import main
import click

def build(group, context):
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        below = click.Context(command, info_name=name, parent=context)
        command.get_help(below)
        if isinstance(command, click.Group):
            build(command, below)

for arguments in (['--version'], ['--help'], ['identify', '--help']):
    main(arguments, standalone_mode=False)
build(main, click.Context(main, info_name='armid'))
sys.exit(', '.join(sys.modules.keys() & set({HEAVY!r})) or 0)
"""
    result = subprocess.run([sys.executable, '-c', program], capture_output=True, check=False)
    assert result.returncode == 0, result.stderr.decode()


@pytest.mark.parametrize(
    ('shown', 'offered'),
    [
        (choices.USUAL_EFFECTS, USUAL_EFFECTS),
        (choices.EFFECT_EXAMPLES, EXAMPLES),
        (choices.HOW_OFTEN, tuple(HOW_OFTEN)),
        (choices.ESTIMATORS, ESTIMATORS),
        (choices.TIME_UNITS, tuple(TIME_UNITS)),
        (choices.MAX_DURATION, MAX_DURATION),
        (choices.SPEED_CLASSES, tuple(SPEED_CLASSES)),
        (choices.CRITERIA, CRITERIA),
        (choices.TARGETS, TARGETS),
    ],
)
def test_help_offers_what_the_packages_have(shown, offered):
    assert shown == offered


def test_robots_and_effects_are_listed_for_people_and_programs():
    assert ROBOT in armid('robots').output
    listed = json.loads(armid('effects', '--json').output)
    assert [row['name'] for row in listed] == list(CATALOGUE)
    text = armid('effects').output
    for effect in CATALOGUE.values():
        assert all(one.name in text for one in (*effect.quantities, *effect.shapes))
    (one,) = json.loads(armid('effects', 'payload', '--json').output)
    assert one['name'] == 'payload'
    assert "'payload'" in armid('effects', 'paylod', code=2).stderr


def test_the_smallest_inertia_of_an_impossible_payload_is_possible(tmp_path):
    asked = (*SIMULATE, '--trajectory', tmp_path / 'none.yaml', '--effect')
    payload = 'payload:payload_m=0.4,payload_mx=0.05,payload_mz=0.12'
    warned = armid(*asked, payload, code=2).output
    least = re.search(r'point mass: (\S+)', warned)[1]
    assert 'no body within reach' not in armid(*asked, f'{payload},{least}', code=2).output


@pytest.mark.parametrize(
    ('kind', 'option', 'value'), [('fourier', '--share', 0.5), ('steps', '--starts', 3)]
)
def test_an_option_of_another_kind_of_excitation_is_refused(kind, option, value, tmp_path):
    asked = ('excite', '--robot', ROBOT, '--kind', kind, option, value, '--out', tmp_path / 'o')
    said = armid(*asked, code=2).stderr
    assert option in said and kind in said


#: A line of progress, every ten seconds off a terminal.
PROGRESS = re.compile(r'.*: \d+ %, \d+ s(, about .*)?')


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (('identify', 'no.mcap', '--robot', ROBOT, '--out', 'o'), 'no.mcap'),
        (('identify', 'no.mcap', '--robot', 'robbie', '--out', 'o'), 'humanoid_arm'),
        ((*IDENTIFY, '--topic', '/x'), '/joint_states'),
        ((*PHYSICAL, '--box', 'elbow_pitch=0:1'), 'JOINT=X,Y,Z:X,Y,Z'),
        ((*PHYSICAL[:-1], '--total-mass', 1), '--physical'),
        ((*SIMULATE, '--effect', f'{VISCOUS}=-1'), '-1'),
        ((*SIMULATE, '--effect', 'viscous_fricton'), "friction'?"),
        ((*SIMULATE, '--effect', 'viscous_friction'), VISCOUS),
        ((*SIMULATE, '--model', 'none.yaml'), 'none.yaml'),
        (('simulate', '--robot', ROBOT, '--out', '{bag}'), '{bag}'),
        (('recover', 'no.mcap', '--out', 'o'), 'no.mcap'),
        (('excite', '--robot', ROBOT, '--focus', 'stiction', '--out', 'o'), 'viscous_friction'),
        (('excite', '--robot', ROBOT, '--rival', 'payload', '--out', 'o'), "criterion 'T'"),
        (('excite', '--robot', ROBOT, '--start', '1,2', '--out', 'o'), 'wrist_pitch'),
    ],
)
def test_bad_input_is_one_line_with_the_answer(arguments, message, bags, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = armid(*(str(a).format(bag=bags[0]) for a in arguments), code=2)
    lines = [line for line in result.stderr.splitlines() if not PROGRESS.fullmatch(line)]
    assert len(lines) == 1
    assert lines[0].startswith('armid: ')
    assert message.format(bag=bags[0]) in lines[0]
    assert not (tmp_path / 'o').exists()


def test_a_joint_of_a_bag_with_another_name_is_read_as_the_error_says(bags, tmp_path):
    text = Path(load_robot(ROBOT).path).read_text(encoding='utf-8')
    other = tmp_path / 'other.urdf'
    other.write_text(text.replace('"elbow_pitch"', '"ellbow_pitch"'), encoding='utf-8')
    asked = ('inspect', bags[0], '--robot', other)
    (rule,) = re.findall(r'--rename ([a-z_]+:[a-z_]+)', armid(*asked, code=2).stderr)
    armid(*asked, '--rename', rule)


FILLING = {
    'identify': ('identify', '{bag}', '--robot', ROBOT),
    'diagnose': ('diagnose', '{bag}', '--robot', ROBOT),
    'compare': ('compare', 'a', 'b'),
    'excite': ('excite', '--robot', ROBOT),
    'inspect': ('inspect', '{bag}'),
}


@pytest.mark.parametrize('command', FILLING)
def test_no_command_replaces_a_page_or_adds_to_notes_of_somebody(command, bags, tmp_path):
    arguments = [one.format(bag=bags[0]) for one in FILLING[command]]
    page = 'inspection.html' if command == 'inspect' else 'report.html'
    for name in (page, 'notes.txt'):
        folder = tmp_path / name
        folder.mkdir()
        (folder / name).write_text('precious')
        said = armid(*arguments, '--out', folder, code=2).stderr
        assert str(folder) in said and name in said and '--force' in said
        assert [path.read_text() for path in folder.iterdir()] == ['precious']


@pytest.mark.parametrize('command', FILLING)
def test_an_empty_out_does_not_fill_the_current_folder(command, bags, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = [one.format(bag=bags[0]) for one in FILLING[command]]
    armid(*arguments, '--out', '', code=2)
    assert not list(tmp_path.iterdir())


def test_passwords_are_in_no_page(tmp_path, monkeypatch):
    described = load_robot(ROBOT).urdf.replace('<robot ', '<robot xmlns:xacro="x" ', 1)
    described = described.replace('<link', '<xacro:arg name="password" default="a"/><link', 1)
    path = tmp_path / 'arm.xacro'
    path.write_text(described)
    asked = 'check', f'{path} password:=hunter2', '--out', str(tmp_path / 'out')
    monkeypatch.setattr('sys.argv', ['armid', *asked])  # which a page repeats
    armid(*asked)
    page = (tmp_path / 'out' / 'report.html').read_text()
    assert 'hunter2' not in page and 'password' in page


def commands(group, path=()):
    """Yield all commands with their names, and those of the groups in it."""
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            yield from commands(command, (*path, name))
        else:
            yield ' '.join((*path, name)), command


COMMANDS = dict(commands(main))


@pytest.mark.parametrize('name', COMMANDS)
def test_a_command_takes_its_options_and_nothing_else(name):
    command = COMMANDS[name]
    parameters = inspect.signature(command.callback).parameters.values()
    taken = {p.name for p in parameters if p.kind is not p.VAR_KEYWORD}
    options = {parameter.name for parameter in command.params if parameter.expose_value}
    assert taken <= options
    if len(taken) == len(parameters):
        assert taken == options


def test_a_misspelt_command_is_corrected():
    result = CliRunner().invoke(main, ['identfy'])
    assert result.exit_code == 2 and "'identify'" in result.output


def completed(*words):
    """Return what completes the last word."""
    shell = ShellComplete(main, {}, 'armid', '_ARMID_COMPLETE')
    return [item.value for item in shell.get_completions(list(words[:-1]), words[-1])]


def test_commands_and_options_are_completed():
    assert completed('id') == ['identify']
    assert {'robots', 'recover'} <= set(completed('r'))
    assert completed('identify', '--effects') == ['--effects']
    assert '--version' in completed('--v')


@pytest.mark.parametrize(
    ('words', 'found'),
    [
        (['simulate', '--effect', 'stri'], ['stribeck_friction']),
        (['excite', '--effect', 'stri'], ['stribeck_friction']),
        (['demo', '--hide', 'stri'], ['stribeck_friction']),
        (['diagnose', '--prior', 'stri'], ['stribeck_friction']),
        (['diagnose', '--prior', 'stribeck_friction=o'], ['stribeck_friction=often']),
        (['excite', '--speed', 'm'], ['medium']),
        (['identify', '--gravity', ''], ['earth', 'moon']),
    ],
)
def test_values_of_an_option_are_completed(words, found):
    assert completed(*words) == found


@pytest.mark.parametrize(
    ('share', 'numbers'),
    [(0.25, (25, 10, 30)), (0.5, (50, 10, 10)), (0.0, (0, 10)), (1.0, (100, 10))],
)
def test_a_line_of_progress_has_share_time_and_time_to_go(share, numbers):
    line = progress_line('identifying', share, 10.0)
    assert line.startswith('identifying: ')
    assert tuple(map(int, re.findall(r'\d+', line))) == numbers


@pytest.mark.parametrize(
    ('terminal', 'shown'), [(True, '\x1b[32mfit \\x1b[31m\x1b[0m\n'), (False, 'fit \\x1b[31m\n')]
)
def test_a_colour_is_for_terminals_and_escapes_of_a_text_are_shown(terminal, shown):
    command = click.Command('excite', callback=lambda: say('fit \x1b[31m', 'green'))
    assert CliRunner().invoke(command, color=terminal).output == shown


FAST = ('--no-physical', '--no-verify')
QUICK = ('--duration', 6, '--starts', 1, '--iterations', 1)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('results')


@pytest.mark.parametrize(
    ('command', 'then', 'words'),
    [
        (('check', ROBOT), 'excite', (ROBOT,)),
        (
            ('check', ROBOT, 'BAG', '--topic', 'joint_states'),
            'identify',
            ('--topic', 'joint_states'),
        ),
        (('check', ROBOT, 'BAG', '--gravity', 'moon'), 'inspect', ('BAG', '--gravity', 'moon')),
        (('inspect', 'BAG', '--robot', '-'), 'identify', ('BAG', '-')),
        (('excite', '--robot', ROBOT, *QUICK, '--out', 'plan'), 'simulate', (ROBOT,)),
        (('identify', 'BAG', '--robot', ROBOT, *FAST, '--out', 'a'), 'excite', (ROBOT,)),
        (('identify', 'HELD', '--robot', ROBOT, *FAST, '--out', 'b'), 'excite', (ROBOT,)),
        (('compare', 'a', 'b', '--out', 'c'), 'identify', ('BAG', 'HELD', ROBOT)),
        (('diagnose', 'BAG', '--robot', ROBOT, '--out', 'd'), 'simulate', (ROBOT, '--model')),
    ],
)
def test_the_last_line_is_a_command(bags, folder, command, then, words):
    paths = {name: str(folder / name) for name in ('plan', 'a', 'b', 'c', 'd')}
    paths |= {'BAG': str(bags[0]), 'HELD': str(bags[1])}
    done = armid(*(paths.get(word, word) for word in command)).stdout.splitlines()
    program, name, *arguments = shlex.split(done[-1].removeprefix('next: '))
    assert (program, name) == ('armid', then)
    main.get_command(None, name).make_context(name, list(arguments))
    assert {paths.get(word, word) for word in words} <= set(arguments)
    for page in (folder / name / 'report.html' for name in ('plan', 'c') if name in command):
        assert done[-1].removeprefix('next: ') in re.sub('<[^>]+>', '', page.read_text())


def test_a_check_takes_the_robot_of_the_project(bags, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    armid('check', code=2)
    assert (
        armid('check', bags[0], '--robot', ROBOT).stdout == armid('check', ROBOT, bags[0]).stdout
    )
    (tmp_path / 'armid.toml').write_text(f'robot = "{ROBOT}"\n')
    assert ROBOT in armid('check', bags[0]).stdout.splitlines()[-1]
    armid('check', 'no.urdf', code=2)
    assert '- is used' in armid('check', '-', bags[0]).stderr
