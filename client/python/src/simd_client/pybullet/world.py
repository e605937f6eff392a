"""One connection: the robots that a script sees, and its steps.

A step costs one round trip: motors are sent with it, its answer has the joint states, and
readings are answered from those.
"""

from __future__ import annotations

import sys
import uuid
from typing import TYPE_CHECKING

from simd_client.proto import (
    DeleteEntityRequest,
    GetJointLayoutRequest,
    GetPhysicsRequest,
    GetSimulationStateRequest,
    Integrator,
    JointLayout,
    JointReset,
    ListEntitiesRequest,
    NextJointStatesRequest,
    Physics,
    ResetJointsRequest,
    ResetSimulationRequest,
    RobotTargets,
    SetJointPropertiesRequest,
    SetJointTargetsRequest,
    SetLinkPropertiesRequest,
    SetPhysicsRequest,
    SetSimulationStateRequest,
    SimulationState,
    StepSimulationRequest,
    methods,
)
from simd_client.surface import surfaces_to_proto

from . import bodies, motors
from .ball_motors import ball_target
from .bodies import Body, BodyJoint
from .errors import error
from .kept import Camera, Notes
from .primitives import Shapes
from .put_back import put_back
from .readings import Readings
from .targets import joint_target

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from google.protobuf.internal.containers import RepeatedCompositeFieldContainer

    from simd_client.proto import EntityInfo, RobotScene
    from simd_client.surface import Surface

    from .arguments import Pose, Vector
    from .constraints import Constraint
    from .log import Log
    from .sliders import Sliders
    from .wire import Wire


# How long stepSimulation waits for the next state of a world that plays, seconds.
_NEXT_STATE = 1.0
# PyBullet's time step, until a script sets another.
TIME_STEP = 1.0 / 240.0


class World(Readings):
    """The daemon's world as one script sees it."""

    def __init__(self, wire: Wire, method: int, sliders: Sliders, child: bool) -> None:
        super().__init__(wire)
        # The method that the script gave to `connect`.
        self.method = method
        # The daemon was started for this script.
        self.child = child
        # The script's robots are removed at its end, also from a daemon that was running.
        self.removes_robots = False
        # Robots of other clients were in the world when the script connected.
        self.guest = False
        # Settings of an unused world before the script changed them, and whether it played.
        self._found: tuple[Physics, bool] | None = None
        # As they were last read.
        self.physics = Physics()
        self.sliders = sliders
        self.search_paths: list[str] = []
        self.gravity: Vector = (0.0, 0.0, 0.0)
        self.time_step = TIME_STEP
        self.substeps = 0
        self.bodies: dict[int, Body] = {}
        self._waiting: dict[tuple[int, int], None] = {}
        # Joints to be put elsewhere, by robot: position and velocity by the joint's name and axis. They go with the next call
        # of any kind.
        self._resets: dict[str, dict[tuple[str, int], JointReset]] = {}
        wire.before = self._send_resets
        # Pairs of body and link that the script switched off or on, the smaller first.
        self.pairs: dict[tuple[tuple[int, int], tuple[int, int]], bool] = {}
        self.constraints: dict[int, Constraint] = {}
        self.next_constraint = 1
        self.camera = Camera()
        # How many of loadTexture's there are.
        self.textures = 0
        self.notes = Notes()
        self.collision_shapes = Shapes()
        self.visual_shapes = Shapes()
        # Shapes of robots by name.
        self.scenes: dict[str, RobotScene] = {}
        self._said: set[str] = set()
        self._saved_states = 0
        self._recordings = 0
        self._script = uuid.uuid4().hex[:8]
        # What runs after each step: state logs.
        self._logs: dict[int, Log] = {}
        self._next_log = 0

    # Bodies.

    def body(self, unique_id: int, refusal: str) -> Body:
        """The body of that number.

        Raises:
            error: with `refusal`, if there is none.
        """
        found = self.bodies.get(unique_id)
        if found is None:
            raise error(refusal)
        return found

    def numbers(self) -> dict[tuple[str, str], tuple[int, int]]:
        """PyBullet's numbers by the names of robot and link."""
        return {
            (body.robot, name): (body.unique_id, number)
            for body in self.bodies.values()
            for number, name in enumerate((body.base_link, *(joint.link for joint in body.joints)), start=-1)
        }

    def add(
        self, entity: EntityInfo, frames: Mapping[str, Pose], own: bool, urdf: bytes | None = None
    ) -> Body:
        """Adds a robot of the daemon's world, under the smallest free number."""
        layout = self._layout(entity)
        free = next(number for number in range(len(self.bodies) + 1) if number not in self.bodies)
        made = bodies.body(free, entity, layout, frames, own, urdf)
        self.bodies[free] = made
        self.forget_states()
        return made

    def _layout(self, entity: EntityInfo) -> JointLayout:
        if len(entity.links) == 1:
            # Without a joint there is nothing to ask.
            return JointLayout(robot=entity.name, layout_version=entity.layout_version)
        return self.wire.call(methods.GetJointLayout, GetJointLayoutRequest(robot=entity.name)).layout

    def sync(self) -> None:
        """Updates the list of robots with those that other clients spawned and deleted."""
        entities = self.wire.call(methods.ListEntities, ListEntitiesRequest()).entities
        there = {entity.name: entity for entity in entities}
        for number, known in list(self.bodies.items()):
            entity = there.pop(known.robot, None)
            if entity is None:
                self._drop(number)
            elif entity.layout_version != known.layout_version:
                # Reloaded, by another client or by a restored state.
                self.replaced(known, entity, known.frames if known.own else {}, known.urdf)
        for entity in there.values():
            self.add(entity, {}, own=False)

    def remove(self, body: Body) -> None:
        """Removes a robot from the daemon's world."""
        self.wire.call(methods.DeleteEntity, DeleteEntityRequest(robot=body.robot))
        self._drop(body.unique_id)

    def replaced(
        self, body: Body, entity: EntityInfo, frames: Mapping[str, Pose], urdf: bytes | None
    ) -> Body:
        """The same robot with another description; motors are kept by joint name."""
        layout = self._layout(entity)
        made = bodies.body(body.unique_id, entity, layout, frames, body.own, urdf)
        made.files, made.noted, made.scale = body.files, body.noted, body.scale
        made.paths, made.file, made.made_of = body.paths, body.file, body.made_of
        made.colors = body.colors
        made.self_collision, made.divided = body.self_collision, body.divided
        made.parent_flags = body.parent_flags
        self.set_surfaces(made, body.surfaces)
        for joint in made.joints:
            place = body.by_joint.get(joint.name)
            if place is not None:
                joint.motor, joint.sensor = body.joints[place].motor, body.joints[place].sensor
                joint.ball = joint.ball and (body.joints[place].ball or joint.ball)
        self.bodies[body.unique_id] = made
        for key in [(n, i) for n, i in self._waiting if n == made.unique_id]:
            # A joint that follows another now has no motor.
            if key[1] >= len(made.joints) or not made.joints[key[1]].has_motor:
                del self._waiting[key]
        self.forget_states()
        return made

    def set_surfaces(self, body: Body, surfaces: Mapping[str, Surface]) -> None:
        """Sets friction and restitution of links, also for when the robot is loaded again."""
        known = {link: surface for link, surface in surfaces.items() if link in body.link_places}
        if known:
            request = SetLinkPropertiesRequest(robot=body.robot, links=surfaces_to_proto(known))
            self.wire.call(methods.SetLinkProperties, request)
            self.forget_properties(body)
            body.surfaces.update(known)

    def _drop(self, number: int) -> None:
        robot = self.bodies.pop(number).robot
        self.notes.forget(number)
        self.pairs = {key: on for key, on in self.pairs.items() if number not in (key[0][0], key[1][0])}
        self.scenes.pop(robot, None)
        self.constraints = {n: c for n, c in self.constraints.items() if c.body != number}
        for waiting in [key for key in self._waiting if key[0] == number]:
            del self._waiting[waiting]
        self.forget_states()

    def remove_own(self) -> None:
        """Removes the script's robots from the daemon's world."""
        for body in [body for body in self.bodies.values() if body.own]:
            self.remove(body)

    # The loop.

    def drive(self, body: Body, index: int) -> None:
        """Marks a motor as changed: it is sent with the next step, or at once if the world plays."""
        self._waiting[(body.unique_id, index)] = None

    def put_joints(self, body: Body, joints: Mapping[tuple[str, int], JointReset]) -> None:
        """Puts joints elsewhere, by name and axis."""
        self._resets.setdefault(body.robot, {}).update(joints)
        if self.playing:
            self._send_resets()
        self.forget_states()

    def _send_resets(self) -> None:
        if self._resets:
            resets, self._resets = self._resets, {}
            request = ResetJointsRequest()
            for name, joints in resets.items():
                request.robots.add(robot=name, joints=joints.values())
            self.wire.call(methods.ResetJoints, request)

    def sent_if_playing(self) -> None:
        """Sends the motors at once if the world plays."""
        if self.playing:
            self.flush()

    def flush(self) -> None:
        """Sends the changed motors, and joints that are put elsewhere."""
        self._send_resets()
        if self._waiting:
            request = SetJointTargetsRequest()
            self._put_targets(request.robots)
            self.wire.call(methods.SetJointTargets, request)
            self._sent()

    def step(self) -> None:
        """One step, or the next state of a world that plays by itself."""
        self._advance()
        for log in self._logs.values():
            log(self)

    def _advance(self) -> None:
        """A step without what runs after it."""
        if self.playing:
            self._follow()
        else:
            request = StepSimulationRequest(
                steps=1,
                return_states=True,
                return_link_states=self.wants_links(),
                return_contacts=self.wants_contacts(),
            )
            self._put_targets(request.robots)
            try:
                answer = self.wire.call(methods.StepSimulation, request)
            except error as refusal:
                if refusal.reason != "WRONG_STATE":
                    raise
                # Another client started the world.
                self.now_playing(True)
                self._follow()
            else:
                self._sent()
                self.take_step(answer)

    def _follow(self) -> None:
        """Waits for a state that is newer than the last, in a world that plays by itself."""
        self.flush()
        request = NextJointStatesRequest(after_sequence=self.sequence, timeout=_NEXT_STATE)
        before = self.sequence
        self.take(self.wire.call(methods.NextJointStates, request).states)
        if self.sequence == before:
            # There was no step for a second: another client may have paused the world.
            self.read_state()
            if not self.playing:
                self._advance()

    def _put_targets(self, robots: RepeatedCompositeFieldContainer[RobotTargets]) -> None:
        """Adds the changed motors to a request."""
        by_body: dict[int, list[int]] = {}
        for number, index in self._waiting:
            by_body.setdefault(number, []).append(index)
        for number, joints in by_body.items():
            body = self.bodies[number]
            target = robots.add()
            target.robot = body.robot
            friction: list[tuple[BodyJoint, float]] = []
            for index in joints:
                joint = body.joints[index]
                if joint.ball is not None:
                    turn = body.frame(joint.link)[1]
                    ball_target(joint.name, joint.ball, joint.inertia, self.time_step, turn, target.joints.add())
                    continue
                law = motors.law(joint.motor, joint.inertia, self.time_step)
                joint_target(joint.name, law, target.joints.add())
                if joint.friction + law.friction != joint.friction_sent:
                    friction.append((joint, joint.friction + law.friction))
            if friction:
                self._set_friction(body, friction)

    def _set_friction(self, body: Body, friction: Iterable[tuple[BodyJoint, float]]) -> None:
        request = SetJointPropertiesRequest(robot=body.robot)
        for joint, value in friction:
            request.joints.add(joint=joint.name, friction=value)
            joint.friction_sent = value
        self.wire.call(methods.SetJointProperties, request)

    def _sent(self) -> None:
        """The daemon has the changed motors. A torque lasts one step; then the motor is set again."""
        waiting = self._waiting
        self._waiting = {}
        for number, index in waiting:
            joint = self.bodies[number].joints[index]
            motor = joint.motor if joint.ball is None else joint.ball
            joint.torque_sent = joint.motor.torque or 0.0
            if motor.torque is not None:
                motor.torque = None
                self._waiting[(number, index)] = None

    # The world's settings.

    def set_physics(self, request: SetPhysicsRequest) -> None:
        """Changes only what is given."""
        self._learn(self.wire.call(methods.SetPhysics, request).physics)

    def read_state(self) -> None:
        """Fetches the settings of the world, and whether it plays."""
        self._learn(self.wire.call(methods.GetPhysics, GetPhysicsRequest()).physics)
        state = self.wire.call(methods.GetSimulationState, GetSimulationStateRequest()).state
        self.now_playing(state == SimulationState.SIMULATION_STATE_PLAYING)

    def _learn(self, physics: Physics) -> None:
        self.physics = physics
        self.gravity = (physics.gravity.x, physics.gravity.y, physics.gravity.z)
        self.time_step = physics.time_step
        if self.substeps or physics.substeps > 1:
            self.substeps = physics.substeps

    def retune(self) -> None:
        """Motors' gains are per step: they change with the time step."""
        for body in self.bodies.values():
            if body.own:
                for index, joint in enumerate(body.joints):
                    if joint.has_motor:
                        self.drive(body, index)
        self.sent_if_playing()

    def restored(self) -> None:
        """Fetches everything again after the world was replaced: states, settings, robots."""
        self._waiting.clear()
        self.sync()
        for body in self.bodies.values():
            for joint in body.joints:
                joint.friction_sent = None
        self.read_state()
        self.forget_states()

    def saved_state_number(self) -> int:
        """The number of the next saved state."""
        self._saved_states += 1
        return self._saved_states - 1

    def saved_state_name(self, number: int) -> str:
        """The daemon's name of a saved state of this script."""
        return f"pybullet-{self._script}-{number}"

    def recording_name(self) -> str:
        """The daemon's name of the next recording of this script."""
        self._recordings += 1
        return f"pybullet-{self._script}-{self._recordings - 1}"

    def play(self, playing: bool) -> None:
        """Whether steps come by themselves."""
        self.flush()
        wanted = (
            SimulationState.SIMULATION_STATE_PLAYING if playing else SimulationState.SIMULATION_STATE_PAUSED
        )
        self.wire.call(methods.SetSimulationState, SetSimulationStateRequest(state=wanted))
        self.now_playing(playing)
        self.forget_states()

    def reset(self) -> None:
        """PyBullet's resetSimulation: an empty world without gravity. If other clients have robots, only
        the script's own are removed and the settings stay."""
        self.remove_own()
        self._waiting.clear()
        self.constraints.clear()
        self.sliders.remove_own()
        if not self.guest:
            self.wire.call(methods.ResetSimulation, ResetSimulationRequest(time=True))
            request = SetPhysicsRequest()
            request.gravity.SetInParent()
            self.set_physics(request)
        self.forget_states()

    def begin(self) -> None:
        """Sets an unused world to PyBullet's defaults: paused, no gravity, 240 Euler steps per second."""
        self.sync()
        self.guest = bool(self.bodies)
        self.read_state()
        if not self.guest:
            self._found = self.physics, self.playing
            self.play(False)
            # PyBullet's own step is a semi-implicit Euler.
            euler = Integrator.INTEGRATOR_EULER
            request = SetPhysicsRequest(time_step=TIME_STEP, substeps=1, integrator=euler)
            request.gravity.SetInParent()
            self.set_physics(request)

    def start_log(self, log: Log) -> int:
        """Adds a listener. Returns its number."""
        number = self._next_log
        self._next_log += 1
        self._logs[number] = log
        return number

    def stop_log(self, number: int) -> None:
        """Removes a listener, if there is one."""
        log = self._logs.pop(number, None)
        if log is not None:
            log.close()

    def say_once(self, sentence: str) -> None:
        """Prints a warning, the first time only."""
        if sentence not in self._said:
            self._said.add(sentence)
            print(f"simd: {sentence}", file=sys.stderr)

    def close(self) -> None:
        """Ends the connection, and removes the script's robots if that was asked for."""
        for number in list(self._logs):
            self.stop_log(number)
        try:
            if self.removes_robots:
                self.remove_own()
            elif not self.child:
                self.flush()
            self.sliders.remove_own()
            if not self.child:
                put_back(self, self._found)
        finally:
            self.wire.close()
