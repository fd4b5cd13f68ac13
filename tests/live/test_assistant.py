# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The process that answers says what the same code says here, and ends with who started it."""

from __future__ import annotations

from contextlib import contextmanager
import json
import select
import time

from armid_ros.errors import IdentificationError
from armid_ros.excitation.files import read_excitation
from armid_ros.live import Answer, Assistant, DiagnosisRequest, InProcess
from armid_ros.live.assistant import Plan, Save
import pytest

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


@pytest.fixture(scope='module')
def asked(known_arm, changed):
    return DiagnosisRequest(known_arm, changed, end=20.0)


def test_a_process_of_its_own_answers_as_this_one_does(asked, tmp_path):
    here = InProcess()
    here.ask(asked)
    expected = here.poll()
    with working() as assistant:
        assistant.ask(asked)
        assert assistant.busy
        with pytest.raises(IdentificationError, match='under way'):
            assistant.ask(asked)
        answer = wait(assistant)
        assert isinstance(answer, Answer)
        assert not assistant.busy
        assert (answer.verdict, answer.named) == (expected.verdict, expected.named)
        assert answer.arm.theta.tolist() == expected.arm.theta.tolist()
        assistant.ask(Save(tmp_path))
        assert wait(assistant).success
        document = json.loads((tmp_path / 'diagnosis.json').read_text())
        assert document['verdict'] == answer.verdict


def test_nothing_can_be_written_or_planned_before_a_diagnosis(tmp_path):
    here = InProcess()
    for job in (Save(tmp_path), Plan()):
        here.ask(job)
        done = here.poll()
        assert not done.success
        assert done.text == 'nothing has been diagnosed so far'


def test_a_process_that_died_is_said_and_another_takes_its_place(tmp_path):
    with working() as assistant:
        before = assistant._process.pid
        assistant._process.kill()
        done = wait(assistant)
        assert not done.success and 'has ended' in done.text
        assert assistant.poll() is None  # it is said once
        assistant.ask(Save(tmp_path))
        assert assistant._process.pid != before
        assert wait(assistant).text == 'nothing has been diagnosed so far'


def test_a_job_that_fails_does_not_end_the_process():
    with working() as assistant:
        assistant.ask(DiagnosisRequest(None, None))
        assert 'failed: AttributeError' in wait(assistant).text
        assert assistant._process.poll() is None


def test_the_process_ends_when_nobody_can_ask_it_any_more():
    with working() as assistant:
        assistant._pipe.close()
        assert assistant._process.wait(timeout=PATIENCE) == 0


def test_a_plan_is_a_motion_that_can_be_read(known_arm, changed):
    here = InProcess()
    here.ask(DiagnosisRequest(known_arm, changed))
    if not any(f.rivals for f in here.poll().findings):
        here.ask(Plan())
        done = here.poll()
        assert done.excitation or 'no candidates are ambiguous' in done.text
        if done.excitation:
            assert read_excitation(done.excitation, 'plan').duration > 0.0
