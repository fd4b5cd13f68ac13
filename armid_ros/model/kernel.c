/* Copyright 2026 The armid_ros developers
 * SPDX-License-Identifier: Apache-2.0
 *
 * Inverse dynamics and regressor of a rigid arm along a motion, and its steps under a feedback
 * controller, for as long as every friction element keeps slipping or sticking as it does and no
 * joint reaches a stop; recursive least squares. `rigid_body.py` calls `torques` and `regressors`,
 * `closed_loop.py` calls `advance`, `recursive.py` calls `add_rows`. `integrator.py` is the same
 * step in Python and takes the steps at which something changes.
 *
 * Vectors of 6 are motions or forces of a link in its own frame, the angular part first.
 * Algorithms: recursive Newton-Euler and composite rigid body, Featherstone 2008, chapters 5 and 6.
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <math.h>
#include <stdint.h>
#include <string.h>

#define MOST_JOINTS 32
const int64_t most_joints = MOST_JOINTS; /* of the largest arm that there is room for */

/* One joint and the link it moves; the fields are those of `JointGeometry`. */
typedef struct {
    int64_t parent;
    double slide[3], turn[3], origin[3], sliding[3], turning[9][3];
    double mass, first_moment[3], inertia[9]; /* about the origin of the link's frame */
} Joint;

typedef struct {
    int64_t n;
    double gravity[3];
    const Joint *joints;
    const double *added_inertia; /* (n, n), of the joints: rotors and implicit damping */
} Arm;

/* Inverse dynamics and a spring and damper of each joint; `LinearFeedback` says what is what. */
typedef struct {
    Arm arm;
    double bandwidth, follows;
    const double *stiffness, *damping; /* (n,) */
} Controller;

typedef struct {
    Arm arm;
    double dt, speed_tolerance;
    const double *damping, *constant;             /* (n, n), (n,) */
    const double *lower, *upper;                  /* (n,), position limits */
    const double *lowest_torque, *highest_torque; /* (n,), of the drives */
    int64_t n_elements;                           /* of dry friction, each of one joint */
    const int64_t *element_joint;
    const double *element_lower, *element_upper;
    double *law_input, *law_torque; /* (1 + 2 n,): time, position, velocity; and (n,) */
    int (*torque_law)(void);        /* of the smooth effects, reads and writes the two; or NULL */
} Plant;

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void add_cross(const double a[3], const double b[3], double out[3])
{
    double product[3];
    cross(a, b, product);
    for (int i = 0; i < 3; i++) out[i] += product[i];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Pose of a link on its parent: x_parent = rotation x + translation. */
typedef struct {
    double rotation[9], translation[3];
} Pose;

static void pose_of(const Joint *joint, double q, Pose *pose)
{
    double s = sin(q), c = 1.0 - cos(q);
    for (int i = 0; i < 9; i++)
        pose->rotation[i] = joint->turning[i][0] + joint->turning[i][1] * s + joint->turning[i][2] * c;
    for (int i = 0; i < 3; i++) pose->translation[i] = joint->origin[i] + joint->sliding[i] * q;
}

static void to_parent(const Pose *pose, const double x[3], double out[3])
{
    const double *r = pose->rotation;
    for (int i = 0; i < 3; i++) out[i] = r[3 * i] * x[0] + r[3 * i + 1] * x[1] + r[3 * i + 2] * x[2];
}

static void to_link(const Pose *pose, const double x[3], double out[3])
{
    const double *r = pose->rotation;
    for (int i = 0; i < 3; i++) out[i] = r[i] * x[0] + r[3 + i] * x[1] + r[6 + i] * x[2];
}

/* Move a motion of the parent's frame into the link's. */
static void motion_to_link(const Pose *pose, const double x[6], double out[6])
{
    double linear[3] = {x[3], x[4], x[5]};
    add_cross(x, pose->translation, linear);
    to_link(pose, x, out);
    to_link(pose, linear, out + 3);
}

/* Add a force of the link's frame to one of the parent's. */
static void add_force_to_parent(const Pose *pose, const double f[6], double out[6])
{
    double turned[6];
    to_parent(pose, f, turned);
    to_parent(pose, f + 3, turned + 3);
    add_cross(pose->translation, turned + 3, turned);
    for (int i = 0; i < 6; i++) out[i] += turned[i];
}

/* Inertia of a link or of several, times a motion. */
static void momentum(double mass, const double h[3], const double inertia[9], const double v[6], double out[6])
{
    for (int i = 0; i < 3; i++) {
        out[i] = inertia[3 * i] * v[0] + inertia[3 * i + 1] * v[1] + inertia[3 * i + 2] * v[2];
        out[3 + i] = mass * v[3 + i];
    }
    add_cross(h, v + 3, out);
    add_cross(v, h, out + 3);
}

static void poses_of(const Arm *arm, const double *q, Pose *poses)
{
    for (int64_t i = 0; i < arm->n; i++) pose_of(&arm->joints[i], q[i], &poses[i]);
}

/* Velocity and acceleration of each link; gravity is an acceleration of the base. */
static void motions_of(const Arm *arm, const Pose *poses, const double *dq, const double *ddq,
                       double v[][6], double a[][6])
{
    const double still[6] = {0}, base[6] = {0, 0, 0, -arm->gravity[0], -arm->gravity[1], -arm->gravity[2]};
    for (int64_t i = 0; i < arm->n; i++) {
        const Joint *joint = &arm->joints[i];
        double own[6];
        motion_to_link(&poses[i], joint->parent < 0 ? still : v[joint->parent], v[i]);
        motion_to_link(&poses[i], joint->parent < 0 ? base : a[joint->parent], a[i]);
        for (int k = 0; k < 3; k++) {
            own[k] = joint->turn[k] * dq[i];
            own[3 + k] = joint->slide[k] * dq[i];
        }
        for (int k = 0; k < 6; k++) v[i][k] += own[k];
        add_cross(v[i], own, a[i]);
        add_cross(v[i], own + 3, a[i] + 3);
        add_cross(v[i] + 3, own, a[i] + 3);
        for (int k = 0; k < 3; k++) {
            a[i][k] += joint->turn[k] * ddq[i];
            a[i][3 + k] += joint->slide[k] * ddq[i];
        }
    }
}

/* Torques of the rigid body, without what is added to the inertia of the joints. */
static void inverse_dynamics(
    const Arm *arm, const Pose *poses, const double *dq, const double *ddq, double *tau)
{
    double v[MOST_JOINTS][6], a[MOST_JOINTS][6], f[MOST_JOINTS][6];
    motions_of(arm, poses, dq, ddq, v, a);
    for (int64_t i = 0; i < arm->n; i++) {
        const Joint *joint = &arm->joints[i];
        double moved[6];
        momentum(joint->mass, joint->first_moment, joint->inertia, v[i], moved);
        momentum(joint->mass, joint->first_moment, joint->inertia, a[i], f[i]);
        add_cross(v[i], moved, f[i]);
        add_cross(v[i] + 3, moved + 3, f[i]);
        add_cross(v[i], moved + 3, f[i] + 3);
    }
    for (int64_t i = arm->n - 1; i >= 0; i--) {
        const Joint *joint = &arm->joints[i];
        tau[i] = dot(joint->turn, f[i]) + dot(joint->slide, f[i] + 3);
        if (joint->parent >= 0) add_force_to_parent(&poses[i], f[i], f[joint->parent]);
    }
}

/* Force on a link per unit of its mass, first moments and inertia about its origin: 10 columns. */
static void force_per_parameter(const double v[6], const double a[6], double columns[10][6])
{
    double point[3] = {a[3], a[4], a[5]}; /* acceleration of the origin */
    add_cross(v, v + 3, point);
    memset(columns, 0, 10 * sizeof *columns);
    memcpy(columns[0] + 3, point, sizeof point);
    for (int k = 0; k < 3; k++) {
        double unit[3] = {0}, turned[3];
        unit[k] = 1.0;
        cross(unit, point, columns[1 + k]);
        cross(a, unit, columns[1 + k] + 3);
        cross(v, unit, turned);
        add_cross(v, turned, columns[1 + k] + 3);
    }
    for (int column = 0, row = 0; row < 3; row++)
        for (int k = 0; k <= row; k++, column++) { /* Ixx, Ixy, Iyy, Ixz, Iyz, Izz */
            double spin[3] = {0}, *moment = columns[4 + column];
            moment[row] = a[k];
            moment[k] = a[row];
            spin[row] = v[k];
            spin[k] = v[row];
            add_cross(v, spin, moment);
        }
}

/* Regressor of the torques, (n, 10 n), of which only the entries that may differ from zero are written. */
static void regressor(const Arm *arm, const Pose *poses, const double *dq, const double *ddq, double *y)
{
    double v[MOST_JOINTS][6], a[MOST_JOINTS][6], axes[MOST_JOINTS][MOST_JOINTS][6];
    motions_of(arm, poses, dq, ddq, v, a);
    for (int64_t link = 0; link < arm->n; link++) {
        double columns[10][6];
        force_per_parameter(v[link], a[link], columns);
        memcpy(axes[link][link], arm->joints[link].turn, 3 * sizeof(double));
        memcpy(axes[link][link] + 3, arm->joints[link].slide, 3 * sizeof(double));
        for (int64_t joint = link; joint >= 0; joint = arm->joints[joint].parent) {
            double *axis = axes[link][joint], *row = y + 10 * (arm->n * joint + link);
            if (joint != link) motion_to_link(&poses[link], axes[arm->joints[link].parent][joint], axis);
            for (int k = 0; k < 10; k++) row[k] = dot(axis, columns[k]) + dot(axis + 3, columns[k] + 3);
        }
    }
}

/* Inertia matrix of the joints, (n, n), with what is added to it. */
static void mass_matrix(const Arm *arm, const Pose *poses, double *matrix)
{
    double mass[MOST_JOINTS], h[MOST_JOINTS][3], inertia[MOST_JOINTS][9];
    int64_t n = arm->n;
    for (int64_t i = 0; i < n; i++) {
        mass[i] = arm->joints[i].mass;
        memcpy(h[i], arm->joints[i].first_moment, sizeof h[i]);
        memcpy(inertia[i], arm->joints[i].inertia, sizeof inertia[i]);
    }
    memcpy(matrix, arm->added_inertia, (size_t)(n * n) * sizeof *matrix);
    for (int64_t i = n - 1; i >= 0; i--) {
        const Joint *joint = &arm->joints[i];
        double motion[6], force[6];
        memcpy(motion, joint->turn, sizeof joint->turn);
        memcpy(motion + 3, joint->slide, sizeof joint->slide);
        momentum(mass[i], h[i], inertia[i], motion, force);
        matrix[n * i + i] += dot(joint->turn, force) + dot(joint->slide, force + 3);
        for (int64_t link = i, above = joint->parent; above >= 0; link = above, above = arm->joints[link].parent) {
            double moved[6] = {0};
            add_force_to_parent(&poses[link], force, moved);
            memcpy(force, moved, sizeof force);
            double entry = dot(arm->joints[above].turn, force) + dot(arm->joints[above].slide, force + 3);
            matrix[n * i + above] += entry;
            matrix[n * above + i] += entry;
        }
        if (joint->parent < 0) continue;
        int64_t to = joint->parent; /* the composite inertia about the origin of the parent */
        const double *r = poses[i].rotation, *p = poses[i].translation;
        double turned[3], rotated[9];
        to_parent(&poses[i], h[i], turned);
        for (int row = 0; row < 3; row++) {
            double line[3] = {0};
            for (int k = 0; k < 3; k++)
                for (int l = 0; l < 3; l++) line[k] += r[3 * row + l] * inertia[i][3 * l + k];
            for (int column = 0; column < 3; column++)
                rotated[3 * row + column] = dot(line, r + 3 * column);
        }
        double shift = mass[i] * dot(p, p) + 2.0 * dot(p, turned);
        for (int row = 0; row < 3; row++) {
            for (int column = 0; column < 3; column++)
                inertia[to][3 * row + column] += rotated[3 * row + column] - mass[i] * p[row] * p[column] -
                                                 p[row] * turned[column] - turned[row] * p[column];
            inertia[to][4 * row] += shift;
            h[to][row] += turned[row] + mass[i] * p[row];
        }
        mass[to] += mass[i];
    }
}

/* Solve a symmetric positive definite system in place by Cholesky's method; 0 if it is not one. */
static int solve(int64_t n, double *matrix, double *x)
{
    for (int64_t j = 0; j < n; j++) {
        double pivot = matrix[n * j + j];
        for (int64_t k = 0; k < j; k++) pivot -= matrix[n * j + k] * matrix[n * j + k];
        if (!(pivot > 0.0)) return 0;
        matrix[n * j + j] = pivot = sqrt(pivot);
        for (int64_t i = j + 1; i < n; i++) {
            double entry = matrix[n * i + j];
            for (int64_t k = 0; k < j; k++) entry -= matrix[n * i + k] * matrix[n * j + k];
            matrix[n * i + j] = entry / pivot;
        }
    }
    for (int64_t i = 0; i < n; i++) {
        for (int64_t k = 0; k < i; k++) x[i] -= matrix[n * i + k] * x[k];
        x[i] /= matrix[n * i + i];
    }
    for (int64_t i = n - 1; i >= 0; i--) {
        for (int64_t k = i + 1; k < n; k++) x[i] -= matrix[n * k + i] * x[k];
        x[i] /= matrix[n * i + i];
    }
    return 1;
}

/* Take one step; 0 if an element changes its mode, a joint reaches a stop, or no body moves. */
static int step(const Plant *plant, const int64_t *modes, double t, const double *q, const double *dq,
                const double *ddq, const double *torque, double *q_next, double *dq_next, double *ddq_next)
{
    int64_t n = plant->arm.n;
    double half = 0.5 * plant->dt, middle[MOST_JOINTS] = {0}, speed[MOST_JOINTS] = {0}, force[MOST_JOINTS];
    double weight[MOST_JOINTS], right[MOST_JOINTS], matrix[MOST_JOINTS * MOST_JOINTS];
    double inertia[MOST_JOINTS * MOST_JOINTS], none[MOST_JOINTS] = {0};
    int stuck[MOST_JOINTS] = {0};
    Pose poses[MOST_JOINTS];
    for (int64_t i = 0; i < n; i++) {
        middle[i] = q[i] + half * dq[i];
        speed[i] = dq[i] + half * ddq[i];
    }
    poses_of(&plant->arm, middle, poses);
    inverse_dynamics(&plant->arm, poses, speed, none, weight);
    for (int64_t i = 0; i < n; i++) {
        force[i] = torque[i] - weight[i] - plant->constant[i];
        for (int64_t k = 0; k < n; k++) force[i] -= plant->damping[n * i + k] * dq[k];
    }
    if (plant->torque_law) {
        plant->law_input[0] = t + half;
        memcpy(plant->law_input + 1, middle, (size_t)n * sizeof *middle);
        memcpy(plant->law_input + 1 + n, speed, (size_t)n * sizeof *speed);
        if (plant->torque_law()) return 0; /* it raised something */
        for (int64_t i = 0; i < n; i++) force[i] -= plant->law_torque[i];
    }
    mass_matrix(&plant->arm, poses, inertia);
    memcpy(matrix, inertia, (size_t)(n * n) * sizeof *matrix);
    memcpy(right, force, (size_t)n * sizeof *right);
    for (int64_t e = 0; e < plant->n_elements; e++) {
        int64_t joint = plant->element_joint[e];
        right[joint] -= modes[e] > 0 ? plant->element_upper[e] : modes[e] < 0 ? plant->element_lower[e] : 0.0;
        stuck[joint] = modes[e] == 0;
    }
    for (int64_t i = 0; i < n; i++) {
        if (!stuck[i]) continue;
        for (int64_t k = 0; k < n; k++) matrix[n * i + k] = matrix[n * k + i] = 0.0;
        matrix[n * i + i] = 1.0;
        right[i] = 0.0;
    }
    if (!solve(n, matrix, right)) return 0;
    for (int64_t i = 0; i < n; i++) {
        ddq_next[i] = right[i];
        dq_next[i] = dq[i] + plant->dt * right[i];
        q_next[i] = middle[i] + half * dq_next[i];
        if (!(plant->lower[i] <= q_next[i] && q_next[i] <= plant->upper[i])) return 0;
    }
    for (int64_t e = 0; e < plant->n_elements; e++) {
        int64_t joint = plant->element_joint[e];
        if (modes[e]) {
            if (dq_next[joint] * (double)modes[e] < -plant->speed_tolerance) return 0;
            continue;
        }
        double held = force[joint];
        for (int64_t k = 0; k < n; k++) held -= inertia[n * joint + k] * ddq_next[k];
        if (!(plant->element_lower[e] <= held && held <= plant->element_upper[e])) return 0;
    }
    return 1;
}

static void command(const Plant *plant, const Controller *controller, const double *q, const double *dq,
                    const double *const desired[3], const double *feedforward, double *torque)
{
    const Arm *arm = &controller->arm;
    double speed[MOST_JOINTS] = {0}, ddq[MOST_JOINTS] = {0}, w = controller->bandwidth;
    Pose poses[MOST_JOINTS];
    for (int64_t i = 0; i < arm->n; i++) {
        speed[i] = controller->follows * dq[i];
        ddq[i] = w * w * (desired[0][i] - q[i]) + 2.0 * w * (desired[1][i] - dq[i]) +
                 controller->follows * desired[2][i];
    }
    poses_of(arm, q, poses);
    inverse_dynamics(arm, poses, speed, ddq, torque);
    for (int64_t i = 0; i < arm->n; i++) {
        for (int64_t k = 0; k < arm->n; k++) torque[i] += arm->added_inertia[arm->n * i + k] * ddq[k];
        torque[i] += controller->stiffness[i] * (desired[0][i] - q[i]) +
                     controller->damping[i] * (desired[1][i] - dq[i]) + feedforward[i];
        torque[i] = fmin(fmax(torque[i], plant->lowest_torque[i]), plant->highest_torque[i]);
    }
}

/*
 * Take steps from row `first` to row `last`, and return the row that was reached. Row `first` of q,
 * dq, ddq and torque, each (last + 1, n), is given; the rows after it are written. Row k of the
 * targets, each (last, n), belongs to the end of step k; `modes` is what every friction element
 * does: 1, -1, or 0 where it sticks. `t` is the time of row `first`.
 */
int64_t advance(const Plant *plant, const Controller *controller, const int64_t *modes, double t,
                int64_t first, int64_t last, double *q, double *dq, double *ddq, double *torque,
                const double *q_desired, const double *dq_desired, const double *ddq_desired,
                const double *feedforward)
{
    int64_t n = plant->arm.n, k = first;
    for (; k < last; k++) {
        int64_t row = n * k, next = row + n;
        if (!step(plant, modes, t + (double)(k - first) * plant->dt, q + row, dq + row, ddq + row, torque + row, q + next,
                  dq + next, ddq + next))
            break;
        const double *desired[3] = {q_desired + row, dq_desired + row, ddq_desired + row};
        command(plant, controller, q + next, dq + next, desired, feedforward + row, torque + next);
    }
    return k;
}

/* Torques, (samples, n), along a motion of q, dq and ddq, each (samples, n). */
void torques(const Arm *arm, int64_t samples, const double *q, const double *dq, const double *ddq, double *tau)
{
    Pose poses[MOST_JOINTS];
    for (int64_t row = 0; row < samples * arm->n; row += arm->n) {
        poses_of(arm, q + row, poses);
        inverse_dynamics(arm, poses, dq + row, ddq + row, tau + row);
    }
}

/* Regressors, (samples, n, 10 n), along a motion; `y` is zero at first. */
void regressors(const Arm *arm, int64_t samples, const double *q, const double *dq, const double *ddq, double *y)
{
    Pose poses[MOST_JOINTS];
    for (int64_t row = 0; row < samples * arm->n; row += arm->n) {
        poses_of(arm, q + row, poses);
        regressor(arm, poses, dq + row, ddq + row, y + 10 * arm->n * row);
    }
}

/* Product s x y of a joint's axis with a motion: minus the change of y by the joint's position. */
static double along_change(const Joint *joint, const double y[6], const double weight[6])
{
    double change[6];
    cross(joint->turn, y, change);
    cross(joint->turn, y + 3, change + 3);
    add_cross(joint->slide, y, change + 3);
    return dot(weight, change) + dot(weight + 3, change + 3);
}

/* Add the derivatives of sum(weight * columns) of `force_per_parameter` by v and a. */
static void force_slopes(const double v[6], const double a[6], double weight[10][6], double by_v[6], double by_a[6])
{
    double by_point[3];
    memcpy(by_point, weight[0] + 3, sizeof by_point);
    for (int k = 0; k < 3; k++) {
        double unit[3] = {0}, turned[3], by_turned[3], *moment = weight[1 + k], *force = moment + 3;
        unit[k] = 1.0;
        add_cross(moment, unit, by_point);
        add_cross(unit, force, by_a);
        cross(v, unit, turned);
        cross(force, v, by_turned);
        add_cross(turned, force, by_v);
        add_cross(unit, by_turned, by_v);
    }
    for (int column = 0, row = 0; row < 3; row++)
        for (int k = 0; k <= row; k++, column++) { /* Ixx, Ixy, Iyy, Ixz, Iyz, Izz */
            double spin[3] = {0}, by_spin[3], *moment = weight[4 + column];
            spin[row] = v[k];
            spin[k] = v[row];
            cross(moment, v, by_spin);
            add_cross(spin, moment, by_v);
            by_a[k] += moment[row];
            by_v[k] += by_spin[row];
            if (row == k) continue;
            by_a[row] += moment[k];
            by_v[row] += by_spin[k];
        }
    for (int i = 0; i < 3; i++) by_a[3 + i] += by_point[i];
    add_cross(v + 3, by_point, by_v);
    add_cross(by_point, v, by_v + 3);
}

/* Derivatives of sum(weights * regressor) by q, dq and ddq: the regressor in reverse mode. */
static void slopes(const Arm *arm, const Pose *poses, const double *dq, const double *ddq, const double *weights,
                   double *by_q, double *by_dq, double *by_ddq)
{
    double v[MOST_JOINTS][6], a[MOST_JOINTS][6], by_v[MOST_JOINTS][6], by_a[MOST_JOINTS][6];
    double axes[MOST_JOINTS][MOST_JOINTS][6], by_axes[MOST_JOINTS][MOST_JOINTS][6];
    motions_of(arm, poses, dq, ddq, v, a);
    for (int64_t link = 0; link < arm->n; link++) {
        double columns[10][6], weight[10][6] = {{0}};
        force_per_parameter(v[link], a[link], columns);
        memcpy(axes[link][link], arm->joints[link].turn, 3 * sizeof(double));
        memcpy(axes[link][link] + 3, arm->joints[link].slide, 3 * sizeof(double));
        memset(by_v[link], 0, sizeof by_v[link]);
        memset(by_a[link], 0, sizeof by_a[link]);
        for (int64_t joint = link; joint >= 0; joint = arm->joints[joint].parent) {
            const double *row = weights + 10 * (arm->n * joint + link);
            double *axis = axes[link][joint], *by_axis = by_axes[link][joint];
            if (joint != link) motion_to_link(&poses[link], axes[arm->joints[link].parent][joint], axis);
            memset(by_axis, 0, 6 * sizeof *by_axis);
            for (int k = 0; k < 10; k++)
                for (int i = 0; i < 6; i++) {
                    by_axis[i] += row[k] * columns[k][i];
                    weight[k][i] += row[k] * axis[i];
                }
        }
        force_slopes(v[link], a[link], weight, by_v[link], by_a[link]);
    }
    for (int64_t link = arm->n - 1; link >= 0; link--) {
        const Joint *joint = &arm->joints[link];
        double own[6], by_own[6] = {0}, carried[6], *v_link = v[link], *by_v_link = by_v[link], *by_a_link = by_a[link];
        for (int k = 0; k < 3; k++) {
            own[k] = joint->turn[k] * dq[link];
            own[3 + k] = joint->slide[k] * dq[link];
        }
        add_cross(own, by_a_link, by_v_link);
        add_cross(own + 3, by_a_link + 3, by_v_link);
        add_cross(own, by_a_link + 3, by_v_link + 3);
        add_cross(by_a_link, v_link, by_own);
        add_cross(by_a_link + 3, v_link + 3, by_own);
        add_cross(by_a_link + 3, v_link, by_own + 3);
        for (int i = 0; i < 6; i++) by_own[i] += by_v_link[i];
        by_dq[link] = dot(joint->turn, by_own) + dot(joint->slide, by_own + 3);
        by_ddq[link] = dot(joint->turn, by_a_link) + dot(joint->slide, by_a_link + 3);
        for (int i = 0; i < 6; i++) carried[i] = v_link[i] - own[i];
        by_q[link] = -along_change(joint, carried, by_v_link);
        memcpy(carried, a[link], sizeof carried); /* without the joint's own acceleration */
        for (int k = 0; k < 3; k++) {
            carried[k] -= joint->turn[k] * ddq[link];
            carried[3 + k] -= joint->slide[k] * ddq[link];
        }
        add_cross(own, v_link, carried);
        add_cross(own + 3, v_link, carried + 3);
        add_cross(own, v_link + 3, carried + 3);
        by_q[link] -= along_change(joint, carried, by_a_link);
        if (joint->parent >= 0) {
            add_force_to_parent(&poses[link], by_v_link, by_v[joint->parent]);
            add_force_to_parent(&poses[link], by_a_link, by_a[joint->parent]);
        }
        for (int64_t other = joint->parent; other >= 0; other = arm->joints[other].parent) {
            by_q[link] -= along_change(joint, axes[link][other], by_axes[link][other]);
            add_force_to_parent(&poses[link], by_axes[link][other], by_axes[joint->parent][other]);
        }
    }
}

/* Derivatives of sum(weights * regressors), at each sample, by q, dq and ddq: (3, samples, n). */
void regressor_slopes(const Arm *arm, int64_t samples, const double *q, const double *dq, const double *ddq,
                      const double *weights, double *by)
{
    Pose poses[MOST_JOINTS];
    int64_t size = samples * arm->n;
    for (int64_t row = 0; row < size; row += arm->n) {
        poses_of(arm, q + row, poses);
        slopes(arm, poses, dq + row, ddq + row, weights + 10 * arm->n * row, by + row, by + size + row, by + 2 * size + row);
    }
}

/* Inertia matrix at one pose, for the tests against Pinocchio. */
void inertia_matrix(const Arm *arm, const double *q, double *matrix)
{
    Pose poses[MOST_JOINTS];
    poses_of(arm, q, poses);
    mass_matrix(arm, poses, matrix);
}

/* Rows that a reflection combines with a line of the triangle; the compiler unrolls their loops. */
#define ROWS_AT_ONCE 8

/* Annihilate rows, and their torques, by a reflection for each column of the triangle. */
static void reflect(int64_t size, double *root, double *right, double *rows, double *tau)
{
    double line[size];
    for (int64_t j = 0; j < size; j++) {
        double weight[ROWS_AT_ONCE], squares = 0.0, pivot = root[size * j + j], change = right[j];
        for (int i = 0; i < ROWS_AT_ONCE; i++) squares += rows[size * i + j] * rows[size * i + j];
        if (squares == 0.0) continue;
        double length = -copysign(sqrt(pivot * pivot + squares), pivot), factor = 1.0 - pivot / length;
        root[size * j + j] = length;
        for (int i = 0; i < ROWS_AT_ONCE; i++) {
            weight[i] = rows[size * i + j] / (pivot - length);
            change += weight[i] * tau[i];
        }
        change *= factor;
        right[j] -= change;
        for (int i = 0; i < ROWS_AT_ONCE; i++) tau[i] -= weight[i] * change;
        for (int64_t k = j + 1; k < size; k++) line[k] = root[size * k + j];
#pragma GCC ivdep
        for (int64_t k = j + 1; k < size; k++) { /* the columns are independent of each other */
            double part = line[k];
            for (int i = 0; i < ROWS_AT_ONCE; i++) part += weight[i] * rows[size * i + k];
            part *= factor;
            line[k] -= part;
            for (int i = 0; i < ROWS_AT_ONCE; i++) rows[size * i + k] -= weight[i] * part;
        }
        for (int64_t k = j + 1; k < size; k++) root[size * k + j] = line[k];
    }
}

/*
 * Add rows (count, size) and their torques to the least-squares problem R x = z, and solve it for
 * x; return the squared residual that this adds. R is the upper triangle of `root`, column by
 * column; R and z = `right` are overwritten by those of the QR decomposition with the new rows.
 */
double add_rows(int64_t size, int64_t count, double *root, double *right, const double *rows,
                const double *tau, double *x)
{
    double some[ROWS_AT_ONCE * size], torques[ROWS_AT_ONCE], squares = 0.0;
    for (int64_t first = 0; first < count; first += ROWS_AT_ONCE) {
        size_t used = (size_t)(count - first < ROWS_AT_ONCE ? count - first : ROWS_AT_ONCE);
        memset(some, 0, sizeof some);
        memset(torques, 0, sizeof torques);
        memcpy(some, rows + size * first, used * (size_t)size * sizeof *some);
        memcpy(torques, tau + first, used * sizeof *torques);
        reflect(size, root, right, some, torques);
        for (int i = 0; i < ROWS_AT_ONCE; i++) squares += torques[i] * torques[i];
    }
    memcpy(x, right, (size_t)size * sizeof *x);
    for (int64_t k = size - 1; k >= 0; k--) {
        x[k] /= root[size * k + k];
        for (int64_t i = 0; i < k; i++) x[i] -= root[size * k + i] * x[k];
    }
    return squares;
}

/* Return the addresses of contiguous arrays as a tuple; `ndarray.ctypes` takes ten times as long. */
static PyObject *addresses(PyObject *self, PyObject *const *arrays, Py_ssize_t count)
{
    PyObject *found = PyTuple_New(count);
    (void)self;
    for (Py_ssize_t i = 0; found && i < count; i++) {
        Py_buffer view;
        PyObject *address = NULL;
        if (!PyObject_GetBuffer(arrays[i], &view, PyBUF_ANY_CONTIGUOUS)) {
            address = PyLong_FromVoidPtr(view.buf);
            PyBuffer_Release(&view);
        }
        if (address) PyTuple_SET_ITEM(found, i, address);
        else Py_CLEAR(found);
    }
    return found;
}

static PyMethodDef methods[] = {
    {"addresses", (PyCFunction)(void (*)(void))addresses, METH_FASTCALL, NULL},
    {NULL, NULL, 0, NULL},
};

/* All other functions are called by address, without objects of Python. */
static PyModuleDef module = {PyModuleDef_HEAD_INIT, "_kernel", NULL, -1, methods, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__kernel(void)
{
    PyObject *made = PyModule_Create(&module);
    /* of this file, by `setup.py`; `compiled.py` does not call a kernel of another source */
    if (made && PyModule_AddIntConstant(made, "checksum", CHECKSUM)) Py_CLEAR(made);
    return made;
}
