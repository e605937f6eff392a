// Actuators of joints, fetched each time they are shown: clients change gains at any time.
import { services } from "./services";

/** SI units. */
export interface Actuator {
  /** Gain of position targets in force; absent if the joint has no actuator. */
  stiffness?: number;
  damping?: number;
  /** Inertia of the rotor as felt at the joint; 0 means none. */
  armature: number;
  /** Stiffness of a spring in addition to the actuator; absent without one. */
  spring?: number;
  /** Whether the actuator compensates the weight that the joint carries. */
  gravityCompensation: boolean;
}

/** Returns the actuator of a joint; undefined if the daemon does not report one. */
export async function actuatorOf(robot: string, joint: string): Promise<Actuator | undefined> {
  try {
    const { layout } = await services().joints.getJointLayout({ robot });
    const found = layout?.joints.find(({ name }) => name === joint);
    if (!found) return undefined;
    const { gains, armature, spring, gravityCompensation } = found;
    return { armature, gravityCompensation, ...(gains && { stiffness: gains.stiffness, damping: gains.damping }), ...(spring && { spring: spring.stiffness }) };
  } catch {
    // The robot is gone, or the daemon is lost, which the page reports elsewhere.
    return undefined;
  }
}
