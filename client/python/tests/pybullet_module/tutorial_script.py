"""A script as PyBullet's users write them: sliders, one controller a joint, a loop. It ends after its turns.

Arguments: the URDF, `position` or `velocity`, the number of turns, and the turn after which it reports that
it is ready.
"""

# PyBullet has no types, and a script is not a typed program.
# pyright: basic, reportMissingImports=false, reportAttributeAccessIssue=false, reportPossiblyUnboundVariable=false

import sys

import pybullet
import pybullet_data

urdf, kind, turns, ready = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])

pybullet.connect(pybullet.GUI)
pybullet.resetSimulation()
pybullet.setAdditionalSearchPath(pybullet_data.getDataPath())
pybullet.setGravity(0, 0, -9.81)
pybullet.setTimeStep(0.001)
robot = pybullet.loadURDF(urdf, [0, 0, 0], useFixedBase=1)

print("joints", pybullet.getNumJoints(robot))
for i in range(pybullet.getNumJoints(robot)):
    info = pybullet.getJointInfo(robot, i)
    print("joint", info[0], info[1], info[2:])


def slider(joint_index: int, lower: float, upper: float, start: float, what: str) -> list:
    name = str(pybullet.getJointInfo(robot, joint_index)[1]) + what
    return [
        joint_index,
        pybullet.addUserDebugParameter(paramName=name, rangeMin=lower, rangeMax=upper, startValue=start),
    ]


position_slider = slider(0, -3.14, 3.14, 0, "PC")
velocity_slider = slider(0, -10, 10, 0, "VC")


def drive_position(controller: list) -> tuple:
    index, item = controller
    wanted = pybullet.readUserDebugParameter(item)
    pybullet.setJointMotorControl2(robot, index, pybullet.POSITION_CONTROL, targetPosition=wanted)
    state = pybullet.getJointState(robot, index)
    return state[0], state[1]


def drive_velocity(controller: list) -> tuple:
    index, item = controller
    wanted = pybullet.readUserDebugParameter(item)
    pybullet.setJointMotorControl2(robot, index, pybullet.VELOCITY_CONTROL, targetVelocity=wanted)
    state = pybullet.getJointState(robot, index)
    return state[0], state[1]


for turn in range(turns):
    if kind == "position":
        joint_position, joint_velocity = drive_position(position_slider)
    else:
        joint_position, joint_velocity = drive_velocity(velocity_slider)
    if turn == ready:
        print("ready", flush=True)
        # A client that moves the slider is shown here.
        sys.stdin.readline()
    pybullet.stepSimulation()
print("at", joint_position, joint_velocity)
pybullet.disconnect()
