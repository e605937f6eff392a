// The file of a video whose pictures are encoded one by one: complete, or its readable part if the encoder has failed.
import { BufferTarget, Output, WebMOutputFormat } from "mediabunny";

/** Identifier of a segment, bytes; its length follows. */
const SEGMENT_ID = 4;

/** A WebM that is being written. */
export class FilmFile {
  readonly output: Output;
  /** Its length so far. */
  bytes = 0;
  private readonly target = new BufferTarget();
  /** Its head, and parts of some seconds each: the package returns the whole file only once the encoder has ended well. */
  private readonly parts: Blob[] = [];

  constructor() {
    this.target.onwrite = (_, end) => (this.bytes = Math.max(this.bytes, end));
    const keep = (data: Uint8Array): void => void this.parts.push(new Blob([data.slice()]));
    this.output = new Output({ target: this.target, format: new WebMOutputFormat({ onEbmlHeader: keep, onSegmentHeader: (data) => keep(unbounded(data)), onCluster: keep }) });
  }

  /** Ends it. Resolves to the file, and to the reason if its last seconds are missing; rejects if it is empty. */
  async content(): Promise<{ parts: BlobPart[]; problem?: string }> {
    try {
      await this.output.finalize();
    } catch (error) {
      // Two of these parts are the head.
      if (this.parts.length <= 2) throw error;
      return { parts: this.parts, problem: error instanceof Error ? error.message : String(error) };
    }
    return { parts: this.target.buffer ? [this.target.buffer] : [] };
  }
}

/** A segment of unknown length, as in live videos: all bits of its length are ones. */
function unbounded(header: Uint8Array): Uint8Array {
  const bytes = header.slice();
  const first = bytes[SEGMENT_ID] ?? 0;
  // Its length in bytes is the number of leading zeros of the first byte, plus one.
  const length = Math.clz32(first) - 24 + 1;
  bytes.fill(0xff, SEGMENT_ID, SEGMENT_ID + length);
  bytes[SEGMENT_ID] = 0xff >>> (length - 1);
  return bytes;
}
