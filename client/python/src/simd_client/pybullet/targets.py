"""Motor laws as joint targets of the schema."""

from __future__ import annotations

from simd_client.proto import JointTarget

from .motors import Law


def joint_target(joint: str, law: Law, target: JointTarget) -> None:
    """Sets `target` to the law for the joint with that name."""
    target.joint = joint
    kind = law.kind
    if kind == "servo":
        servo = target.servo
        servo.position, servo.velocity = law.value, law.velocity
        servo.rate, servo.slip = law.rate, law.slip
        if law.damping is not None:
            servo.damping = law.damping
        if law.feed_forward:
            servo.feed_forward_effort = law.feed_forward
        if law.max_effort is not None:
            servo.max_effort = law.max_effort
        if law.max_velocity is not None:
            servo.max_velocity = law.max_velocity
    elif kind == "position":
        position = target.position
        position.position = law.value
        if law.velocity:
            position.velocity = law.velocity
        if law.stiffness is not None:
            position.stiffness = law.stiffness
        if law.damping is not None:
            position.damping = law.damping
        if law.feed_forward:
            position.feed_forward_effort = law.feed_forward
        if law.max_effort is not None:
            position.max_effort = law.max_effort
        if law.max_velocity is not None:
            position.max_velocity = law.max_velocity
    elif kind == "velocity":
        velocity = target.velocity
        velocity.velocity = law.value
        if law.damping is not None:
            velocity.damping = law.damping
        if law.feed_forward:
            velocity.feed_forward_effort = law.feed_forward
        if law.max_effort is not None:
            velocity.max_effort = law.max_effort
    elif kind == "effort":
        target.effort.effort = law.value
    else:
        target.passive.SetInParent()
