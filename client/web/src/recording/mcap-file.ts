// One file of a recording: the places of its chunks, and their contents. Nothing in it is trusted.
import { McapIndexedReader, McapRecordBuilder, McapStreamReader, MCAP_MAGIC, Opcode, type TypedMcapRecords } from "@mcap/core";
import { decompress } from "./lz4";
import { Damage, type Source } from "./source";

/**
 * The newest format that this page reads. Formats differ in commands, which the page does not read; `simd replay` reads only
 * one.
 */
const FORMAT = 6;
const METADATA = "simd.recording";
/** Maximum bytes of a decompressed chunk: many times the written size. */
const MAX_CHUNK = 32 << 20;
/** Maximum number of chunks of an incomplete file: half a day of them. */
const MAX_SCANNED = 100_000;
/** Bytes that contain the beginning of a file, and mostly the gap between two chunks. */
const BEGINNING = 64 << 10;
const BETWEEN = 8 << 10;
const RECORD_HEAD = 9;
/** Sizes in a record of an index: its head, the channel, the length of the list; then each entry. */
const INDEX_HEAD = RECORD_HEAD + 2 + 4;
const INDEX_ENTRY = 16;

/** Place of a chunk. */
export interface ChunkRange {
  offset: number;
  length: number;
  /** Number of its messages by topic. */
  messages: ReadonlyMap<string, number>;
}

/** A message. */
export interface Message {
  topic: string;
  /** Nanoseconds since 1970. */
  time: bigint;
  data: Uint8Array;
}

/** A file whose chunks are known. */
export class McapFile {
  private constructor(
    readonly source: Source,
    readonly chunks: readonly ChunkRange[],
    /** Channels by number. Each is defined once, in the chunk with its first message. */
    private readonly channels: Map<number, TypedMcapRecords["Channel"]>,
    /** Whether it was completed; otherwise it is read as far as possible. */
    readonly isComplete: boolean,
  ) {}

  /** Reads the places of its chunks. Rejects with a sentence if it is not a recording. */
  static async open(source: Source): Promise<McapFile> {
    await checkFormat(source);
    return (await isComplete(source)) ? McapFile.indexed(source) : McapFile.scanned(source);
  }

  private static async indexed(source: Source): Promise<McapFile> {
    const read = (offset: bigint, length: bigint) => source.read(Number(offset), Number(length));
    const reader = await McapIndexedReader.Initialize({ readable: { size: async () => BigInt(source.size), read } });
    const channels = new Map(reader.channelsById);
    const chunks = reader.chunkIndexes.map((index) => {
      const end = Number(index.chunkStartOffset + index.chunkLength + index.messageIndexLength);
      const starts = [...index.messageIndexOffsets].map(([channel, at]) => ({ channel, at: Number(at) })).sort((a, b) => a.at - b.at);
      const messages = new Map<string, number>();
      starts.forEach(({ channel, at }, number) => {
        // Each record of the index grows with the number of messages.
        const count = ((starts[number + 1]?.at ?? end) - at - INDEX_HEAD) / INDEX_ENTRY;
        if (!Number.isInteger(count) || count < 0 || count > MAX_CHUNK) throw new Error("its index is damaged");
        addTo(messages, channels.get(channel)?.topic ?? "", count);
      });
      return { offset: Number(index.chunkStartOffset), length: Number(index.chunkLength), messages };
    });
    return new McapFile(source, chunks.sort((a, b) => a.offset - b.offset), channels, true);
  }

  /** Moves from chunk to chunk, without reading their contents. */
  private static async scanned(source: Source): Promise<McapFile> {
    const found: (Omit<ChunkRange, "messages"> & { counts: Map<number, number> })[] = [];
    const window = new Window(source);
    for (let at = MCAP_MAGIC.length; found.length < MAX_SCANNED; ) {
      const head = await window.view(at, RECORD_HEAD);
      if (!head) break;
      const opcode = head.getUint8(0);
      const length = RECORD_HEAD + Number(head.getBigUint64(1, true));
      if (at + length > source.size || opcode === Opcode.DATA_END) break;
      if (opcode === Opcode.CHUNK) found.push({ offset: at, length, counts: new Map() });
      if (opcode === Opcode.MESSAGE_INDEX) {
        const index = await window.view(at, INDEX_HEAD);
        found.at(-1)?.counts.set(index?.getUint16(RECORD_HEAD, true) ?? 0, Math.floor((length - INDEX_HEAD) / INDEX_ENTRY));
      }
      at += length;
    }
    const last = found.at(-1);
    // Its index is missing, so the extent of its contents is unknown.
    if (last?.counts.size === 0) found.pop();
    const file = new McapFile(source, [], new Map(), false);
    const chunks: ChunkRange[] = [];
    for (const { offset, length, counts } of found) {
      const range = { offset, length };
      if ([...counts.keys()].some((channel) => !file.channels.has(channel))) await file.read(range);
      const messages = new Map<string, number>();
      for (const [channel, count] of counts) addTo(messages, file.channels.get(channel)?.topic ?? "", count);
      chunks.push({ ...range, messages });
    }
    return new McapFile(source, chunks, file.channels, false);
  }

  /** Returns the messages of a chunk, in their order. Rejects with `Damage` if it is damaged, and with errors of its source. */
  async read({ offset, length }: Pick<ChunkRange, "offset" | "length">): Promise<Message[]> {
    const bytes = await this.source.read(offset, length);
    const reader = new McapStreamReader({ noMagicPrefix: true, decompressHandlers: { lz4: decompressChunk } });
    const messages: Message[] = [];
    // The package accepts messages only of channels that it has seen.
    const before = new McapRecordBuilder();
    for (const channel of this.channels.values()) before.writeChannel(channel);
    try {
      reader.append(before.buffer);
      reader.append(bytes);
      for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
        if (record.type === "Channel") this.channels.set(record.id, record);
        if (record.type === "Message") messages.push(this.message(record));
      }
    } catch (error) {
      throw new Damage(`${this.source.name} is damaged at byte ${offset}: ${reason(error)}`);
    }
    return messages;
  }

  private message({ channelId, logTime, data }: TypedMcapRecords["Message"]): Message {
    return { topic: this.channels.get(channelId)?.topic ?? "", time: logTime, data };
  }
}

/** The last part of the file that was read, since records lie close together. */
class Window {
  private at = 0;
  private bytes = new Uint8Array(0);

  constructor(private readonly source: Source) {}

  /** Returns `length` bytes; undefined if the file ends before. */
  async view(at: number, length: number): Promise<DataView | undefined> {
    if (at + length > this.source.size) return undefined;
    if (at < this.at || at + length > this.at + this.bytes.length) {
      this.bytes = new Uint8Array(await this.source.read(at, Math.min(BETWEEN, this.source.size - at)));
      this.at = at;
    }
    return new DataView(this.bytes.buffer, this.bytes.byteOffset + at - this.at, length);
  }
}

/** First check of a file: it is a recording, in a known format. */
async function checkFormat(source: Source): Promise<void> {
  const bytes = await source.read(0, Math.min(BEGINNING, source.size));
  if (bytes.length < MCAP_MAGIC.length || !MCAP_MAGIC.every((byte, at) => bytes[at] === byte)) throw new Error("it is not a file of MCAP");
  const foreign = "it is an MCAP file, but not a recording of simd";
  const reader = new McapStreamReader();
  let format: string | undefined;
  try {
    reader.append(bytes);
    for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
      if (record.type === "Header") continue;
      if (record.type === "Metadata" && record.name === METADATA) format = record.metadata.get("format");
      break;
    }
  } catch {
    throw new Error(foreign);
  }
  if (format === undefined || !/^\d{1,9}$/.test(format)) throw new Error(foreign);
  if (Number(format) >= 1 && Number(format) <= FORMAT) return;
  const newer = Number(format) > FORMAT ? "; it was made by a newer release: open it with that" : "";
  throw new Error(`it is a recording of format ${format}, and this page reads 1 to ${FORMAT}${newer}`);
}

/** Whether it has the end of a complete file. */
async function isComplete(source: Source): Promise<boolean> {
  if (source.size < 2 * MCAP_MAGIC.length) return false;
  const end = await source.read(source.size - MCAP_MAGIC.length, MCAP_MAGIC.length);
  return MCAP_MAGIC.every((byte, at) => end[at] === byte);
}

function decompressChunk(data: Uint8Array, size: bigint): Uint8Array {
  if (size > MAX_CHUNK) throw new Error(`a chunk would be ${size} bytes, and the limit is ${MAX_CHUNK}`);
  return decompress(data, Number(size));
}

function addTo(counts: Map<string, number>, topic: string, count: number): void {
  counts.set(topic, (counts.get(topic) ?? 0) + count);
}

/** Returns the reason, without the package's additions for its users. */
function reason(error: unknown): string {
  const text = error instanceof Error ? error.message : String(error);
  return text.replace(/ \[(library=.*|no header)\]$/, "");
}
