# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What `import armid_ros` offers: late, complete, and readable."""

import json

import armid_ros as ar
from armid_ros.identification.parameters_file import read_parameters
import numpy as np
import pytest

EFFECTS = 'viscous_friction,coulomb_friction,torque_offset'


@pytest.fixture(scope='module')
def arm():
    values = ('viscous_friction:viscous_coefficient=0.1', 'coulomb_friction:coulomb_torque=0.02')
    return ar.ArmModel.of('humanoid_arm', effects=[*values, 'torque_offset'])


@pytest.fixture(scope='module')
def excitation(arm):
    return ar.design_excitation(arm, duration=12.0, starts=1, iterations=2, candidates=10)


@pytest.fixture(scope='module')
def runs(arm, excitation):
    return [ar.simulate(arm, excitation, torque_noise=0.005, rng=seed) for seed in range(2)]


@pytest.fixture(scope='module')
def model(runs):
    unknown = ar.ArmModel.of('humanoid_arm', effects=EFFECTS)
    return ar.identify(unknown, runs[0], validate=runs[1])


@pytest.fixture(scope='module')
def loaded(arm, excitation):
    values = [0.2, 0.0, 0.0, 0.01, 0.001, 0.0, 0.001, 0.0, 0.0, 0.001]
    held = arm.with_effect(ar.make_effect('payload', arm.robot), values)
    return ar.simulate(held, excitation, torque_noise=0.005, rng=5)


@pytest.fixture(scope='module')
def found(model, loaded):
    """Return the diagnosis of a load, the recordings of the model being its baseline."""
    return ar.diagnose(model, loaded)


def test_an_unknown_name_is_answered_with_the_known_ones():
    assert set(ar.__all__) <= set(dir(ar))
    with pytest.raises(AttributeError, match=r"'identfy'.*identify"):
        _ = ar.identfy


def test_an_identification_shows_itself_as_text_and_in_a_notebook(model, tmp_path):
    assert repr(model).startswith('GOOD') and 'elbow_pitch' in repr(model)
    html = model._repr_html_()
    assert html.startswith('<iframe ') and html.count('"') == 6
    assert model.report(tmp_path / 'page.html').read_text().startswith('<!')
    table = model.to_dataframe()
    assert list(table.columns) == ['name', 'joint', 'value', 'std', 'unit']
    viscous = table[table.name == 'viscous_coefficient'].value
    np.testing.assert_allclose(viscous, 0.1, atol=0.01)


def test_a_saved_identification_is_what_the_command_line_writes(model, tmp_path):
    folder = model.save(tmp_path / 'saved')
    exports = {'identified.urdf', 'identified.mjcf.xml'}
    names = {'model.yaml', 'identification.json', 'report.html'} | exports
    assert {path.name for path in folder.iterdir()} == names
    again = ar.load_model(folder / 'model.yaml')
    np.testing.assert_allclose(again.theta, model.arm.theta)


def test_recordings_and_residuals_of_a_model_are_its_baseline_from_memory_and_file(
    model, found, loaded, tmp_path
):
    written = model.save(tmp_path / 'result') / 'model.yaml'
    first, second = (ar.diagnose(arm, loaded, baseline=()) for arm in (model, written))
    assert found.names == first.names == ('payload',)
    assert found.core.baseline != first.core.baseline
    assert second.document()['effects'] == first.document()['effects']
    assert not first.core.notes


def test_a_diagnosis_and_a_comparison_find_the_load(model, found, loaded, tmp_path):
    assert 'payload' in repr(found) and '\nnext: ' in repr(found)
    assert found.to_dict() == found.document()
    assert found.to_dataframe().effect.str.contains('payload').any()
    assert (found.save(tmp_path / 'found') / 'diagnosis.json').is_file()
    assert 'damping="0.' in found.urdf()
    after = ar.identify(ar.ArmModel.of('humanoid_arm', effects=EFFECTS), loaded)
    compared = ar.compare(model, after)
    assert compared.load == pytest.approx(0.2, abs=0.01)
    assert ar.compare(model.save(tmp_path / 'before'), after).load == compared.load


def test_a_model_file_stands_for_the_identification_beside_it_that_is_its_own(model, tmp_path):
    folder = model.save(tmp_path / 'before')
    file, document = folder / 'model.yaml', folder / 'identification.json'
    assert read_parameters(file).source == str(document)
    theta = model.arm.theta.copy()
    theta[-1] += 0.1
    ar.save_model(file, model.arm.with_theta(theta), 'humanoid_arm')
    assert read_parameters(file).source == str(file)
    document.unlink()
    with pytest.raises(ar.ArmidError, match='no covariance'):
        ar.compare(file, file)


def test_what_a_simulator_lacks_is_named_without_a_model(runs, excitation):
    simulated = ar.simulate(ar.ArmModel(ar.load_robot('humanoid_arm')), excitation)
    found = ar.diagnose('humanoid_arm', runs[0], validate=runs[1], against=simulated)
    assert found.names == ('viscous_friction', 'coulomb_friction')
    found_values = found.core.findings[0]
    assert len(found_values.values) == 6 and np.allclose(found_values.values, 0.1, atol=0.02)
    with pytest.raises(ar.ArmidError, match='baseline'):
        ar.diagnose('humanoid_arm', runs[0], baseline=runs[1], against=simulated)


def test_an_inspection_and_an_excitation_show_themselves(runs, excitation, tmp_path):
    found = ar.inspect('humanoid_arm', runs[0])
    assert 'armid identify' in ' '.join(repr(found).split())
    assert found.report(tmp_path / 'page.html').is_file()
    saved = found.save(tmp_path / 'inspection')
    assert json.loads((saved / 'inspection.json').read_text())['verdict'] == found.core.verdict
    table = excitation.to_dataframe()
    names = [f'{name}_shoulder_pitch' for name in ('q', 'dq', 'ddq')]
    assert list(table.columns[:4]) == ['t', *names]
    assert table.t.iloc[-1] == pytest.approx(excitation.duration, abs=0.05)
    assert (excitation.save(tmp_path / 'plan') / 'trajectory').is_dir()
    again = ar.simulate('humanoid_arm', tmp_path / 'plan' / 'trajectory', rate=100.0)
    assert again.duration == pytest.approx(excitation.run.duration, abs=0.05)


def test_a_recording_is_read_by_robot_or_by_names_from_bags_and_tables(runs, tmp_path):
    bag, path = tmp_path / 'bag', tmp_path / 'run.csv'
    ar.write_recording(bag, runs[0])
    names = ','.join(f'q{k}' for k in range(6))
    table = np.column_stack([runs[0].t, np.degrees(runs[0].q)])
    np.savetxt(path, table, delimiter=',', header=f't,{names}', comments='')
    for robot in ('humanoid_arm', runs[0].joints):
        in_degrees = ar.read_recording(path, robot, degrees=True)
        np.testing.assert_allclose(in_degrees.q, runs[0].q, atol=1e-9)
    read = ar.read_recording(bag)
    assert read.joints == runs[0].joints
    np.testing.assert_array_equal(read.tau, runs[0].tau)
    with pytest.raises(ar.ArmidError, match='/joint_states'):
        ar.read_recording(bag, topic='/other')


def test_a_recording_of_other_joints_is_refused(runs):
    with pytest.raises(ar.ArmidError, match='two_link_elastic'):
        ar.identify('two_link_elastic', runs[0])


def test_what_lies_inside_of_results_prints_in_a_few_lines(model, runs):
    """A person looks at these, too; arrays of a recording are no answer."""
    for one in (runs[0], model.estimate, model.core, model.arm.robot, *model.predict(runs[0])):
        assert len(repr(one)) < 800
        assert len(repr(one).splitlines()) <= 11


def test_recordings_of_one_name_are_told_apart(model, runs):
    assert model.document()['validation'][0]['bag'] == 'simulation 2'
    found = ar.identify(model.description, runs[:1], validate=[runs[1], runs[1]])
    assert list(found.validation) == ['simulation 2', 'simulation 3']


def test_a_recording_a_plan_and_results_are_drawn_joint_by_joint(
    monkeypatch, excitation, runs, model, found
):
    monkeypatch.setenv('MPLBACKEND', 'agg')
    from matplotlib import pyplot as plt

    counts = {}
    for drawn in (runs[0], excitation, model, found):
        axes = drawn.plot()
        assert axes.shape == (6,)
        assert [axis.get_title(loc='left') for axis in axes] == list(model.arm.robot.joints)
        counts[type(drawn).__name__] = len(axes[0].lines)
        plt.close(axes[0].figure)
    assert list(counts.values()) == [1, 1, 2, 2]
    with pytest.raises(ar.ArmidError, match='dq'):
        ar.Recording(joints=('a',), t=[0.0, 1.0], q=np.zeros((2, 1))).plot('dq')


def test_a_recording_is_a_motion_whose_torque_an_arm_predicts(arm, runs):
    motion = runs[0].motion()
    np.testing.assert_allclose(arm.torque(motion), motion.tau, atol=0.05)
    bare = ar.Recording(joints=runs[0].joints, t=runs[0].t, q=runs[0].q).motion(cutoff=20.0)
    assert bare.tau is None and bare.ddq.shape == bare.q.shape
    with pytest.raises(ar.ArmidError, match='no section'):
        runs[0].select(slice(50)).motion()


def test_an_arm_predicts_torques_of_arrays(arm, excitation):
    motion = excitation.motion()
    whole = arm.torque(motion)
    np.testing.assert_allclose(arm.torque(motion.q, motion.dq, motion.ddq), whole)
    np.testing.assert_allclose(arm.torque(motion.q[9], motion.dq[9], motion.ddq[9]), whole[9])
    assert arm.torque(np.zeros(6)).shape == (6,)
    with pytest.raises(ar.ArmidError, match=r'\(1, 5\)'):
        arm.torque(np.zeros(5))
    late = arm.with_effect(ar.make_effect('torque_lag', arm.robot), [0.01] * 6)
    with pytest.raises(ar.ArmidError, match=r'torque_lag.*Motion'):
        late.torque(motion.q)


def test_a_value_has_the_name_of_its_effect_or_parameter(model):
    estimate = model.estimate
    value = estimate['viscous_friction', 'elbow_pitch']
    assert value == estimate['viscous_coefficient', 'elbow_pitch'] == pytest.approx(0.1, abs=0.01)
    for name, joint, known in (
        ('viscous_friction', 'elbow', 'elbow_pitch'),
        ('friction', 'elbow_pitch', 'viscous_coefficient'),
    ):
        with pytest.raises(ar.ArmidError, match=known):
            _ = estimate[name, joint]


def test_an_inspection_takes_a_recording_with_or_without_a_robot(runs, tmp_path):
    path = ar.write_recording(tmp_path / 'run', runs[0]) or tmp_path / 'run'
    given = [('humanoid_arm', path), (path,), (None, path)]
    found = [ar.inspect(*one).core.robot is None for one in given]
    assert found == [False, True, True]
    with pytest.raises(ar.ArmidError, match='two recordings'):
        ar.inspect(runs[0], runs[1])


def test_residuals_are_a_table_of_every_joint(model, found):
    table = model.residual_table()
    joints = list(model.arm.robot.joints)
    assert list(table.columns) == ['recording', 't', *joints]
    errors = table[joints].std()
    left = found.residual_table()
    assert list(left.columns) == list(table.columns)
    assert (left[joints].std() < 3.0 * errors).all()


@pytest.mark.parametrize('ask', [ar.identify, ar.diagnose])
@pytest.mark.parametrize(
    ('recordings', 'said'),
    [([], 'no recording was'), (None, "'None'.*Recording"), (3, "'3'"), ([None], "'None'")],
)
def test_no_recording_is_said(arm, ask, recordings, said):
    with pytest.raises(ar.ArmidError, match=said):
        ask(arm, recordings)


def test_a_recording_in_place_of_the_robot_is_answered_with_the_order(runs):
    with pytest.raises(ar.ArmidError, match=r'argument is a Recording.*before the recordings'):
        ar.identify(runs[0], 'my_arm.urdf')


def test_a_model_is_read_with_a_robot_in_any_form(arm, tmp_path):
    path = tmp_path / 'model.yaml'
    ar.save_model(path, arm, 'nowhere.urdf')
    for robot in (arm, arm.robot, 'humanoid_arm', arm.robot.path):
        np.testing.assert_array_equal(ar.load_model(path, robot).theta, arm.theta)
    with pytest.raises(ar.ArmidError, match=r'absent\.urdf'):
        ar.load_model(path, 'absent.urdf')


def test_a_misspelt_prior_is_answered_with_what_was_meant(runs):
    for prior in ({'viscus_friction': 'often'}, {'viscous_friction': 'ofen'}):
        with pytest.raises(ar.ArmidError, match=r"'(viscous_friction|often)'"):
            ar.diagnose('humanoid_arm', runs[0], prior=prior)
