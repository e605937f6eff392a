// A recording as a row of states. The index gives their number, and a chunk is read when a state in it is requested.
import { clock, jointState, string, transforms, type JointState, type Transform } from "./cdr";
import { worldPoses, type RobotPoses } from "./frames";
import { McapFile, type ChunkRange, type Message } from "./mcap-file";
import { Damage, type Source } from "./source";

/** Maximum bytes of decompressed chunks in memory. The shown chunk always stays. */
const MAX_KEPT = 64 << 20;
/**
 * Number of chunks that are read at first for descriptions, links that do not move in others, and events. The first two are written
 * once.
 */
const MAX_SAID = 256;
/** Maximum number of listed events. */
const MAX_EVENTS = 1000;
/** Maximum number of sentences about unreadable parts. */
const MAX_PROBLEMS = 20;
/** Milliseconds after a failed read of a chunk until the next request. */
const RETRY = 1000;

/** Ending of topics of joint states. */
const JOINTS = "/joint_states";

/** A state of the world, as messages that are decoded on demand. */
interface RawState {
  time: bigint;
  frames: Uint8Array;
  clock: Uint8Array | undefined;
  /** By topic. */
  joints: ReadonlyMap<string, Uint8Array>;
}

/** A part of the row. */
interface Part {
  file: McapFile;
  chunk: ChunkRange;
  /** The number of its first state, from 0. */
  first: number;
  states: number;
}

/** Event in the schema's form. */
export interface RecordedEvent {
  /** The number of the last state before it. */
  at: number;
  /** `simd.v1.Event`. */
  data: Uint8Array;
}

/** One state. */
export interface RecordedState {
  /** From 0. */
  number: number;
  /** Simulated seconds. */
  simTime: number;
  poses: RobotPoses;
  /** By the robot's name in the form of topics; see `topicPart`. */
  joints: ReadonlyMap<string, JointState>;
}

/** Returns a robot's name in the form of topics, which has no hyphen. */
export function topicPart(robot: string): string {
  return robot.replaceAll("-", "_");
}

/** An open recording. */
export class Timeline {
  /** URDF by the robot's name in the form of topics. */
  readonly descriptions = new Map<string, string>();
  /** Simulated seconds between states. */
  period = 0.01;
  /** Parts that could not be read; empty if all could. */
  readonly problems = new Set<string>();
  private readonly parts: Part[] = [];
  /** Number of states. */
  readonly count: number;
  private readonly chunks = new Map<Part, Promise<RawState[]>>();
  private readonly ready = new Map<Part, RawState[]>();
  /** Links that do not move in others, with the time since when. */
  private readonly fixed: { time: bigint; transforms: Transform[] }[] = [];
  private bytesKept = 0;
  /** `performance.now()` before which no chunk is requested. */
  private notBefore = 0;

  private constructor(files: readonly McapFile[]) {
    let first = 0;
    for (const file of files) {
      if (!file.isComplete) this.problems.add(`${file.source.name} was not completed: it is shown as far as it goes.`);
      for (const chunk of file.chunks) {
        const states = chunk.messages.get("/tf") ?? 0;
        this.parts.push({ file, chunk, first, states });
        first += states;
      }
    }
    this.count = first;
  }

  /** Opens the files of a recording, in their order. Rejects with a sentence. */
  static async open(sources: readonly Source[]): Promise<Timeline> {
    const files: McapFile[] = [];
    for (const source of sources) files.push(await McapFile.open(source));
    const timeline = new Timeline(files);
    if (timeline.count === 0) throw new Error("it has no states that could be shown: it was recorded without them, or is empty");
    await timeline.readWhatIsSaidOnce();
    await timeline.measure();
    return timeline;
  }

  /**
   * Returns a state, which is empty if its chunk is damaged; rejects if that cannot be fetched now. The number is clamped to the range.
   */
  async state(number: number): Promise<RecordedState> {
    const part = this.partOf(this.clamp(number));
    return this.decode(part, await this.load(part), this.clamp(number));
  }

  /** Returns the state if its chunk is in memory; otherwise starts to read the chunk. */
  peek(number: number): RecordedState | undefined {
    const clamped = this.clamp(number);
    const part = this.partOf(clamped);
    const states = this.ready.get(part);
    if (states) {
      // The newest chunk is evicted last.
      this.ready.delete(part);
      this.ready.set(part, states);
      return this.decode(part, states, clamped);
    }
    this.prefetch(clamped);
    return undefined;
  }

  /** Whether the chunk of a state is in memory. */
  isReady(number: number): boolean {
    return this.ready.has(this.partOf(this.clamp(number)));
  }

  /** Reads the chunk of a state, if it exists, into memory. */
  prefetch(number: number): void {
    if (number < 0 || number >= this.count) return;
    // Damage is among the problems, and chunks that cannot be fetched now are requested again.
    this.load(this.partOf(number)).catch(() => undefined);
  }

  /** Returns the first state of the part after the part that has this state. */
  nextPart(number: number): number {
    const part = this.partOf(this.clamp(number));
    return part.first + part.states;
  }

  /** Returns parts of the row with states: the number of the first, and their count. */
  spans(): { first: number; states: number; bytes: number }[] {
    return this.parts.filter(({ states }) => states > 0).map(({ first, states, chunk }) => ({ first, states, bytes: chunk.length }));
  }

  /** Returns joint states of a span, which is read and not kept: one for each written state. */
  async jointsOf(first: number): Promise<ReadonlyMap<string, JointState>[]> {
    const part = this.partOf(first);
    const states = this.ready.get(part) ?? statesOf(await this.messagesOf(part));
    return states.map((state) => jointsOf(state));
  }

  /** Returns the events, oldest first, without those that cannot be read. */
  async events(): Promise<RecordedEvent[]> {
    const events: RecordedEvent[] = [];
    let read = 0;
    for (const { file, chunk, first, states } of this.parts) {
      if ((chunk.messages.get("/simd/events") ?? 0) === 0) continue;
      read += 1;
      if (read > MAX_SAID) break;
      try {
        let seen = 0;
        for (const { topic, data } of await file.read(chunk)) {
          if (topic === "/tf") seen += 1;
          if (topic === "/simd/events") events.push({ at: this.clamp(first + Math.min(seen, states) - 1), data });
          if (events.length >= MAX_EVENTS) return events;
        }
      } catch (error) {
        this.problem(error);
      }
    }
    return events;
  }

  private clamp(number: number): number {
    return Math.max(0, Math.min(this.count - 1, Math.floor(number)));
  }

  private partOf(number: number): Part {
    let low = 0;
    let high = this.parts.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >>> 1;
      if ((this.parts[middle]?.first ?? 0) <= number) low = middle;
      else high = middle - 1;
    }
    // Chooses the last part that begins there: the parts before it have no states.
    const part = this.parts[low];
    if (!part) throw new Error("the recording is empty");
    return part;
  }

  private load(part: Part): Promise<RawState[]> {
    const loading = this.chunks.get(part);
    if (loading) return loading;
    const loaded = this.read(part).catch((error: unknown) => {
      // The daemon does not answer, which proves nothing about the chunk.
      this.chunks.delete(part);
      this.notBefore = performance.now() + RETRY;
      throw error;
    });
    this.chunks.set(part, loaded);
    return loaded;
  }

  /** Reads and keeps the states of a chunk; none if it is damaged. */
  private async read(part: Part): Promise<RawState[]> {
    const pause = this.notBefore - performance.now();
    if (pause > 0) await new Promise((resolve) => setTimeout(resolve, pause));
    const states = await this.messagesOf(part).then(statesOf, (error: unknown) => this.noneOf(error));
    this.keep(part, states);
    return states;
  }

  /** Returns nothing in place of damage; throws all other errors. */
  private noneOf(error: unknown): [] {
    if (!(error instanceof Damage)) throw error;
    this.problem(error);
    return [];
  }

  /** Returns the messages of a chunk, after the messages of its first state that are in the chunk before. */
  private async messagesOf(part: Part): Promise<Message[]> {
    const messages = await part.file.read(part.chunk);
    const isBegun = messages.find(({ topic }) => topic === "/clock" || topic === "/tf" || topic.endsWith(JOINTS))?.topic !== "/clock";
    const before = this.parts[this.parts.indexOf(part) - 1];
    if (!isBegun || part.states === 0 || before?.file !== part.file) return messages;
    // If that is damaged the state lacks its joints, but has the frames.
    const earlier = await before.file.read(before.chunk).catch((error: unknown) => this.noneOf(error));
    const rest = earlier.slice(earlier.findLastIndex(({ topic }) => topic === "/tf") + 1);
    // Copies do not keep all of that chunk in memory.
    return [...rest.map((message) => ({ ...message, data: message.data.slice() })), ...messages];
  }

  /** Keeps the newest chunks, of a bounded size. */
  private keep(part: Part, states: RawState[]): void {
    this.ready.set(part, states);
    this.bytesKept += weight(states);
    for (const [oldest, its] of this.ready) {
      if (this.bytesKept <= MAX_KEPT || oldest === part) break;
      this.ready.delete(oldest);
      this.chunks.delete(oldest);
      this.bytesKept -= weight(its);
    }
  }

  private decode(part: Part, states: readonly RawState[], number: number): RecordedState {
    // A damaged chunk has none: the robots are not drawn.
    const raw = states[Math.min(number - part.first, states.length - 1)];
    const none = { number, simTime: NaN, poses: new Map(), joints: new Map() };
    if (!raw) return none;
    try {
      const moving = transforms(raw.frames);
      const simTime = raw.clock ? clock(raw.clock) : (moving[0]?.time ?? NaN);
      const fixed = this.fixed.filter(({ time }) => time <= raw.time).flatMap((each) => each.transforms);
      return { number, simTime, poses: worldPoses(fixed, moving), joints: jointsOf(raw) };
    } catch (error) {
      this.problem(error);
      return none;
    }
  }

  private async readWhatIsSaidOnce(): Promise<void> {
    const isSaidOnce = (topic: string): boolean => topic === "/tf_static" || topic.endsWith("/robot_description");
    let read = 0;
    for (const { file, chunk } of this.parts) {
      if (![...chunk.messages].some(([topic, count]) => count > 0 && isSaidOnce(topic))) continue;
      read += 1;
      if (read > MAX_SAID) {
        this.problems.add(`Robots that came after the first ${MAX_SAID} are not shown.`);
        return;
      }
      const messages = await file.read(chunk).catch((error: unknown) => this.noneOf(error));
      try {
        for (const { topic, time, data } of messages) {
          if (topic === "/tf_static") this.fixed.push({ time, transforms: transforms(data) });
          else if (isSaidOnce(topic)) this.descriptions.set(topic.slice(1, -"/robot_description".length), string(data));
        }
      } catch (error) {
        this.problem(error);
      }
    }
  }

  /** Uses the median of some differences, since a reset sets time back. */
  private async measure(): Promise<void> {
    const times: number[] = [];
    for (let number = 0; number < Math.min(this.count, 20); number += 1) times.push((await this.state(number)).simTime);
    const steps = times.slice(1).map((time, at) => time - (times[at] ?? NaN)).filter((step) => step > 0).sort((a, b) => a - b);
    this.period = steps[steps.length >>> 1] ?? this.period;
  }

  private problem(error: unknown): void {
    if (this.problems.size >= MAX_PROBLEMS) return;
    const text = error instanceof Error ? error.message : String(error);
    this.problems.add(`${text.charAt(0).toUpperCase()}${text.slice(1)}.`);
  }
}

/** Returns the states in some messages. A state's messages have one time, and its frames come last. */
function statesOf(messages: readonly Message[]): RawState[] {
  const states: RawState[] = [];
  let joints = new Map<string, Uint8Array>();
  let now: Uint8Array | undefined;
  for (const { topic, time, data } of messages) {
    if (topic === "/clock") {
      joints = new Map();
      now = data;
    } else if (topic.endsWith(JOINTS)) {
      joints.set(topic.slice(1, -JOINTS.length), data);
    } else if (topic === "/tf") {
      states.push({ time, frames: data, clock: now, joints });
      joints = new Map();
      now = undefined;
    }
  }
  return states;
}

function jointsOf({ joints }: RawState): ReadonlyMap<string, JointState> {
  return new Map([...joints].map(([robot, data]) => [robot, jointState(data)]));
}

/** Views would keep the whole chunk in memory. */
function weight(states: readonly RawState[]): number {
  return states[0]?.frames.buffer.byteLength ?? 0;
}
