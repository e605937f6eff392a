// Reads CDR messages of ROS 2, from which recordings are played: little-endian, numbers aligned to their size.
import { Damage } from "./source";

/** A `sensor_msgs/JointState`. */
export interface JointState {
  /** Simulated seconds. */
  time: number;
  name: string[];
  position: number[];
  velocity: number[];
  effort: number[];
}

/** A transform of a `tf2_msgs/TFMessage`. */
export interface Transform {
  /** Simulated seconds. */
  time: number;
  parent: string;
  child: string;
  /** parent_from_child: x y z, then the quaternion x y z w. */
  pose: Float64Array;
}

const TEXT = new TextDecoder();

/** Reader of a message. Throws if the message ends too soon. */
class Cdr {
  private at = 4;
  private readonly view: DataView;

  constructor(private readonly bytes: Uint8Array) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    // The representation: plain CDR, little-endian.
    if (bytes[0] !== 0 || bytes[1] !== 1) throw new Damage("a message in it is not in little-endian CDR");
  }

  u32(): number {
    return this.view.getUint32(this.take(4), true);
  }

  f64(): number {
    return this.view.getFloat64(this.take(8), true);
  }

  text(): string {
    const length = this.u32();
    const at = this.at;
    if (at + length > this.bytes.length) throw tooShort();
    this.at += length;
    // Its last byte is a zero.
    return TEXT.decode(this.bytes.subarray(at, at + Math.max(0, length - 1)));
  }

  /** Reads the length of a sequence whose elements take at least this many bytes. */
  list<T>(least: number, read: () => T): T[] {
    const length = this.u32();
    if (length * least > this.bytes.length - this.at) throw tooShort();
    return Array.from({ length }, read);
  }

  time(): number {
    const seconds = this.view.getInt32(this.take(4), true);
    return seconds + this.u32() * 1e-9;
  }

  /** Returns the offset of a number of this size. */
  private take(size: number): number {
    // Alignment is counted from the end of the four bytes of the representation.
    const at = 4 + Math.ceil((this.at - 4) / size) * size;
    if (at + size > this.bytes.length) throw tooShort();
    this.at = at + size;
    return at;
  }
}

function tooShort(): Error {
  return new Damage("a message in it ends too soon");
}

/** Reads a `sensor_msgs/JointState`. */
export function jointState(bytes: Uint8Array): JointState {
  const cdr = new Cdr(bytes);
  const time = cdr.time();
  cdr.text();
  const name = cdr.list(4, () => cdr.text());
  const numbers = (): number[] => cdr.list(8, () => cdr.f64());
  return { time, name, position: numbers(), velocity: numbers(), effort: numbers() };
}

/** Reads a `tf2_msgs/TFMessage`. */
export function transforms(bytes: Uint8Array): Transform[] {
  const cdr = new Cdr(bytes);
  return cdr.list(64, () => {
    const time = cdr.time();
    const parent = cdr.text();
    const child = cdr.text();
    const pose = Float64Array.from({ length: 7 }, () => cdr.f64());
    return { time, parent, child, pose };
  });
}

/** Reads a `rosgraph_msgs/Clock`: simulated seconds. */
export function clock(bytes: Uint8Array): number {
  return new Cdr(bytes).time();
}

/** Reads a `std_msgs/String`. */
export function string(bytes: Uint8Array): string {
  return new Cdr(bytes).text();
}
