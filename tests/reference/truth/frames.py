"""Scenes drawn from the side: the collision shapes, at a simulator's positions."""

import mujoco
import numpy as np
import scenes_in_mujoco
from matplotlib.patches import Circle, Polygon

COLOURS = ("#74a9cf", "#fd8d3c", "#78c679", "#9e9ac8")


class Drawing:
    """Draws a scene's shapes by views; MuJoCo's model of it has the positions of a robot's shapes."""

    def __init__(self, scene, across=0):
        """The picture's horizontal axis is x, or y if `across` is 1; its vertical axis is z."""
        self.world = scenes_in_mujoco.World(scene, "default")
        self.axes = [across, 2]

    def draw(self, axes, view, box, title):
        """`box`: left, right, bottom and top of the shown area, m."""
        world, (left, right, bottom, top) = self.world, box
        data, compiled = world.data, world.model
        data.qpos[world.joints] = view.joints
        if world.bodies:
            first = compiled.jnt_qposadr[compiled.body_jntadr[world.bodies]]
            data.qpos[first[:, None] + [0, 1, 2]] = view.roots[:, :3]
            data.qpos[first[:, None] + [4, 5, 6, 3]] = view.roots[:, 3:7]
        mujoco.mj_kinematics(compiled, data)
        # Fixed shapes lie behind, then shapes that are farther away.
        for geom in np.lexsort((data.geom_xpos[:, 1 - self.axes[0]], compiled.geom_bodyid > 0)):
            at, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
            kind, size = compiled.geom_type[geom], compiled.geom_size[geom]
            fixed = compiled.geom_bodyid[geom] == 0
            colour = "#bbbbbb" if fixed else COLOURS[compiled.geom_bodyid[geom] % len(COLOURS)]
            style = {"facecolor": colour, "edgecolor": "#333333", "lw": 0.5, "alpha": 0.85}
            if kind == mujoco.mjtGeom.mjGEOM_PLANE:
                axes.axhspan(bottom, at[2], color="#dddddd", zorder=0)
            elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
                axes.add_patch(Circle(at[self.axes], size[0], **style))
            else:
                axes.add_patch(Polygon(outline((at + corners(kind, size) @ turn.T)[:, self.axes]), **style))
        axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal", title=title)
        axes.tick_params(labelsize=7)
        axes.title.set_fontsize(9)


def corners(kind, size):
    """Returns points whose hull is the shape, in its axes."""
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return np.array(np.meshgrid(*([-edge, edge] for edge in size))).reshape(3, -1).T
    turns = np.linspace(0, 2 * np.pi, 24)
    return np.array([[size[0] * np.cos(t), size[0] * np.sin(t), end] for t in turns for end in (-size[1], size[1])])


def outline(points):
    """Returns the convex hull of points in a plane: Andrew's monotone chain (1979)."""
    points = sorted(map(tuple, points))

    def half(points):
        out = []
        for x, y in points:
            while len(out) > 1 and ((out[-1][0] - out[-2][0]) * (y - out[-2][1])
                                    <= (out[-1][1] - out[-2][1]) * (x - out[-2][0])):
                out.pop()
            out.append((x, y))
        return out[:-1]
    return half(points) + half(points[::-1])
