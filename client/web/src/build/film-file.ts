// The file of a video whose pictures are encoded one by one: complete, or what there is of it where the encoder has failed.
import { BufferTarget, Output, WebMOutputFormat } from "mediabunny";

/** Identifies a segment, bytes; how long it is comes next. */
const SEGMENT_ID = 4;

/** A WebM that is being written. */
export class FilmFile {
  readonly output: Output;
  /** How long it is so far. */
  bytes = 0;
  private readonly target = new BufferTarget();
  /** Its head, and what follows in parts of some seconds each: the package gives all of it only once the encoder has ended well. */
  private readonly parts: Blob[] = [];

  constructor() {
    this.target.onwrite = (_, end) => (this.bytes = Math.max(this.bytes, end));
    const keep = (data: Uint8Array): void => void this.parts.push(new Blob([data.slice()]));
    this.output = new Output({ target: this.target, format: new WebMOutputFormat({ onEbmlHeader: keep, onSegmentHeader: (data) => keep(unbounded(data)), onCluster: keep }) });
  }

  /** Ends it. Resolves to the file, and to why its last seconds are missing where they are; rejects where there is nothing. */
  async content(): Promise<{ parts: BlobPart[]; problem?: string }> {
    try {
      await this.output.finalize();
    } catch (error) {
      // Two of them are the head.
      if (this.parts.length <= 2) throw error;
      return { parts: this.parts, problem: error instanceof Error ? error.message : String(error) };
    }
    return { parts: this.target.buffer ? [this.target.buffer] : [] };
  }
}

/** A segment whose end is not known, as those of live videos: all bits of its length are ones. */
function unbounded(header: Uint8Array): Uint8Array {
  const bytes = header.slice();
  const first = bytes[SEGMENT_ID] ?? 0;
  // It is as many bytes as its first one has leading zeros, and one.
  const length = Math.clz32(first) - 24 + 1;
  bytes.fill(0xff, SEGMENT_ID, SEGMENT_ID + length);
  bytes[SEGMENT_ID] = 0xff >>> (length - 1);
  return bytes;
}
