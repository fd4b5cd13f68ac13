# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From bags and a model to what the model lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from armid_ros.arm import ArmModel, load_model
from armid_ros.cli import options
from armid_ros.cli.diagnose import partner as partner_options
from armid_ros.cli.diagnose.files import DiagnosisCase, make_extras, write_results
from armid_ros.cli.groups import FilterOptions, gathered, RobotChoice
from armid_ros.cli.origin import provenance
from armid_ros.cli.terminal import print_rows, progress, say
from armid_ros.diagnosis import Diagnosis, DiagnosisSettings, EXPERIMENT_FILE, Finding
from armid_ros.diagnosis.ties.diagnosis import diagnose_beside
from armid_ros.diagnosis.verdict.document import SCHEMA
from armid_ros.diagnosis.verdict.words import by_cause, names_and_places, share_in_words
from armid_ros.effects.tied import Partner
from armid_ros.errors import ArmidError
from armid_ros.files import json_text
from armid_ros.identification.description import kinematics_digest
from armid_ros.identification.fitting.identifiability import excludes_zero
from armid_ros.identification.identified_from import identified_from, require_as_identified
from armid_ros.identification.parameters_file import read_misfit
from armid_ros.recording import Recording, require_once
from armid_ros.report.diagnosis_report import DiagnosedRecordings, Extras
from armid_ros.report.notation import percent, probability, value_of
from armid_ros.residual import require_libraries, TABLE_FILE
from armid_ros.robots import Robot
from armid_ros.simulation.bodies import require_any_mass
import click
import numpy as np

#: Verdicts with nothing to go on with, besides that on data that cannot be diagnosed.
_OPEN = ('unknown', 'not_repeatable')
#: What a verdict that nothing is there is worth.
_NOT_SEEN = 'note: how large each effect has to be to be seen is in report.html'


@dataclass(frozen=True)
class DiagnosisData:
    """
    What is read.

    Attributes
    ----------
    bags, validate, baseline : tuple of Path
        Recordings to look at, those that are only predicted, and those from before.
    no_baseline : bool
        Whether what a model was identified from is no baseline either.
    topic : str or None
        Of the joint states.

    """

    bags: tuple[Path, ...]
    validate: tuple[Path, ...]
    baseline: tuple[Path, ...]
    no_baseline: bool
    topic: str | None

    def __post_init__(self) -> None:
        """Refuse a baseline and none."""
        if self.baseline and self.no_baseline:
            raise click.UsageError('--baseline names bags, --no-baseline asks without: give one')

    def since(self, model: Path | None) -> DiagnosisData:
        """
        Return the same with a baseline: what a model was identified from, if none is given.

        There is none where some of it is looked at: the question is then what the model lacks.

        """
        if self.baseline or self.no_baseline or model is None:
            return self
        found, asked = identified_from(model), [*self.bags, *self.validate]
        if {path.resolve() for path in found} & {path.resolve() for path in asked}:
            return self
        require_as_identified(model)
        return replace(self, baseline=found)

    def read(
        self, robot: Robot, partner: Partner | None, partner_topic: str | None
    ) -> tuple[list[Recording], list[Recording], list[Recording]]:
        """Return the three kinds of recordings, the first two with the motion of the partner."""
        recordings, held_out, before = (
            options.read(paths, robot, self.topic)
            for paths in (self.bags, self.validate, self.baseline)
        )
        require_once([*recordings, *before], held_out)
        options.tell_damage(*recordings, *held_out, *before)
        if partner is not None:
            how = options.read_settings()
            recordings, held_out = (
                partner_options.read_together(named, some, partner, partner_topic, how)
                for named, some in ((self.bags, recordings), (self.validate, held_out))
            )
        return recordings, held_out, before


@dataclass(frozen=True)
class AskedOptions:
    """
    What is known of the arm, and what is asked.

    Attributes
    ----------
    model : Path or None
        A model.yaml.
    effects : str
        Effects that are fitted anew.
    material : float
        Share of the torque below which an effect does not matter.
    everything : bool
        Whether those get into the model, too.
    residual : str or None
        How what is left without a name is learned.
    strict : bool
        Whether a verdict without a name is an error.

    """

    model: Path | None
    effects: str
    material: float
    everything: bool
    residual: str | None
    strict: bool

    def settings(self, filters: FilterOptions) -> DiagnosisSettings:
        """Return what a diagnosis takes."""
        return DiagnosisSettings(
            signals=filters.settings(), material=self.material, everything=self.everything
        )


@gathered(
    data=DiagnosisData,
    robot=RobotChoice,
    asked=AskedOptions,
    filters=FilterOptions,
    partner=partner_options.PartnerOptions,
)
def diagnose(
    data: DiagnosisData,
    robot: RobotChoice,
    out: Path,
    asked: AskedOptions,
    filters: FilterOptions,
    partner: partner_options.PartnerOptions,
    seed: int,
    as_json: bool,
) -> None:
    """Find which effect a model lacks, and add it."""
    if asked.residual is not None:
        require_libraries()
    staged = options.stage(out, SCHEMA, robot.robot_source)
    loaded = robot.load(data.bags)
    arm = ArmModel(loaded) if asked.model is None else _model_of(asked.model, loaded)
    require_any_mass(arm.robot)
    arm = options.with_effects(arm, asked.effects)
    beside = partner_options.open_partner(partner.partner, partner.ties, loaded, robot.gravity)
    settings = asked.settings(filters)
    given, data = data, data if beside is not None else data.since(asked.model)
    misfit = None if asked.model is None else read_misfit(asked.model, arm)
    if data.baseline != given.baseline:
        say(f'baseline: {", ".join(map(str, data.baseline))}, which the model was identified from')
    with progress('reading') as tick:
        recordings, held_out, before = data.read(loaded, beside, partner.partner_topic)
        result = diagnose_beside(
            arm,
            recordings,
            beside,
            validate=held_out,
            baseline=before,
            misfit=misfit,
            settings=settings,
            rng=np.random.default_rng(seed),
            progress=tick,
        )
        case = DiagnosisCase(
            arm,
            robot.robot_source,
            options.kept_source(robot.robot_source, loaded, staged.folder),
            DiagnosedRecordings(recordings, held_out, before),
            settings,
            None if data.baseline else misfit,
            provenance([*data.bags, *data.validate, *data.baseline], seed=seed),
            asked.residual is not None,
        )
        write_results(staged.folder, result, case, Extras())
        staged.keep()
        extras = make_extras(result, case, seed, tick)
        tick(1.0, 'writing')
        document = write_results(staged.folder, result, case, extras)
        staged.keep()
    if as_json:
        click.echo(json_text(document))
    else:
        show(result)
        _show_extras(out, result, extras)
    _end(result.verdict, asked.strict)


def _end(verdict: str, strict: bool) -> None:
    """End with a code of its own where a script must not go on."""
    if verdict == 'bad_data':
        click.get_current_context().exit(2)
    if strict and verdict in _OPEN:
        click.get_current_context().exit(3)


def _model_of(path: Path, robot: Robot) -> ArmModel:
    """
    Read a model of an arm.

    Raises
    ------
    ArmidError
        If the description that it was made with is still there, and is of another arm.

    """
    arm = options.model_of(path, robot)
    try:
        known = load_model(path).robot
    except ArmidError:  # it was moved, or comes from a bag
        return arm
    if known.joints == robot.joints and kinematics_digest(known) != kinematics_digest(robot):
        raise ArmidError(
            f'{path}: was made with a description whose joints are elsewhere than those of '
            f'{robot.name}; give --robot the one that it names, or identify this arm'
        )
    return arm


def show(result: Diagnosis) -> None:
    """Print the sentence first, then the values, then the small print."""
    say(f'{result.verdict.replace("_", " ").upper()}: {result.summary}')
    if result.findings:
        for group in by_cause(result.findings):
            say(f'  {names_and_places(group)}: {_share(group)}')
        rows = [row for finding in result.findings for row in _rows(finding)]
        print_rows(rows, as_json=False, right=('value, 95 %',))
    if result.minor:
        say('small print: there beyond chance, but too small or not borne out by other data')
        share = 'share of the gap' if result.findings else 'share of what is left'
        rows = [_minor(finding, share) for finding in result.minor]
        print_rows(rows, as_json=False, right=(share, 'p'))
    if result.verdict == 'consistent':
        say(_NOT_SEEN)
    for note in result.notes:
        say(f'note: {note}')


def _rows(finding: Finding) -> list[dict[str, str]]:
    """Return a row for every value whose interval excludes zero."""
    every = list(zip(finding.parameters, finding.values, finding.std, strict=True))
    values = [row for row in every if excludes_zero(row[1], row[2])] or every
    return [
        {
            'effect': '' if number else finding.name.replace('_', ' '),
            'joint': finding.place_of(name.joint) or 'whole arm',
            'parameter': name.name.replace('_', ' '),
            'value, 95 %': value_of(finding, name, value, std),
        }
        for number, (name, value, std) in enumerate(values)
    ]


def _share(group: Sequence[Finding]) -> str:
    """Say how much of the gap a cause is, once where it has several names."""
    share = share_in_words(group[0], interval=True)
    return f'{share}, together' if len(group) > 1 else share


def _minor(finding: Finding, share: str) -> dict[str, str]:
    return {
        'effect': finding.name.replace('_', ' '),
        'joints': ', '.join(finding.joints) or 'whole arm',
        share: percent(finding.share),
        'p': probability(finding.p),
    }


def _show_extras(out: Path, result: Diagnosis, extras: Extras) -> None:
    if extras.residual is not None:
        for sentence in extras.residual.sentences():
            say(sentence)
    for pair in extras.forward:
        say(pair.sentence())
    for note in extras.notes:
        say(f'note: {note}')
    files = ['diagnosis.json', 'model.yaml', 'report.html']
    if extras.residual is not None:
        files.append(TABLE_FILE)
    if extras.next_run is not None:
        files.append(EXPERIMENT_FILE)
    for step in extras.steps(result, str(out / 'model.yaml')):
        say(f'next: {step}')
    say(f'{out}: {", ".join(files)}')
