// A small arm of our own, of primitives: something to move in an empty world, without any file.

interface Part {
  link: string;
  /** Kilograms; metres. */
  mass: number;
  radius: number;
  length: number;
  color: string;
}

/** Capsule-like links along z, each on the joint at the end of its parent. */
const PARTS: readonly (Part & { joint: string; axis: string; limit: number; effort: number })[] = [
  { link: "turret", joint: "waist", axis: "0 0 1", limit: 3.1, effort: 60, mass: 2.4, radius: 0.06, length: 0.16, color: "0.22 0.26 0.32 1" },
  { link: "upper_arm", joint: "shoulder", axis: "0 1 0", limit: 2, effort: 60, mass: 1.8, radius: 0.045, length: 0.34, color: "0.96 0.52 0.12 1" },
  { link: "forearm", joint: "elbow", axis: "0 1 0", limit: 2.5, effort: 40, mass: 1.2, radius: 0.038, length: 0.28, color: "0.96 0.52 0.12 1" },
  { link: "wrist", joint: "wrist_roll", axis: "0 0 1", limit: 3.1, effort: 12, mass: 0.5, radius: 0.032, length: 0.1, color: "0.22 0.26 0.32 1" },
  { link: "hand", joint: "wrist_pitch", axis: "0 1 0", limit: 1.9, effort: 12, mass: 0.3, radius: 0.028, length: 0.08, color: "0.85 0.87 0.9 1" },
];

const PLINTH: Part = { link: "base", mass: 6, radius: 0.11, length: 0.06, color: "0.22 0.26 0.32 1" };

/** Its URDF. */
export function demoArm(): string {
  const joints = PARTS.map(({ link, joint, axis, limit, effort }, index) => {
    const parent = PARTS[index - 1] ?? PLINTH;
    return (
      `<joint name="${joint}" type="revolute"><parent link="${parent.link}"/><child link="${link}"/>` +
      `<origin xyz="0 0 ${parent.length}"/><axis xyz="${axis}"/>` +
      `<limit lower="${-limit}" upper="${limit}" effort="${effort}" velocity="3"/><dynamics damping="0.2"/></joint>`
    );
  });
  return `<?xml version="1.0"?>\n<robot name="demo_arm">\n${[PLINTH, ...PARTS].map(linkText).join("\n")}\n${joints.join("\n")}\n</robot>\n`;
}

/** A cylinder of uniform density from the link's frame upwards. */
function linkText({ link, mass, radius, length, color }: Part): string {
  const across = (mass * (3 * radius ** 2 + length ** 2)) / 12;
  const along = (mass * radius ** 2) / 2;
  const origin = `<origin xyz="0 0 ${length / 2}"/>`;
  const geometry = `<geometry><cylinder radius="${radius}" length="${length}"/></geometry>`;
  return (
    `<link name="${link}"><inertial>${origin}<mass value="${mass}"/>` +
    `<inertia ixx="${across}" iyy="${across}" izz="${along}" ixy="0" ixz="0" iyz="0"/></inertial>` +
    `<visual>${origin}${geometry}<material name="${link}_paint"><color rgba="${color}"/></material></visual>` +
    `<collision>${origin}${geometry}</collision></link>`
  );
}
