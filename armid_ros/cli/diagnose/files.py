# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What a diagnosis leaves in its folder: diagnosis.json, model.yaml and report.html.

They are written as soon as the diagnosis is done, and again with what was made of it: a next run,
or a simulation. Whatever happens to those, the results are there.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from armid_ros.arm import ArmModel, Misfit, save_model
from armid_ros.diagnosis import (
    Diagnosis,
    diagnosis_document,
    DiagnosisSettings,
    EXPERIMENT_FILE,
    next_run,
)
from armid_ros.excitation import save_excitation
from armid_ros.files import json_text, write_file
from armid_ros.identification.assess.verification import ForwardValidation, simulate_held_out
from armid_ros.identification.rows.signals import conditioning
from armid_ros.report.diagnosis_report import DiagnosedRecordings, diagnosis_report, Extras
from armid_ros.report.provenance import Provenance
from armid_ros.residual import (
    learn_residual,
    lookup_table,
    TABLE_FILE,
    WORTH_A_MAP,
)
import numpy as np

Tick = Callable[[float, str], None]
_Made = TypeVar('_Made')


@dataclass(frozen=True)
class DiagnosisCase:
    """
    What was diagnosed.

    Attributes
    ----------
    arm : ArmModel
        The model as given.
    robot, source : str
        What the robot is called, and how model.yaml refers to it.
    data : DiagnosedRecordings
        Its recordings.
    settings : DiagnosisSettings
        What was asked.
    misfit : Misfit or None
        What the model left when it was identified.
    provenance : Provenance
        Files, versions, settings, seed.
    learns : bool
        Whether what is left without a name is to be learned.

    """

    arm: ArmModel
    robot: str
    source: str
    data: DiagnosedRecordings
    settings: DiagnosisSettings = field(default_factory=DiagnosisSettings)
    misfit: Misfit | None = None
    provenance: Provenance = field(default_factory=Provenance)
    learns: bool = False


def write_results(
    out: Path, result: Diagnosis, case: DiagnosisCase, extras: Extras
) -> dict[str, Any]:
    """Fill a folder, numbers before pictures; return what diagnosis.json holds."""
    out.mkdir(parents=True, exist_ok=True)
    learned = extras.residual
    arm = result.arm if learned is None else learned.arm
    save_model(out / 'model.yaml', arm, case.source, result.estimate, case.misfit)
    document = diagnosis_document(result)
    document['residual'] = None if learned is None else learned.document(TABLE_FILE)
    document['forward'] = [pair.document() for pair in extras.forward]
    document['next_run'] = None if extras.next_run is None else extras.next_run.document()
    write_file(out / 'diagnosis.json', json_text(document, indent=1))
    if learned is not None:
        write_file(out / TABLE_FILE, lookup_table(learned))
    if extras.next_run is not None:
        save_excitation(extras.next_run.excitation, out / EXPERIMENT_FILE)
    page = diagnosis_report(
        result,
        case.data,
        robot=case.robot,
        settings=case.settings,
        extras=extras,
        patch=(out / 'model.yaml').read_text(encoding='utf-8'),
        provenance=case.provenance,
    )
    write_file(out / 'report.html', page)
    return document


def make_extras(result: Diagnosis, case: DiagnosisCase, seed: int, tick: Tick) -> Extras:
    """Simulate the held-out recordings and plan a next run, as far as that can be done."""
    extras = Extras()
    if case.learns:
        tick(1.0, 'learning the residual')
        extras = _learned(result, seed)
    arm = result.arm if extras.residual is None else extras.residual.arm
    if case.data.held_out and result.gap is not None:
        found, why = _tried('simulation', lambda: _simulated(arm, case, tick))
        simulated, left_out = found or ((), ())
        extras = replace(extras, forward=simulated, notes=(*extras.notes, *left_out, *why))
    tick(1.0, 'next run')
    run, why = _tried('next run', lambda: next_run(result, np.random.default_rng(seed)))
    return replace(extras, next_run=run, no_run='; '.join(why))


def _learned(result: Diagnosis, seed: int) -> Extras:
    """Learn what has no name, or say why there is nothing to learn."""
    if result.verdict not in WORTH_A_MAP:
        said = result.verdict.replace('_', ' ')
        return Extras(notes=(f'nothing is learned where the verdict is {said}',))
    found, why = _tried('map', lambda: learn_residual(result, np.random.default_rng(seed)))
    if why:
        return Extras(notes=why)
    if found is None:
        return Extras(
            notes=('nothing was learned: the residual does not depend on the state of any joint',)
        )
    return Extras(residual=found)


def _simulated(
    arm: ArmModel, case: DiagnosisCase, tick: Tick
) -> tuple[tuple[ForwardValidation, ...], tuple[str, ...]]:
    used = conditioning(list(case.data.recordings), case.settings.signals)
    return simulate_held_out(
        case.arm, arm, used, case.data.held_out, progress=lambda _, what: tick(1.0, what)
    )


def _tried(what: str, make: Callable[[], _Made]) -> tuple[_Made | None, tuple[str, ...]]:
    """Return what was made, or None and why there is none."""
    try:
        return make(), ()
    except Exception as error:  # whatever it is, the diagnosis itself stands
        return None, (f'there is no {what}: {error or type(error).__name__}',)
