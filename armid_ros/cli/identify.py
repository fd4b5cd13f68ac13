# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From bags to a model with uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import time
from typing import Any

from armid_ros.arm import ArmModel, save_model
from armid_ros.arm.export import arm_mjcf, arm_urdf, Exported
from armid_ros.arm.export_check import torque_check
from armid_ros.cli import options
from armid_ros.cli.groups import FilterOptions, gathered, RobotChoice
from armid_ros.cli.origin import provenance
from armid_ros.cli.terminal import print_parameters, print_rows, progress, say, Tick
from armid_ros.diagnosis import known_misfit
from armid_ros.errors import IdentificationError
from armid_ros.files import json_text, write_file
from armid_ros.identification import (
    Fit,
    Grade,
    grade,
    Identification,
    identification_document,
    IdentificationSettings,
    PhysicalCertificate,
    PhysicalSettings,
    Verification,
    verify,
    write_document,
)
from armid_ros.identification import (
    identify as run,
)
from armid_ros.identification.estimators.names import Estimator, estimators_of
from armid_ros.identification.estimators.side_by_side import (
    compare_methods,
    ComparisonSettings,
    MethodScore,
)
from armid_ros.identification.identified_from import with_contents
from armid_ros.identification.known_payload import (
    corrected,
    drive_gains,
    DriveGains,
    payloads_of,
)
from armid_ros.identification.output import SCHEMA
from armid_ros.identification.rows.checks import check_held_out
from armid_ros.recording import Recording, require_once
from armid_ros.report import identification_report
from armid_ros.report.identification_report import Assessment
from armid_ros.report.identification_summary import headline, joint_table, summary
from armid_ros.robots import Robot
import click
import numpy as np


@dataclass(frozen=True)
class IdentificationData:
    """
    What is read.

    Attributes
    ----------
    bags, validate : tuple of Path
        Recordings to fit, and those that are only predicted.
    topic : str or None
        Of the joint states.

    """

    bags: tuple[Path, ...]
    validate: tuple[Path, ...]
    topic: str | None


@dataclass(frozen=True)
class FitOptions:
    """
    What is fitted, and how.

    Attributes
    ----------
    effects : str
        What acts beside the rigid body.
    method : str
        The estimator.
    methods : str or None
        Estimators to compare.
    quasi_static : bool
        Whether only weight and effects are fitted.
    verifies, strict : bool
        Whether the result is verified, and whether an unusable one is an error.
    payloads : tuple of str
        What is carried in which bag.
    verbose : bool
        Whether everything is printed.

    """

    effects: str
    method: Any
    methods: str | None
    quasi_static: bool
    verifies: bool
    strict: bool
    payloads: tuple[str, ...]
    verbose: bool


@dataclass(frozen=True)
class BodyOptions:
    """
    What is known of the links as bodies.

    Attributes
    ----------
    physical : bool
        Whether links have to be bodies.
    total_mass : float or None
        Of all moving links [kg].
    mass_range : float or None
        Factor by which a link is off its described mass at most.
    boxes : tuple of str
        What contains a link.

    """

    physical: bool
    total_mass: float | None
    mass_range: float | None
    boxes: tuple[str, ...]

    def settings(self, robot: Robot) -> PhysicalSettings | None:
        """Return what the fit takes."""
        known = self.total_mass is not None or self.mass_range is not None or self.boxes
        if not self.physical and known:
            raise IdentificationError('--total-mass, --mass-range and --box go with --physical')
        boxes = dict(options.box(text, robot) for text in self.boxes)
        made = PhysicalSettings(
            total_mass=self.total_mass, boxes=boxes, mass_range=self.mass_range
        )
        return made if self.physical else None


@gathered(
    robot=RobotChoice,
    data=IdentificationData,
    fit=FitOptions,
    filters=FilterOptions,
    bodies=BodyOptions,
)
def identify(
    robot: RobotChoice,
    out: Path,
    data: IdentificationData,
    fit: FitOptions,
    filters: FilterOptions,
    bodies: BodyOptions,
    seed: int,
    as_json: bool,
) -> None:
    """Fit a model with uncertainties to recordings."""
    staged = options.stage(out, SCHEMA, robot.robot_source)
    loaded = robot.load(data.bags, tell=False)
    arm = options.with_effects(ArmModel(loaded, quasi_static=fit.quasi_static), fit.effects)
    known = bodies.settings(loaded)
    settings = IdentificationSettings(fit.method, filters.settings(), known)
    compared = () if fit.methods is None else estimators_of(fit.methods)
    with progress('reading') as tick:
        work = _work(arm, data, settings, compared, fit, seed, tick)
    result = work.result
    document = identification_document(
        result, robot.robot_source, work.validation, work.verification, work.graded
    )
    if work.gains:
        document['drive_gains'] = work.gains.document()
    if work.scores:
        document['methods'] = [score.document() for score in work.scores]
    source = options.kept_source(robot.robot_source, loaded, staged.folder)
    misfit = known_misfit(result, work.recordings, work.held_out)
    save_model(staged.folder / 'model.yaml', result.arm, source, result.estimate, misfit)
    exports = _export(result.arm, staged.folder) if bodies.physical else {}
    if exports:
        document['exports'] = {
            name: {**torque_check(one, result.arm, seed), 'left_out': list(one.left_out)}
            for name, one in exports.items()
        }
    without_place = {name: one.without_place for name, one in exports.items()}
    page = identification_report(
        result,
        description=arm,
        robot=robot.robot_source,
        recordings=work.recordings,
        validation=work.validation,
        validation_recordings=work.held_out,
        assessment=Assessment(work.verification, work.graded, work.scores, without_place),
        provenance=provenance([*data.bags, *data.validate], document['settings'], seed),
    )
    write_file(staged.folder / 'report.html', page)
    document = with_contents(document)
    write_document(staged.folder / 'identification.json', document)
    staged.keep()
    if as_json:
        click.echo(json_text(document))
    else:
        _print(document, work, arm, exports, fit.verbose)
        files = ['report.html', 'model.yaml', 'identification.json', *exports]
        say(f'{out}: {", ".join(files)}')
    if fit.strict and work.graded.word == 'unusable':
        click.get_current_context().exit(3)


@dataclass(frozen=True)
class _Work:
    """What was made of the recordings."""

    recordings: Sequence[Recording]
    held_out: Sequence[Recording]
    result: Identification
    validation: dict[str, tuple[Fit, ...]]
    graded: Grade
    verification: Verification | None
    scores: Sequence[MethodScore]
    gains: DriveGains | None


def _work(
    arm: ArmModel,
    data: IdentificationData,
    settings: IdentificationSettings,
    compared: Sequence[Estimator],
    options_of_fit: FitOptions,
    seed: int,
    tick: Tick,
) -> _Work:
    """Read, identify, predict what is held out, grade, verify, and compare methods."""
    rng = np.random.default_rng(seed)
    recordings = options.read(data.bags, arm.robot, data.topic)
    held_out = options.read(data.validate, arm.robot, data.topic)
    require_once(recordings, held_out)
    check_held_out(arm.robot, held_out)
    gains = None
    if options_of_fit.payloads:
        bags, signals = [*data.bags, *data.validate], settings.signals
        read = [*recordings, *held_out]
        loaded = payloads_of(options_of_fit.payloads, bags, read, arm.robot)
        gains = drive_gains(arm, recordings, loaded, signals, rng)
        recordings = corrected(arm, recordings, loaded, gains, signals)
        held_out = corrected(arm, held_out, loaded, gains, signals)
    tick(0.0, 'identifying')
    result = run(arm, recordings, settings, rng=rng, progress=tick)
    validation = {r.source: result.predict([r]) for r in held_out}
    tick(1.0, 'grading')
    graded = grade(result, arm, recordings, validation, held_out)
    verification = None
    if options_of_fit.verifies:
        verification = verify(result, arm, recordings, held_out, rng=rng, progress=tick)
    comparison = ComparisonSettings(compared, settings.signals, seed)
    scores = compare_methods(
        arm, recordings, held_out, comparison, clock=time.process_time, progress=tick
    )
    return _Work(recordings, held_out, result, validation, graded, verification, scores, gains)


def _print(
    document: dict[str, Any],
    work: _Work,
    description: ArmModel,
    exports: dict[str, Exported],
    verbose: bool,
) -> None:
    """Print grade, a row for each joint and the next step; with verbose, everything."""
    for line in headline(work.graded, work.result, work.validation):
        say(line)
    for line in work.gains.sentences() if work.gains else ():
        say(line)
    for line in joint_table(work.result, description, work.validation):
        say(line)
    if verbose:
        _print_all(document, work, exports)
    for name, check in document.get('exports', {}).items():
        left_out = f'; without {", ".join(check["left_out"])}' if check['left_out'] else ''
        torque = check.get('not_checked') and f'torque not checked: {check["not_checked"]}'
        torque = torque or (
            f'torque in {check["program"]} differs by {check["difference"]:.1e} N m, '
            f'{check["share"]:.1e} of the largest, in {check["states"]} random states'
        )
        say(f'{name}: {torque}{left_out}')
    if 'methods' in document:
        _print_methods(document['methods'])
    recordings = [*work.recordings, *work.held_out]
    for line in summary(work.result, work.validation, recordings, work.verification):
        say(line)


def _print_all(document: dict[str, Any], work: _Work, exports: dict[str, Exported]) -> None:
    """Print every parameter, the certificate, notes, and checks."""
    result, verification = work.result, work.verification
    print_parameters(document['parameters'])
    if result.physical is not None:
        _print_certificate(result.physical)
    for note in (*result.arm.robot.notes, *result.notes):
        say(f'note: {note}')
    unseen = [u.parameter for u in result.unidentified if u.reason != 'not told from zero']
    if unseen:
        named = ', '.join(f'{p.name} of {p.joint}' if '_' in p.name else p.name for p in unseen)
        say(f'not identified: {named}')
    for name, one in exports.items():
        kinds = dict.fromkeys(line.split(':')[0] for line in one.without_place)
        if kinds:
            say(f'{name} has no place for {", ".join(kinds)}; a comment in it has the values')
    if verification is not None:
        for sentence in (*verification.sentences(), *verification.left_out):
            say(f'check: {sentence}')
    fitted = document['training']['relative_error_percent']
    say(f'torque error {fitted:.2f} % on the data it was fitted to')
    for entry in document['validation']:
        say(f'torque error {entry["relative_error_percent"]:.2f} % on {entry["bag"]}, held out')


def _export(arm: ArmModel, out: Path) -> dict[str, Exported]:
    """Write the arm for other programs; return the files by name."""
    made = {'identified.urdf': arm_urdf(arm), 'identified.mjcf.xml': arm_mjcf(arm)}
    for name, exported in made.items():
        write_file(out / name, exported.text)
    return made


def _print_certificate(certificate: PhysicalCertificate) -> None:
    rows = [
        {
            'link': link.link,
            'mass [kg]': f'{link.mass:.4g}',
            'eigenvalues of the pseudo-inertia': '  '.join(f'{v:.3g}' for v in link.eigenvalues),
            'constraint': 'active' if link.link in certificate.active else 'inactive',
        }
        for link in certificate.links
    ]
    print_rows(rows, as_json=False, right=('mass [kg]',))


def _print_methods(scores: Sequence[dict[str, Any]]) -> None:
    heads = {
        'fitted [%]': 'training_error_percent',
        'held out [%]': 'held_out_error_percent',
        'position [mrad]': 'closed_loop_position_error_milli',
        'bias [%]': 'bias_percent',
        'scatter [%]': 'scatter_percent',
        'time [s]': 'seconds',
    }
    rows = [
        {
            'method': score['method'],
            **{h: '-' if score[k] is None else f'{score[k]:.3g}' for h, k in heads.items()},
        }
        for score in scores
    ]
    print_rows(rows, as_json=False, right=tuple(heads))
    for score in scores:
        if score['note']:
            say(f'{score["method"]}: {score["note"]}')
