"""PyBullet's pure functions on quaternions (x y z w) and transforms.

They use Bullet's formulas, in double precision throughout. PyBullet computes all but the three conversions of
Euler angles and matrices in single precision. Quaternions that are not of length one are treated as in
PyBullet, function by function.
"""

from __future__ import annotations

import math
from typing import Any

from .arguments import Pose, Quaternion, Vector, quaternion, vector

Matrix = tuple[Vector, Vector, Vector]
# Smaller angles mean no rotation, as in Bullet's single precision.
_EPSILON = 1.1920929e-07


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Returns a b: first b, then a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by + ay * bw + az * bx - ax * bz,
        aw * bz + az * bw + ax * by - ay * bx,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """Returns the inverse of a unit quaternion."""
    x, y, z, w = q
    return (-x, -y, -z, w)


def matrix(q: Quaternion) -> Matrix:
    """Returns the rotation of a quaternion of any nonzero length."""
    x, y, z, w = q
    length = x * x + y * y + z * z + w * w
    s = 2.0 / length if length > 0.0 else 0.0
    return (
        (1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)),
    )


def from_matrix(m: Matrix) -> Quaternion:
    """Returns the unit quaternion of a rotation, with Bullet's choice of its sign."""
    trace = m[0][0] + m[1][1] + m[2][2]
    if trace > 0.0:
        s = math.sqrt(trace + 1.0)
        t = 0.5 / s
        return ((m[2][1] - m[1][2]) * t, (m[0][2] - m[2][0]) * t, (m[1][0] - m[0][1]) * t, 0.5 * s)
    if m[0][0] < m[1][1]:
        i = 2 if m[1][1] < m[2][2] else 1
    else:
        i = 2 if m[0][0] < m[2][2] else 0
    j, k = (i + 1) % 3, (i + 2) % 3
    s = math.sqrt(m[i][i] - m[j][j] - m[k][k] + 1.0)
    t = 0.5 / s
    q = [0.0, 0.0, 0.0, (m[k][j] - m[j][k]) * t]
    q[i], q[j], q[k] = 0.5 * s, (m[j][i] + m[i][j]) * t, (m[k][i] + m[i][k]) * t
    return (q[0], q[1], q[2], q[3])


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Returns v rotated by q."""
    m = matrix(q)
    return turned(m, v)


def turned(m: Matrix, v: Vector) -> Vector:
    """Returns m v."""
    return (
        m[0][0] * v[0] + m[0][1] * v[1] + m[0][2] * v[2],
        m[1][0] * v[0] + m[1][1] * v[1] + m[1][2] * v[2],
        m[2][0] * v[0] + m[2][1] * v[1] + m[2][2] * v[2],
    )


def compose(a: Pose, b: Pose) -> Pose:
    """Returns a_from_c of a_from_b and b_from_c; unit quaternions keep their length."""
    moved = rotate(a[1], b[0])
    position = (a[0][0] + moved[0], a[0][1] + moved[1], a[0][2] + moved[2])
    return position, product(a[1], b[1])


def inverse(a: Pose) -> Pose:
    """Returns b_from_a of a_from_b, for a unit quaternion."""
    back = conjugate(a[1])
    x, y, z = rotate(back, a[0])
    return (-x, -y, -z), back


def cross(a: Vector, b: Vector) -> Vector:
    """Returns a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def from_euler(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Returns the rotation of URDF's fixed-axis angles."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    x, y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
    z, w = cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return (x / length, y / length, z / length, w / length)


def getQuaternionFromEuler(eulerAngles: Any, physicsClientId: int = 0) -> Quaternion:
    """Converts roll, pitch, yaw about fixed axes, as in URDF, to x y z w."""
    del physicsClientId
    return from_euler(*vector(eulerAngles, "Euler angles need a 3 coordinates [roll, pitch, yaw]."))


def getEulerFromQuaternion(quaternion: Any, physicsClientId: int = 0) -> Vector:
    """Converts x y z w to roll, pitch, yaw about fixed axes, as in URDF."""
    del physicsClientId
    x, y, z, w = _quaternion(quaternion, "Quaternion need a 4 components [x,y,z,w].")
    sarg = -2.0 * (x * z - w * y)
    if sarg <= -0.99999:
        return (0.0, -0.5 * math.pi, 2.0 * math.atan2(x, -y))
    if sarg >= 0.99999:
        return (0.0, 0.5 * math.pi, 2.0 * math.atan2(-x, y))
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    return (
        math.atan2(2.0 * (y * z + w * x), ww - xx - yy + zz),
        math.asin(sarg),
        math.atan2(2.0 * (x * y + w * z), ww + xx - yy - zz),
    )


def getMatrixFromQuaternion(quaternion: Any, physicsClientId: int = 0) -> tuple[float, ...]:
    """Returns nine numbers, row by row."""
    del physicsClientId
    m = matrix(_quaternion(quaternion, "Couldn't convert quaternion [x,y,z,w]."))
    return (*m[0], *m[1], *m[2])


def multiplyTransforms(
    positionA: Any, orientationA: Any, positionB: Any, orientationB: Any, physicsClientId: int = 0
) -> Pose:
    """Returns a_from_c of a_from_b and b_from_c."""
    del physicsClientId
    text = "Invalid input: expected positionA [x,y,z], orientationA [x,y,z,w], positionB, orientationB."
    a = (vector(positionA, text), _quaternion(orientationA, text))
    b = (vector(positionB, text), _quaternion(orientationB, text))
    position, orientation = compose(a, b)
    return position, from_matrix(matrix(orientation))


def invertTransform(position: Any, orientation: Any, physicsClientId: int = 0) -> Pose:
    """Returns b_from_a of a_from_b."""
    del physicsClientId
    text = "Invalid input: expected position [x,y,z] and orientation [x,y,z,w]."
    origin, turn = inverse((vector(position, text), _quaternion(orientation, text)))
    return origin, from_matrix(matrix(turn))


def getDifferenceQuaternion(quaternionStart: Any, quaternionEnd: Any, physicsClientId: int = 0) -> Quaternion:
    """Returns the rotation from the start to the end."""
    del physicsClientId
    start, end = _pair(quaternionStart, quaternionEnd)
    return _difference(start, end)


def getAxisAngleFromQuaternion(quaternion: Any, physicsClientId: int = 0) -> tuple[Vector, float]:
    """Returns the axis, and the angle about it in 0 to 2 pi."""
    del physicsClientId
    q = _quaternion(quaternion, "Quaternion need a 4 components [x,y,z,w].")
    x, y, z, w = q
    square = 1.0 - w * w
    if square < 10.0 * _EPSILON:
        return (1.0, 0.0, 0.0), _angle(q)
    s = 1.0 / math.sqrt(square)
    return (x * s, y * s, z * s), _angle(q)


def getQuaternionFromAxisAngle(axis: Any, angle: float, physicsClientId: int = 0) -> Quaternion:
    """Returns the rotation about an axis of any length; a zero axis means x."""
    del physicsClientId
    x, y, z = vector(axis, "Require axis [x,y,z] and angle.")
    length = math.sqrt(x * x + y * y + z * z)
    if length < _EPSILON:
        (x, y, z), length = (1.0, 0.0, 0.0), 1.0
    s = math.sin(angle / 2) / length
    return (x * s, y * s, z * s, math.cos(angle / 2))


def getAxisDifferenceQuaternion(quaternionStart: Any, quaternionEnd: Any, physicsClientId: int = 0) -> Vector:
    """Returns the difference as angles about x, y and z."""
    del physicsClientId
    start, end = _pair(quaternionStart, quaternionEnd)
    m = matrix(product(conjugate(start), end))
    if m[2][0] <= -1.0:
        return (-math.atan2(m[0][1], m[1][1]), -0.5 * math.pi, 0.0)
    if m[2][0] >= 1.0:
        return (math.atan2(m[0][1], m[1][1]), 0.5 * math.pi, 0.0)
    return (
        math.atan2(-m[2][1], m[2][2]),
        math.asin(m[2][0]),
        math.atan2(-m[1][0], m[0][0]),
    )


def calculateVelocityQuaternion(
    quaternionStart: Any, quaternionEnd: Any, deltaTime: float, physicsClientId: int = 0
) -> Vector:
    """Returns the angular velocity from the start to the end, rad/s."""
    del physicsClientId
    start, end = _pair(quaternionStart, quaternionEnd)
    turn = _difference(start, end)
    x, y, z, _ = turn
    length = math.sqrt(x * x + y * y + z * z)
    (x, y, z), length = ((1.0, 0.0, 0.0), 1.0) if length < _EPSILON else ((x, y, z), length)
    speed = _angle(turn) / (deltaTime * length)
    return (x * speed, y * speed, z * speed)


def getQuaternionSlerp(
    quaternionStart: Any, quaternionEnd: Any, interpolationFraction: float, physicsClientId: int = 0
) -> Quaternion:
    """Interpolates between the two, along the shorter way: 0 is the start, 1 the end."""
    del physicsClientId
    start, end = _pair(quaternionStart, quaternionEnd)
    magnitude = math.sqrt(sum(a * a for a in start) * sum(b * b for b in end))
    dot = sum(a * b for a, b in zip(start, end, strict=True))
    cosine = abs(dot / magnitude) if magnitude > 0.0 else 1.0
    if cosine >= 1.0 - _EPSILON:
        return start
    angle = math.acos(cosine)
    sine = math.sin(angle)
    a = math.sin((1.0 - interpolationFraction) * angle) / sine
    b = math.sin(interpolationFraction * angle) / sine * (-1.0 if dot < 0.0 else 1.0)
    return (
        start[0] * a + end[0] * b,
        start[1] * a + end[1] * b,
        start[2] * a + end[2] * b,
        start[3] * a + end[3] * b,
    )


def rotateVector(quaternion: Any, vector: Any, physicsClientId: int = 0) -> Vector:
    """Returns the vector rotated by the quaternion."""
    del physicsClientId
    text = "Require quaternion with 4 components [x,y,z,w] and a vector [x,y,z]."
    x, y, z, w = _quaternion(quaternion, text)
    a, b, c = _vector(vector, text)
    # q v q*: a length of q other than one scales, as in PyBullet.
    turn = product(product((x, y, z, w), (a, b, c, 0.0)), (-x, -y, -z, w))
    return turn[:3]


def _difference(start: Quaternion, end: Quaternion) -> Quaternion:
    if sum(a * b for a, b in zip(start, end, strict=True)) < 0.0:
        end = (-end[0], -end[1], -end[2], -end[3])
    return product(end, conjugate(start))


def _angle(q: Quaternion) -> float:
    return 2.0 * math.acos(max(-1.0, min(1.0, q[3])))


def _pair(start: Any, end: Any) -> tuple[Quaternion, Quaternion]:
    text = "Require start and end quaternion, each with 4 components [x,y,z,w]."
    return _quaternion(start, text), _quaternion(end, text)


# PyBullet names these functions' arguments as the readers of arguments are named.
_quaternion = quaternion
_vector = vector

__all__ = [
    "calculateVelocityQuaternion",
    "getAxisAngleFromQuaternion",
    "getAxisDifferenceQuaternion",
    "getDifferenceQuaternion",
    "getEulerFromQuaternion",
    "getMatrixFromQuaternion",
    "getQuaternionFromAxisAngle",
    "getQuaternionFromEuler",
    "getQuaternionSlerp",
    "invertTransform",
    "multiplyTransforms",
    "rotateVector",
]
