# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What was on a worker that another bag ended is begun again, and not given up with it."""

from armid_ros.fleet import run
from armid_ros.fleet.bags import BagFile
from distributed import KilledWorker
import pytest

BAGS = tuple(BagFile('arm', f'/bags/arm/{k}') for k in range(3))
KILLED = KilledWorker('task', None, 3)


class Task:
    """A task that has ended."""

    def __init__(self, error=None):
        self.status, self._error = 'finished' if error is None else 'error', error

    def exception(self):
        """Return why it failed."""
        return self._error


def under_way(prepared, hit=0):
    """Return the tasks of an arm whose bags are read one by one."""
    arm = run._Waiting('arm', tuple((bag,) for bag in BAGS), hit=hit)
    return run._UnderWay(arm, prepared, Task(KILLED), [], Task(KILLED))


@pytest.fixture
def readable(monkeypatch):
    """Return the bags that can be read by themselves; all of them at first."""
    some = set(BAGS)
    monkeypatch.setattr(run, '_read', lambda client, group, job: set(group) <= some)
    return some


def test_an_arm_whose_bags_can_be_read_is_begun_again_a_few_times(readable):
    tasks = under_way([Task(KILLED), Task(), Task(KILLED)])
    left, failed = run._without_failed(tasks, None, None)
    assert failed == []
    assert left.groups == tasks.arm.groups and left.hit == 1
    often = under_way([Task(KILLED), Task(), Task()], hit=run._HIT)
    left, failed = run._without_failed(often, None, None)
    assert (left, failed) == (often.arm, [])


def test_a_bag_that_cannot_be_read_by_itself_is_given_up_and_no_other(readable):
    readable.remove(BAGS[0])
    tasks = under_way([Task(KILLED), Task(), Task(KILLED)])
    left, failed = run._without_failed(tasks, None, None)
    assert [one.bag for one in failed] == [BAGS[0]] and failed[0].failed
    assert left.groups == ((BAGS[1],), (BAGS[2],))
