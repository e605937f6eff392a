// Recordings for tests, written with third-party packages: MCAP's writer, LZ4's, and Foxglove's for messages of ROS 2.
import { McapWriter } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageWriter } from "@foxglove/rosmsg2-serialization";
import { compress } from "lz4js";

const TIME = "builtin_interfaces/Time stamp\nstring frame_id";
const HEADER = `================================================================================\nMSG: std_msgs/Header\n${TIME}\n`;
const TF = `geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
${HEADER}`;
const JOINTS = `std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n${HEADER}`;

const writer = (definition: string): MessageWriter => new MessageWriter(parse(definition, { ros2: true }));
const writers = { tf: writer(TF), joints: writer(JOINTS), clock: writer("builtin_interfaces/Time clock"), string: writer("string data") };

/** Contents of the recording to write. */
export interface Wanted {
  states: number;
  /** Bytes after which a chunk ends. A state takes some 600. */
  chunkSize: number;
  /** Whether it is completed. */
  end: boolean;
  format: string;
  compression: "lz4" | "";
}

/** The position of the joint in a state. */
export function positionOf(state: number): number {
  return Math.sin(state / 10);
}

/** Returns the bytes of a recording of an arm with one joint, 100 states a second. */
export async function recording(wanted: Partial<Wanted> = {}): Promise<Uint8Array<ArrayBuffer>> {
  const { states, chunkSize, end, format, compression }: Wanted = { states: 100, chunkSize: 4000, end: true, format: "1", compression: "lz4", ...wanted };
  const parts: Uint8Array[] = [];
  let size = 0n;
  const sink = {
    position: () => size,
    async write(bytes: Uint8Array) {
      parts.push(bytes.slice());
      size += BigInt(bytes.length);
    },
  };
  const mcap = new McapWriter({
    writable: sink,
    chunkSize,
    ...(compression === "lz4" && { compressChunk: (data: Uint8Array) => ({ compression: "lz4", compressedData: new Uint8Array(compress(data)) }) }),
  });
  await mcap.start({ profile: "ros2", library: "test" });
  await mcap.addMetadata({ name: "simd.recording", metadata: new Map([["format", format]]) });
  const channel = async (topic: string): Promise<number> =>
    mcap.registerChannel({ schemaId: await mcap.registerSchema({ name: topic, encoding: "ros2msg", data: new Uint8Array() }), topic, messageEncoding: "cdr", metadata: new Map() });
  const ids = { clock: await channel("/clock"), joints: await channel("/arm_1/joint_states"), tf: await channel("/tf"), fixed: await channel("/tf_static"), urdf: await channel("/arm_1/robot_description") };
  const time = 1_700_000_000_000_000_000n;
  for (let state = 0; state < states; state += 1) {
    const seconds = state / 100;
    const stamp = { sec: Math.floor(seconds), nanosec: Math.round((seconds % 1) * 1e9) };
    const logTime = time + BigInt(state) * 10_000_000n;
    const transform = (parent: string, child: string, x: number) => ({
      header: { stamp, frame_id: parent },
      child_frame_id: child,
      transform: { translation: { x, y: 0, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } },
    });
    const put = (channelId: number, data: Uint8Array): Promise<void> => mcap.addMessage({ channelId, data, logTime, publishTime: logTime, sequence: 0 });
    await put(ids.clock, writers.clock.writeMessage({ clock: stamp }));
    const position = positionOf(state);
    await put(ids.joints, writers.joints.writeMessage({ header: { stamp, frame_id: "" }, name: ["elbow"], position: [position], velocity: [1], effort: [2] }));
    if (state === 0) {
      await put(ids.urdf, writers.string.writeMessage({ data: "<robot name='arm'/>" }));
      await put(ids.fixed, writers.tf.writeMessage({ transforms: [transform("arm-1/link", "arm-1/tool", 3)] }));
    }
    await put(ids.tf, writers.tf.writeMessage({ transforms: [transform("world", "arm-1/base", 1), transform("arm-1/base", "arm-1/link", position)] }));
  }
  if (end) await mcap.end();
  const bytes = new Uint8Array(Number(size));
  let at = 0;
  for (const part of parts) {
    bytes.set(part, at);
    at += part.length;
  }
  return bytes;
}
