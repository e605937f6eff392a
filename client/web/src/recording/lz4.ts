// Decompresses LZ4 frames, which contain the chunks of recordings. The maintained packages need WebAssembly, which a page of
// the daemon may not run. Nothing in a frame is trusted: reads and writes are checked against the bounds of their buffers.

/** The frame format's magic number, its first four bytes. */
const MAGIC = 0x184d2204;
const FLAG = { contentChecksum: 0x04, contentSize: 0x08, blockChecksum: 0x10, dictionary: 0x01 } as const;
/** Marks an uncompressed block. */
const STORED = 0x8000_0000;
const MIN_MATCH = 4;

/** Returns the content of a frame, which is `size` bytes. Throws if it is anything else. */
export function decompress(frame: Uint8Array, size: number): Uint8Array {
  const view = new DataView(frame.buffer, frame.byteOffset, frame.byteLength);
  const u32 = (at: number): number => {
    if (at + 4 > frame.length) throw damaged();
    return view.getUint32(at, true);
  };
  const flags = frame[4] ?? 0;
  if (u32(0) !== MAGIC || flags >> 6 !== 1 || (flags & FLAG.dictionary) !== 0) throw damaged();
  // Flags, block size, optional content size, and a checksum of these.
  let at = 4 + 2 + (flags & FLAG.contentSize ? 8 : 0) + 1;
  const out = new Uint8Array(size);
  let end = 0;
  for (;;) {
    const head = u32(at);
    at += 4;
    if (head === 0) break;
    const length = head % STORED;
    if (at + length > frame.length) throw damaged();
    const block = frame.subarray(at, at + length);
    if (head >= STORED) {
      if (end + length > size) throw damaged();
      out.set(block, end);
      end += length;
    } else {
      end = decompressBlock(block, out, end);
    }
    at += length + (flags & FLAG.blockChecksum ? 4 : 0);
  }
  // The checksums are not read: the container has one of the whole chunk.
  if (end !== size) throw damaged();
  return out;
}

/** Writes a block from `end` on, and returns its end. A block may refer to those before it. */
function decompressBlock(block: Uint8Array, out: Uint8Array, end: number): number {
  let at = 0;
  /** A length of four bits continues in bytes while they are 255. */
  const extended = (length: number): number => {
    if (length < 15) return length;
    let total = length;
    for (;;) {
      const more = block[at];
      if (more === undefined) throw damaged();
      at += 1;
      total += more;
      if (more < 255) return total;
    }
  };
  let to = end;
  while (at < block.length) {
    const token = block[at] ?? 0;
    at += 1;
    const literals = extended(token >> 4);
    if (at + literals > block.length || to + literals > out.length) throw damaged();
    out.set(block.subarray(at, at + literals), to);
    at += literals;
    to += literals;
    // The last sequence has no match.
    if (at === block.length) return to;
    const offset = (block[at] ?? 0) | ((block[at + 1] ?? 0) << 8);
    at += 2;
    const match = extended(token & 15) + MIN_MATCH;
    if (offset === 0 || offset > to || to + match > out.length || at > block.length) throw damaged();
    if (offset >= match) {
      out.copyWithin(to, to - offset, to - offset + match);
      to += match;
    } else {
      // The match overlaps its output: a run.
      for (const stop = to + match; to < stop; to += 1) out[to] = out[to - offset] ?? 0;
    }
  }
  throw damaged();
}

function damaged(): Error {
  return new Error("its compressed data is damaged");
}
