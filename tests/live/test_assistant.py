# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The process that answers says what the same code says here, and ends with who started it."""

from contextlib import contextmanager
import json
import select
import time

from armid_ros.errors import IdentificationError
from armid_ros.excitation.schedule import read_excitation
from armid_ros.nodes.live import Answer, Assistant, DiagnosisRequest, Worker

#: Only reached when something is broken.
PATIENCE = 240.0


@contextmanager
def working():
    assistant = Assistant()
    try:
        yield assistant
    finally:
        assistant.close()


def wait(assistant):
    deadline = time.monotonic() + PATIENCE
    while (result := assistant.poll()) is None:
        assert time.monotonic() < deadline, 'no answer'
        select.select([], [], [], 0.01)
    return result


def test_a_process_of_its_own_answers_as_this_one_does(asked, answered, tmp_path):
    _, expected = answered
    with working() as assistant:
        assistant.ask('diagnose', asked)
        assert assistant.busy
        assistant.ask('save', tmp_path)
        answer = wait(assistant)
        assert isinstance(answer, Answer)
        assert (answer.verdict, answer.named) == (expected.verdict, expected.named)
        assert answer.arm.theta.tolist() == expected.arm.theta.tolist()
        assert str(tmp_path) in wait(assistant)[0]
        assert not assistant.busy
        document = json.loads((tmp_path / 'diagnosis.json').read_text())
        assert document['verdict'] == answer.verdict


def test_the_process_survives_a_job_that_fails_is_replaced_and_ends_with_its_owner(tmp_path):
    with working() as assistant:
        assistant.ask('diagnose', DiagnosisRequest(None, None))
        assert 'AttributeError' in str(wait(assistant))
        first = assistant._process
        assert first.poll() is None
        first.kill()
        assert isinstance(wait(assistant), IdentificationError)
        assert assistant.poll() is None  # reported once
        assistant.ask('save', tmp_path)
        assert assistant._process.pid != first.pid
        assert isinstance(wait(assistant), IdentificationError)  # there is no diagnosis so far
        assistant._pipe.close()
        assert assistant._process.wait(timeout=PATIENCE) == 0


def test_nothing_can_be_written_or_planned_before_a_diagnosis(tmp_path):
    for task in (('save', tmp_path), ('plan', 0)):
        assert isinstance(Worker().run(*task), IdentificationError)


def test_a_plan_is_a_motion_that_can_be_read(answered):
    worker, _ = answered
    planned = worker.run('plan', 0)
    if isinstance(planned, IdentificationError):
        assert 'ambiguous' in str(planned)
    else:
        assert read_excitation(planned[1], 'plan').duration > 0.0
