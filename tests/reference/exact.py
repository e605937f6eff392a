"""Exact motion of a robot: Pinocchio's dynamics, integrated by Runge-Kutta of order 4 from event to event.

Smooth motion is integrated until halving the step changes nothing that matters. Dry friction and limits
are not smooth: a joint sticks, slips, or rests on its limit. Between such changes the motion is smooth.
Bisection finds the moments of change. An arrival at a limit is inelastic. A joint sticks until the force
needed to hold it exceeds its friction. These are the same physics as simd's rows, by another method.
"""

import numpy as np
import pinocchio as pin

import robots

GRAVITY = [0.0, 0.0, -9.81]
SMALL = 1e-13
"""Tolerance of the bisection for a change, seconds."""


class Robot:
    """A case in Pinocchio: state z = (q, v), with q = G y + o where joints follow others."""

    def __init__(self, case):
        self.case = case
        text = robots.plain(case.urdf, {}, planar_as_chain=True, bounded=True)
        root = [pin.JointModelFreeFlyer()] if case.free else []
        model = pin.buildModelFromXML(text, *root)
        model.gravity.linear = np.array(GRAVITY)
        self.model, self.data = model, model.createData()
        self.offset = 6 if case.free else 0
        names = [name for name, *_ in robots.axes(case.urdf)]
        self.at = [model.joints[model.getJointId(name)].idx_v for name in names]
        nv = model.nv
        assert nv == self.offset + len(names) and model.nq == nv + (1 if case.free else 0)
        by_name = dict(zip(names, self.at))
        model.armature = np.array([0.0] * self.offset + [case.armature] * len(names))
        self.damping = np.array([0.0] * self.offset + [case.damping] * len(names))
        self.friction = np.array([0.0] * self.offset + [case.friction] * len(names))
        self.lower, self.upper = np.full(nv, -np.inf), np.full(nv, np.inf)
        for name, (lower, upper) in case.limits.items():
            self.lower[by_name[name]], self.upper[by_name[name]] = lower, upper
        self.targets = np.zeros(nv)
        for name, target in case.drive.get("targets", {}).items():
            self.targets[by_name[name]] = target
        # Columns of independent velocities.
        followers = {by_name[name] for name in case.mimic}
        self.columns = [i for i in range(nv) if i not in followers]
        self.G = np.eye(nv)
        for name, (leader, multiplier, _) in case.mimic.items():
            self.G[by_name[name]] = multiplier * np.eye(nv)[by_name[leader]]
        self.G = self.G[:, self.columns]
        self.smooth = not (case.mimic or case.friction or case.limits)

        q, v = pin.neutral(model), np.zeros(nv)
        for name, i in by_name.items():
            q[i + (1 if case.free else 0)] = case.positions.get(name, 0.0)
            v[i] = case.velocities.get(name, 0.0)
        v[: self.offset] = case.root_velocity
        self.start = np.concatenate([q, v])
        for name, (leader, multiplier, offset) in case.mimic.items():
            indices = (by_name[name], by_name[leader])
            assert abs(q[indices[0]] - multiplier * q[indices[1]] - offset) < 1e-15
            assert abs(v[indices[0]] - multiplier * v[indices[1]]) < 1e-15

    def drive(self, q, v):
        drive = self.case.drive
        if not drive:
            return 0.0
        q = q[1:] if self.case.free else q
        match drive["kind"]:
            case "position":
                effort = drive["stiffness"] * (self.targets - q) - drive["damping"] * v
            case "velocity":
                effort = drive["damping"] * (self.targets - v)
            case "effort":
                effort = self.targets.copy()
        effort[: self.offset] = 0.0
        limit = self.case.effort
        return effort if limit is None else np.clip(effort, -limit, limit)

    def split(self, z):
        nq = self.model.nq
        q = z[:nq]
        if self.case.free:
            q = q.copy()
            q[3:7] /= np.linalg.norm(q[3:7])
        return q, z[nq:]

    def forces(self, z, modes):
        """Returns M and the forces that accelerate, without constraint forces."""
        q, v = self.split(z)
        M = pin.crba(self.model, self.data, q)
        M = np.triu(M) + np.triu(M, 1).T
        push = self.drive(q, v) - self.damping * v - self.friction * modes.slip
        return M, push - pin.nonLinearEffects(self.model, self.data, q, v)

    def acceleration(self, z, modes):
        """Adds the constraint forces at joints that stick or rest on a limit."""
        if self.smooth:
            q, v = self.split(z)
            return pin.aba(self.model, self.data, q, v, self.drive(q, v) - self.damping * v), None
        M, push = self.forces(z, modes)
        held = modes.held()
        if self.case.mimic:
            assert not held.any()
            G = self.G
            return G @ np.linalg.solve(G.T @ M @ G, G.T @ push), None
        a = np.zeros(self.model.nv)
        moves = ~held
        a[moves] = np.linalg.solve(M[np.ix_(moves, moves)], push[moves])
        return a, M @ a - push

    def derivative(self, z, modes):
        q, v = self.split(z)
        out = np.empty_like(z)
        out[self.model.nq:] = self.acceleration(z, modes)[0]
        if self.case.free:
            # In R^4: the derivative of a quaternion is half its product with the angular velocity.
            x, y, zz, w = z[3:7]
            a, b, c = v[3:6]
            out[:3] = pin.Quaternion(*(q[[6, 3, 4, 5]])).toRotationMatrix() @ v[:3]
            out[3:7] = 0.5 * np.array([w * a + y * c - zz * b, w * b + zz * a - x * c,
                                       w * c + x * b - y * a, -x * a - y * b - zz * c])
            out[7:self.model.nq] = v[6:]
        else:
            out[:self.model.nq] = v
        return out

    def advance(self, z, modes, h):
        k1 = self.derivative(z, modes)
        k2 = self.derivative(z + h / 2 * k1, modes)
        k3 = self.derivative(z + h / 2 * k2, modes)
        k4 = self.derivative(z + h * k3, modes)
        return z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def view(self, z):
        """Returns joints in the order of the case; and the root, x y z and quaternion x y z w."""
        q, _ = self.split(z)
        shift = 1 if self.case.free else 0
        return q[[i + shift for i in self.at]].copy(), q[:7].copy() if self.case.free else None


class Modes:
    """Slip direction of each joint (1, -1; 0: sticks or has no friction), and the limit on which it rests."""

    def __init__(self, robot, z):
        v = z[robot.model.nq:]
        self.rough = robot.friction > 0
        self.slip = np.where(self.rough, np.sign(v), 0.0)
        self.rest = np.zeros_like(v)

    def held(self):
        return (self.rough & (self.slip == 0)) | (self.rest != 0)


def events(robot, z, modes):
    """Returns the changes that are due at z: a list of (joint, change)."""
    nq, nv = robot.model.nq, robot.model.nv
    shift = nq - nv
    q, v = z[:nq][shift:], z[nq:]
    found = []
    force = robot.acceleration(z, modes)[1]
    for i in range(robot.offset, nv):
        if modes.rest[i]:
            if force[i] * modes.rest[i] > 0:
                found.append((i, "leave"))
            continue
        if q[i] > robot.upper[i] or q[i] < robot.lower[i]:
            found.append((i, "arrive"))
        if modes.rough[i]:
            if modes.slip[i] and v[i] * modes.slip[i] < 0:
                found.append((i, "stop"))
            elif not modes.slip[i] and abs(force[i]) > robot.friction[i]:
                found.append((i, "slip"))
    return found


def change(robot, z, modes, found):
    nq = robot.model.nq
    z = z.copy()
    v = z[nq:]
    for i, what in found:
        match what:
            case "leave":
                modes.rest[i] = 0.0
            case "arrive":
                top = z[:nq][i + nq - robot.model.nv] > robot.upper[i]
                modes.rest[i] = 1.0 if top else -1.0
                z[i + nq - robot.model.nv] = robot.upper[i] if top else robot.lower[i]
                M, _ = robot.forces(z, modes)
                # Impact without bounce; other limits resist it, dry friction does not.
                rests = np.flatnonzero(modes.rest)
                inverse = np.linalg.inv(M)
                blow = np.linalg.solve(inverse[np.ix_(rests, rests)], -v[rests])
                assert (blow * modes.rest[rests] <= 1e-12).all(), "the blow lifts another joint off its limit"
                v += inverse[:, rests] @ blow
                v[rests] = 0.0
                modes.slip = np.where(modes.rough, np.sign(v), 0.0)
            case "stop":
                modes.slip[i], v[i] = 0.0, 0.0
                force = robot.acceleration(z, modes)[1]
                if abs(force[i]) > robot.friction[i]:
                    modes.slip[i] = -np.sign(force[i])
            case "slip":
                force = robot.acceleration(z, modes)[1]
                modes.slip[i] = -np.sign(force[i])
    return z


def integrate(robot, h, instants):
    z = robot.start.copy()
    modes = Modes(robot, z)
    seen, t = [], 0.0
    for instant in instants:
        steps = max(1, round((instant - t) / h))
        for _ in range(steps):
            left = (instant - t) / steps
            while left > 0:
                after = robot.advance(z, modes, left)
                if robot.smooth or robot.case.mimic or not events(robot, after, modes):
                    z = after
                    break
                low, high = 0.0, left
                while high - low > SMALL:
                    middle = (low + high) / 2
                    if events(robot, robot.advance(z, modes, middle), modes):
                        high = middle
                    else:
                        low = middle
                z = robot.advance(z, modes, high)
                z = change(robot, z, modes, events(robot, z, modes))
                left -= high
        t = instant
        if robot.case.free:
            z[3:7] /= np.linalg.norm(z[3:7])
        seen.append(robot.view(z))
    return seen


def difference(a, b):
    """Returns the difference of two views: the largest of a joint's or the root's position, rad or m; a
    root's turn as its angle."""
    largest = float(np.abs(a[0] - b[0]).max(initial=0.0))
    if a[1] is not None:
        largest = max(largest, float(np.abs(a[1][:3] - b[1][:3]).max()))
        p, q = a[1][3:], b[1][3:]
        # The vector part of conj(p) q.
        vector = p[3] * q[:3] - q[3] * p[:3] - np.cross(p[:3], q[:3])
        largest = max(largest, 2 * float(np.arcsin(min(1.0, np.linalg.norm(vector)))))
    return largest


def reference(case, instants, h=2e-4):
    """Returns views at the instants, and their change if the step is halved."""
    robot = Robot(case)
    # The effort has a kink if an actuator reaches its limit; across it the order is lower.
    enough = 1e-9 if case.effort is None else 1e-7
    before = integrate(robot, h, instants)
    for _ in range(5):
        h /= 2
        now = integrate(robot, h, instants)
        changed = max(difference(a, b) for a, b in zip(before, now))
        if changed < enough:
            return now, changed
        before = now
    raise RuntimeError(f"{case.name}: half of {h} s still changes {changed:.1e}")
