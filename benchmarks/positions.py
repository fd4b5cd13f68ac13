# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Ten arms in MuJoCo under position control: accuracy of drives identified from positions alone.

The first three arms have commands that were chosen for the fit: sums of waves, 200 Hz. Seven have
random commands and rates. `mujoco` is MuJoCo's own way: scipy's least squares over rollouts of its
model with finite differences, from the same start. `pace` is the method of PACE (Bjelonic et al.
2025) over the same rollouts: CMA-ES over rotor inertia, viscous and dry friction, bias of the
encoders and delay, with as many simulations as this tool needs. It gets the true gains and tool,
and bounds of twice the largest values that are drawn.

An error counts if this tool states the value within 10 % (95 %).

python -m benchmarks.positions [NUMBER [FIRST [WAY,...]]]

"""

import sys
import time

from armid_ros.positions.fit import fit_positions, start_values
from armid_ros.positions.loop import CommandedMotion, LoopModel
import mujoco
from mujoco import rollout
import numpy as np
from scipy.optimize import least_squares

from tests.hidden.machines import drive_size, load_machine
from tests.positions.machine import chirps, compiled, moves, play, random_chain, Secret, waves

ARMS = ('humanoid_earth', 'panda', 'ur10', 'chain', 'kinova', 'xarm7', 'chain', 'panda', 'ur10')
#: Time step of MuJoCo in its rollouts [s].
STEP = 1e-3


def case(seed):
    """Return name, description, true values, recordings and controller gains of an arm."""
    rng = np.random.default_rng(1000 + seed)
    name = 'chain' if seed == 9 else ARMS[seed]
    robot = random_chain(rng) if name == 'chain' else load_machine(name)
    secret, settings = Secret.draw(robot, rng), {}
    if seed > 2:
        settings = {
            'rate': int(rng.choice([100, 200, 250, 500])),
            'command_rate': int(rng.choice([50, 100, 250])),
            'kind': (waves, chirps, moves)[int(rng.integers(3))],
        }
    gains = None if secret.velocities else np.array([secret.kp, secret.kd])
    return name, robot, secret, play(robot, secret, rng, **settings), gains, settings


class CountedModel(LoopModel):
    """Model of arm and controller that counts its simulations."""

    count = 0

    def simulated(self, x, windows):
        """Simulate the closed loop of arm and controller, and count the simulation."""
        CountedModel.count += 1
        return super().simulated(x, windows)


def rollouts(robot, recording, commanded):
    """Return a function of parameters and encoder bias: position errors of rollouts [mrad]."""
    n = robot.n_joints
    commands = CommandedMotion.of(commanded, recording)
    edges = STEP * np.arange(round(recording.t[-1] / STEP) + 2)
    rows = np.rint(recording.t / STEP).astype(int)

    def apart(x, bias=0.0):
        kp, kd, rotor, viscous, coulomb = x[1:-5].reshape(5, n)
        noise = {'noise': 0.0, 'resolution': 0.0, 'velocities': bool(np.any(commands.dq))}
        secret = Secret(kp, kd, x[0], rotor, viscous, coulomb, x[-5], x[-4:-1], **noise)
        model, places = compiled(robot, secret, STEP)
        data = mujoco.MjData(model)
        data.qpos[places] = recording.q[0] + bias
        state = np.empty((1, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
        mujoco.mj_getState(model, data, state[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
        u, du = commands.mean(edges - x[0])
        states, _ = rollout.rollout(model, data, state, (u + bias + kd / kp * du)[np.newaxis])
        return (states[0, rows - 1][1:, 1 + places] - recording.q[1:] - bias).ravel() / 1e-3

    return apart


def pace_way(robot, apart, known, budget):
    """
    Fit parameters by CMA-ES with a given number of simulations (method of PACE).

    The mean starts in the middle of the bounds, with a standard deviation of a quarter of them.

    """
    n, drive = robot.n_joints, drive_size(robot)
    upper = np.concatenate([0.02 * drive, 0.16 * drive, 0.06 * drive, np.full(n, 0.05), [0.04]])
    lower = np.concatenate([np.zeros(3 * n), np.full(n, -0.05), [0.0]])

    def values(z):
        drives, bias, delay = np.split(lower + z * (upper - lower), [3 * n, 4 * n])
        return np.concatenate([delay, known[1 : 2 * n + 1], drives, known[-5:]]), bias

    def cost(z):
        return float(np.mean(apart(*values(z)) ** 2))

    best = minimised(cost, np.full(len(lower), 0.5), 0.25, budget, np.random.default_rng(0))
    return values(best)[0]


def minimised(cost, mean, sigma, budget, rng):
    """Return the minimiser, between 0 and 1, of a cost by CMA-ES (Hansen 2016, table 1)."""
    size = len(mean)
    many = 4 + int(3.0 * np.log(size))
    weights = np.log(many / 2 + 0.5) - np.log(np.arange(1, many // 2 + 1))
    weights /= weights.sum()
    mass = 1.0 / np.sum(weights**2)
    c_path, c_sigma = (
        (4 + mass / size) / (size + 4 + 2 * mass / size),
        (mass + 2) / (size + mass + 5),
    )
    c_one = 2.0 / ((size + 1.3) ** 2 + mass)
    c_rank = min(1.0 - c_one, 2.0 * (mass - 2 + 1 / mass) / ((size + 2) ** 2 + mass))
    damping = 1.0 + 2.0 * max(0.0, np.sqrt((mass - 1) / (size + 1)) - 1.0) + c_sigma
    usual = np.sqrt(size) * (1.0 - 1.0 / (4 * size) + 1.0 / (21 * size**2))
    covariance, path, slow = np.eye(size), np.zeros(size), np.zeros(size)
    for round_ in range(budget // many):
        spread, axes = np.linalg.eigh(covariance)
        spread = np.sqrt(np.maximum(spread, 1e-20))
        drawn = rng.normal(size=(many, size)) * spread @ axes.T
        points = np.clip(mean + sigma * drawn, 0.0, 1.0)
        order = np.argsort([cost(one) for one in points])[: len(weights)]
        steps = (points[order] - mean) / sigma
        step = weights @ steps
        mean = mean + sigma * step
        white = axes @ ((axes.T @ step) / spread)
        slow = (1.0 - c_sigma) * slow + np.sqrt(c_sigma * (2 - c_sigma) * mass) * white
        length = np.linalg.norm(slow) / np.sqrt(1.0 - (1.0 - c_sigma) ** (2 * round_ + 2))
        moves = length < (1.4 + 2.0 / (size + 1)) * usual
        path = (1.0 - c_path) * path + moves * np.sqrt(c_path * (2 - c_path) * mass) * step
        covariance = (1.0 - c_one - c_rank) * covariance + c_one * np.outer(path, path)
        covariance += c_rank * (steps * weights[:, np.newaxis]).T @ steps
        sigma *= np.exp(min(1.0, c_sigma / damping * (np.linalg.norm(slow) / usual - 1.0)))
    return mean


def own_way(robot, apart, start, size, gains):
    """Fit a MuJoCo model to rollouts by least squares; return values and standard errors."""
    n = robot.n_joints
    free = np.ones(len(start), dtype=bool)
    free[1 : 2 * n + 1] = gains is None
    free[-1] = False  # the width of the tool is known here

    def residual(z):
        x = start.copy()
        x[free] = z * size[free]
        return apart(x)

    lower, upper = np.zeros(len(start)), np.full(len(start), np.inf)
    lower[-4:-1], upper[-4:] = -1.0, 1.0
    lower[1 : n + 1] = 1e-3
    bounds = (lower / size)[free], (upper / size)[free]
    found = least_squares(
        residual, (start / size)[free], bounds=bounds, x_scale='jac', diff_step=1e-3,
        ftol=1e-4, xtol=1e-5, max_nfev=25,
    )  # fmt: skip
    x, std = start.copy(), np.zeros(len(start))
    x[free] = found.x * size[free]
    variance = 2.0 * found.cost / (len(found.fun) - free.sum())
    std[free] = np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac)) * variance) * size[free]
    return x, std


def shown(model, values, std, truth, determined):
    """Format the errors of delay [ms] and friction [%], and the coverage of their intervals."""
    names = [one.name for one in model.parameters]
    wanted = np.array([truth[one.name, one.joint] for one in model.parameters])
    of = {name: np.array([one == name for one in names]) for name in set(names)}
    relative = 100.0 * np.abs(values / wanted - 1.0)
    known = (std > 0.0) & np.isfinite(std)
    held = np.abs(values - wanted) <= 1.96 * std
    worst = [
        relative[of[name] & determined].max(initial=0.0)
        for name in ('viscous_coefficient', 'coulomb_torque', 'rotor_inertia')
    ]
    return 1e3 * abs(values[0] - wanted[0]), *worst, int(held[known].sum()), int(known.sum())


def main(number=10, first=0, ways='mujoco,pace'):
    """Print a row for each arm and each fitting method."""
    print('arm             way     delay  viscous  dry   rotor  held   runs    time')
    print('                         [ms]    [%]     [%]   [%]                  [s]')
    total = {'armid': [0, 0], 'mujoco': [0, 0]}
    for seed in range(int(first), int(first) + int(number)):
        name, robot, secret, (recording, commanded), gains, settings = case(seed)
        model, truth = CountedModel(robot), secret.truth(robot)
        run = recording, CommandedMotion.of(commanded, recording)
        begun, CountedModel.count = time.perf_counter(), 0
        fit = fit_positions(model, [run], gains)
        runs = CountedModel.count
        rows = [('armid', fit.values, fit.std, time.perf_counter() - begun)]
        determined = (fit.std > 0.0) & (1.96 * fit.std < 0.1 * np.abs(fit.values))
        apart = rollouts(robot, recording, commanded)
        begun = time.perf_counter()
        if 'mujoco' in ways:
            found = own_way(robot, apart, *start_values(model, [run], gains), gains)
            rows.append(('mujoco', *found, time.perf_counter() - begun))
        begun = time.perf_counter()
        if 'pace' in ways:
            known = np.array([truth[one.name, one.joint] for one in model.parameters])
            found = pace_way(robot, apart, known, runs)
            rows.append(('pace', found, np.zeros(len(found)), time.perf_counter() - begun))
        kind = settings.get('kind', waves).__name__
        known = 'fitted' if gains is None else 'given'
        friction = [one.name.startswith(('viscous', 'coulomb')) for one in model.parameters]
        print(
            f'{seed} {name}: {kind}, gains {known}, delay {1e3 * secret.delay:.1f} ms, friction '
            f'within 10 %: {np.sum(determined & friction)} of {np.sum(friction)}'
        )
        for way, values, std, lasted in rows:
            delay, viscous, dry, rotor, held, of = shown(model, values, std, truth, determined)
            if way in total:
                total[way][0] += held
                total[way][1] += of
            print(
                f'{"":15} {way:6} {delay:6.2f} {viscous:8.2f} {dry:6.2f} {rotor:6.2f} '
                f'{held:3}/{of:3} {runs:5} {lasted:8.1f}',
                flush=True,
            )
    for way, (held, of) in total.items():
        if of:
            print(f'{way}: intervals hold the truth in {held} of {of}: {100.0 * held / of:.1f} %')


if __name__ == '__main__':
    main(*sys.argv[1:])
