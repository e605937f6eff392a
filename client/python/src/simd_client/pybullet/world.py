"""One connection: the robots that a script sees, its settings, and its end."""

from __future__ import annotations

import uuid
from time import perf_counter
from typing import TYPE_CHECKING

from simd_client.proto import (
    Integrator,
    Physics,
    ResetSimulationRequest,
    SetPhysicsRequest,
    SetSimulationStateRequest,
    SimulationState,
    SurfaceCombination,
    methods,
)

from . import outside_limits
from .input_queue import InputQueue
from .script_state import Camera
from .loop import TIME_STEP
from .primitives import Shapes
from .initial_settings import restore
from .robot_list import Robots

if TYPE_CHECKING:
    from .log import Log
    from .renderer import Renderer
    from .restoring import Saved
    from .sliders import Sliders
    from .wire import Wire


class World(Robots):
    """The daemon's world as one script sees it."""

    def __init__(self, wire: Wire, method: int, sliders: Sliders, renderer: Renderer, child: bool) -> None:
        super().__init__(wire)
        # Number of the connection.
        self.number = 0
        # Method that the script gave to `connect`.
        self.method = method
        # Whether the daemon was started for this script.
        self.child = child
        # Whether the script's robots are removed at its end, also from a daemon that was running.
        self.removes_robots = False
        # Whether joints with <mimic> follow others.
        self.keeps_mimic = False
        # Whether other clients had robots in the world when the script connected.
        self.guest = False
        # Settings of an unused world before the script changed them, and whether it played.
        self._found: tuple[Physics, bool] | None = None
        self.sliders = sliders
        self.renderer = renderer
        self.input = InputQueue(wire)
        self.search_paths: list[str] = []
        self.camera = Camera()
        # The daemon's number of the script's last camera.
        self.camera_version = 0
        # Camera of a page, if it had one, and the wall time at which the daemon was asked.
        self.page_camera: tuple[float, Camera | None] | None = None
        # Number of loadTexture's textures.
        self.textures = 0
        self.collision_shapes = Shapes()
        self.visual_shapes = Shapes()
        # Commands of the script when it saved states, by the daemon's names of them.
        self.saved: dict[str, Saved] = {}
        self._saved_states = 0
        self._constraint_names = 0
        self._recordings = 0
        self._script = uuid.uuid4().hex[:8]
        # Time of the last step's request, by perf_counter.
        self.step_began = 0.0
        # Listeners after each step: state logs.
        self._logs: dict[int, Log] = {}
        self._next_log = 0

    # The loop.

    def step(self) -> None:
        """Makes one step, or waits for the next state of a playing world."""
        self.step_began = perf_counter()
        self.advance()
        if self.beyond:
            outside_limits.settle(self)
        for log in self._logs.values():
            log(self)

    # The world's settings.

    def retune(self) -> None:
        """Updates the motors: their gains are per step, so they change with the time step."""
        for body in self.bodies.values():
            if body.own:
                self.drive(body, (index for index, joint in enumerate(body.joints) if joint.has_motor))
        self.sent_if_playing()

    def restored(self) -> None:
        """Fetches everything again after the world was replaced: states, settings, robots."""
        self.sync()
        self.read_state()
        self.forget_states()

    @property
    def names(self) -> str:
        """Prefix of the daemon's names of this script's saved states, constraints and recordings."""
        return f"pybullet-{self._script}-"

    def saved_state_number(self) -> int:
        """Returns the number of the next saved state."""
        self._saved_states += 1
        return self._saved_states - 1

    def saved_state_name(self, number: int) -> str:
        """Returns the daemon's name of a saved state of this script."""
        return f"{self.names}{number}"

    def constraint_name(self) -> str:
        """Returns the daemon's name of the next constraint of this script. It is unique: a restored state may
        bring old ones back."""
        self._constraint_names += 1
        return f"{self.names}{self._constraint_names - 1}"

    def recording_name(self) -> str:
        """Returns the daemon's name of the next recording of this script."""
        self._recordings += 1
        return f"{self.names}{self._recordings - 1}"

    def play(self, playing: bool) -> None:
        """Sets whether the world makes steps automatically."""
        self.flush()
        wanted = (
            SimulationState.SIMULATION_STATE_PLAYING if playing else SimulationState.SIMULATION_STATE_PAUSED
        )
        self.wire.call(methods.SetSimulationState, SetSimulationStateRequest(state=wanted))
        self.now_playing(playing)
        # Torques wait for a step, and the world now makes steps automatically.
        self.sent_if_playing()
        self.forget_states()

    def reset(self) -> None:
        """Implements PyBullet's resetSimulation: an empty world without gravity. If other clients have
        robots, only the script's own are removed and the settings stay."""
        self.remove_own()
        if not self.bodies:
            # As in PyBullet, bodies and shapes count from 0 again.
            self.count_from_zero()
            self.collision_shapes, self.visual_shapes = Shapes(), Shapes()
        self._waiting.clear()
        self.solver_iterations, self.inner_iterations = 50, 1
        self.constraints.clear()
        self.next_constraint = 1
        self.sliders.remove_own()
        self.drawings.remove_all()
        if not self.guest:
            self.wire.call(methods.ResetSimulation, ResetSimulationRequest(time=True))
            request = SetPhysicsRequest(integrator=Integrator.INTEGRATOR_BULLET)
            request.gravity.SetInParent()
            self.set_physics(request)
        self.forget_states()

    def begin(self) -> None:
        """Sets an unused world to PyBullet's defaults: paused, no gravity, 240 of Bullet's steps per second, products of frictions."""
        self.sync()
        self.guest = bool(self.bodies)
        self.read_state()
        if not self.guest:
            self._found = self.physics, self.playing
            self.play(False)
            bullet = Integrator.INTEGRATOR_BULLET
            product = SurfaceCombination.SURFACE_COMBINATION_MULTIPLY
            request = SetPhysicsRequest(
                time_step=TIME_STEP, substeps=1, integrator=bullet, surface_combination=product
            )
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

    def close(self) -> None:
        """Ends the connection, and removes the script's robots if requested."""
        for number in list(self._logs):
            self.stop_log(number)
        self.renderer.end()
        try:
            if self.removes_robots:
                self.remove_own()
            elif not self.child:
                self.flush()
            self.link_colors.flush()
            self.sliders.remove_own()
            self.drawings.remove_all()
            if not self.child:
                restore(self, self._found)
        finally:
            self.wire.close()
