"""The robots that a script sees, by PyBullet's numbers, and what it said of each."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from simd_client.proto import (
    DeleteEntityRequest,
    GetJointLayoutRequest,
    JointLayout,
    ListEntitiesRequest,
    SetLinkPropertiesRequest,
    methods,
)
from simd_client.surface import surfaces_to_proto

from . import bodies
from .bodies import Body
from .drawings import Drawings
from .errors import error
from .script_state import Notes
from .link_colors import LinkColors
from .loop import Loop

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from simd_client.proto import EntityInfo, RobotScene
    from simd_client.surface import Surface

    from .arguments import Pose
    from .constraints import Constraint
    from .wire import Wire


class Robots(Loop):
    """The robots of a world."""

    def __init__(self, wire: Wire) -> None:
        super().__init__(wire)
        # Whether efforts and velocities of URDFs bound the script's commands.
        self.keeps_limits = False
        # Numbers of bodies, in the order of getBodyUniqueId.
        self.serial: list[int] = []
        # Numbers of removed bodies; the last one is assigned next.
        self._freed: list[int] = []
        # See `numbers`; None if it must be made again.
        self._numbers: dict[tuple[str, str], tuple[int, int]] | None = None
        # Pairs of body and link that the script switched off or on, the smaller first.
        self.pairs: dict[tuple[tuple[int, int], tuple[int, int]], bool] = {}
        # Numbers of bodies and joints that are beyond their limits; see `outside_limits.py`.
        self.beyond: dict[tuple[int, int], None] = {}
        self.constraints: dict[int, Constraint] = {}
        self.next_constraint = 1
        self.notes = Notes()
        # Shapes of robots by name.
        self.scenes: dict[str, RobotScene] = {}
        self._said: set[str] = set()
        self.drawings = Drawings(wire, self.say_once)
        self.link_colors = LinkColors(wire, self.say_once)

    def say_once(self, sentence: str) -> None:
        """Prints a warning, the first time only."""
        if sentence not in self._said:
            self._said.add(sentence)
            print(f"simd: {sentence}", file=sys.stderr)

    def body(self, unique_id: int, refusal: str) -> Body:
        """Returns the body with that number.

        Raises:
            error: with `refusal`, if there is none.
        """
        found = self.bodies.get(unique_id)
        if found is None:
            raise error(refusal)
        return found

    def numbers(self) -> Mapping[tuple[str, str], tuple[int, int]]:
        """Returns PyBullet's numbers by the names of robot and link."""
        if self._numbers is None:
            self._numbers = {
                (body.robot, name): (body.unique_id, number)
                for body in self.bodies.values()
                for number, name in enumerate((body.base_link, *(joint.link for joint in body.joints)), start=-1)
            }
        return self._numbers

    def add(
        self,
        entity: EntityInfo,
        frames: Mapping[str, Pose],
        own: bool,
        urdf: bytes | None = None,
        link_order: Sequence[str] = (),
        sites: Collection[str] = (),
    ) -> Body:
        """Adds a robot of the daemon's world, with the last freed number, else the next. Its joints are
        numbered like these links, else as the daemon numbers them; those of sites are left out."""
        layout = self._layout(entity)
        number = self._freed[-1] if self._freed else len(self.bodies)
        made = bodies.body(number, entity, layout, frames, own, urdf, link_order, sites)
        del self._freed[-1:]
        self.bodies[number] = made
        self.serial.append(number)
        self._numbers = None
        self.forget_states()
        self.free_limits(made)
        return made

    def free_limits(self, body: Body) -> None:
        """Removes limits of effort and velocity of the script's joints, which PyBullet reads but ignores."""
        for joint in body.joints if body.own and not self.keeps_limits else ():
            lower, upper, effort, velocity = joint.limits
            if joint.width == 1 and not (effort is None and velocity is None):
                joint.limits = lower, upper, None, None
                self.bound(body, joint, joint.limits)

    def _layout(self, entity: EntityInfo) -> JointLayout:
        if len(entity.links) == 1:
            # Without a joint no request is needed.
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
                # Another client or a restored state reloaded it.
                self.replaced(known, entity, known.frames if known.own else {}, known.urdf)
        for entity in there.values():
            self.add(entity, {}, own=False)

    def remove(self, body: Body) -> None:
        """Removes a robot from the daemon's world."""
        # Its drawings are removed while it still exists.
        self.drawings.flush()
        self.link_colors.flush()
        self.wire.call(methods.DeleteEntity, DeleteEntityRequest(robot=body.robot))
        self._drop(body.unique_id)

    def replaced(
        self, body: Body, entity: EntityInfo, frames: Mapping[str, Pose], urdf: bytes | None
    ) -> Body:
        """Replaces the robot by one with another description; motors are kept by joint name."""
        layout = self._layout(entity)
        made = bodies.body(body.unique_id, entity, layout, frames, body.own, urdf, body.link_order, body.sites)
        made.files, made.kept, made.scale = body.files, body.kept, body.scale
        made.paths, made.file, made.made_of = body.paths, body.file, body.made_of
        made.shape_margin, made.has_round_cylinders = body.shape_margin, body.has_round_cylinders
        made.colors = body.colors
        made.self_collision, made.divided = body.self_collision, body.divided
        made.parent_flags = body.parent_flags
        self.set_surfaces(made, body.surfaces)
        if body.stays_awake is not None:
            self.set_stays_awake(made, body.stays_awake)
        for joint in made.joints:
            index = body.by_joint.get(joint.name)
            if index is not None:
                joint.motor, joint.sensor = body.joints[index].motor, body.joints[index].sensor
                joint.ball = joint.ball and (body.joints[index].ball or joint.ball)
        self.bodies[body.unique_id] = made
        self._numbers = None
        self._forget_beyond(made.unique_id)
        for key in [(n, i) for n, i in self._waiting if n == made.unique_id]:
            # A joint that follows another now has no motor.
            if key[1] >= len(made.joints) or not made.joints[key[1]].has_motor:
                del self._waiting[key]
        self.free_limits(made)
        self.forget_states()
        # Colours belong to their description and are lost with it.
        for link in made.colors:
            self.paint(made, link)
        return made

    def paint(self, body: Body, link: int) -> None:
        """Shows the script's colour of a link, by PyBullet's number."""
        name, color = body.link_name(link), body.colors.get(link)
        if name is not None and color is not None:
            red, green, blue, alpha = (min(max(each, 0.0), 1.0) for each in color)
            self.link_colors.paint(body.robot, name, (red, green, blue, alpha))

    def set_surfaces(self, body: Body, surfaces: Mapping[str, Surface]) -> None:
        """Sets friction and restitution of links, also for later reloads of the robot."""
        known = {link: surface for link, surface in surfaces.items() if link in body.link_indices}
        if known:
            request = SetLinkPropertiesRequest(robot=body.robot, links=surfaces_to_proto(known))
            self.wire.call(methods.SetLinkProperties, request)
            self.forget_properties(body)
            body.surfaces.update(known)

    def set_stays_awake(self, body: Body, stays_awake: bool) -> None:
        """Sets whether a body sleeps, also for later reloads of the robot, and wakes it."""
        self.wire.call(methods.SetLinkProperties, SetLinkPropertiesRequest(robot=body.robot, stays_awake=stays_awake))
        body.stays_awake = stays_awake

    def _drop(self, number: int) -> None:
        robot = self.bodies.pop(number).robot
        self._freed.append(number)
        # As in PyBullet, the last body takes the freed index.
        last = self.serial.pop()
        if last != number:
            self.serial[self.serial.index(number)] = last
        self._numbers = None
        self.notes.forget(number)
        self._forget_beyond(number)
        self.pairs = {key: on for key, on in self.pairs.items() if number not in (key[0][0], key[1][0])}
        self.scenes.pop(robot, None)
        for constraint, made in reversed(list(self.constraints.items())):
            if number in (made.body, made.child):
                self.forget_constraint(constraint)
        self.forget_motors(number, robot)
        self.forget_states()

    def _forget_beyond(self, number: int) -> None:
        self.beyond = {key: None for key in self.beyond if key[0] != number}

    def forget_constraint(self, number: int) -> Constraint | None:
        """Removes a constraint from the script's list, and moves the last one to its index, as in PyBullet.
        The daemon keeps it."""
        made = self.constraints.get(number)
        if made is not None:
            numbers = list(self.constraints)
            last = numbers.pop()
            if last != number:
                numbers[numbers.index(number)] = last
            self.constraints = {each: self.constraints[each] for each in numbers}
        return made

    def remove_own(self) -> None:
        """Removes the script's robots from the daemon's world."""
        for body in [body for body in self.bodies.values() if body.own]:
            self.remove(body)

    def count_from_zero(self) -> None:
        """Numbers the next bodies from 0 again, once there are none."""
        self._freed.clear()
