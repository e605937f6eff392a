// The file of a video can be read, even if it could not be completed.
import { BlobSource, EncodedPacket, EncodedPacketSink, EncodedVideoPacketSource, Input, WEBM } from "mediabunny";
import { expect, test } from "vitest";
import { FilmFile } from "./film-file";

const RATE = 30;

/** A file with this many empty pictures; each second starts a new cluster. */
async function written(pictures: number): Promise<FilmFile> {
  const file = new FilmFile();
  const source = new EncodedVideoPacketSource("vp8");
  file.output.addVideoTrack(source, { frameRate: RATE });
  await file.output.start();
  for (let picture = 0; picture < pictures; picture += 1) {
    const packet = new EncodedPacket(new Uint8Array([0x10, 2, 0, 0x9d, 1, 0x2a, 64, 0, 64, 0]), picture % RATE === 0 ? "key" : "delta", picture / RATE, 1 / RATE);
    await source.add(packet, { decoderConfig: { codec: "vp8", codedWidth: 64, codedHeight: 64 } });
  }
  return file;
}

/** The times of its pictures. */
async function times(parts: BlobPart[]): Promise<number[]> {
  const track = await new Input({ source: new BlobSource(new Blob(parts)), formats: [WEBM] }).getPrimaryVideoTrack();
  if (!track) throw new Error("there is no track");
  const all: number[] = [];
  for await (const { timestamp } of new EncodedPacketSink(track).packets()) all.push(timestamp);
  return all;
}

test("a file that is completed has all pictures", async () => {
  const file = await written(100);
  const { parts, problem } = await file.content();
  expect(problem).toBeUndefined();
  expect(new Blob(parts).size).toBe(file.bytes);
  expect((await times(parts)).length).toBe(100);
});

test("a file whose encoder failed has what came before the last second", async () => {
  const file = await written(100);
  // Simulates an encoder that has failed.
  file.output.finalize = () => Promise.reject(new Error("the encoder failed"));
  const { parts, problem } = await file.content();
  expect(problem).toBe("the encoder failed");
  const found = await times(parts);
  expect(found.length).toBe(90);
  expect(found.at(-1)).toBeCloseTo(89 / RATE, 2);
});

test("a file without pictures is none", async () => {
  const file = await written(0);
  file.output.finalize = () => Promise.reject(new Error("the encoder failed"));
  await expect(file.content()).rejects.toThrow("the encoder failed");
});
