// Pictures of cameras in the page's form.
import { create } from "@bufbuild/protobuf";
import { Code, ConnectError, createRouterTransport } from "@connectrpc/connect";
import { deflateSync } from "node:zlib";
import { expect, test } from "vitest";
import { CameraPictureSchema, CameraService, PlaneCompression } from "../gen/simd/v1/camera_pb";
import type { SensorPicture } from "../state/pictures";
import { connection } from "../state/world";
import { PictureFollower, shownOf } from "./pictures";
import { servicesOver } from "./services";

const SIZE = { width: 2, height: 1 };
const raw = (data: Uint8Array) => ({ compression: PlaneCompression.UNSPECIFIED, data });
const packed = (data: Uint8Array) => ({ compression: PlaneCompression.ZLIB, data: new Uint8Array(deflateSync(data)) });
const words = (...values: number[]) => new Uint8Array(new Uint32Array(values).buffer);
const metres = (...values: number[]) => new Uint8Array(new Float32Array(values).buffer);

test("colours are shown unchanged, packed or not", async () => {
  for (const plane of [raw, packed]) {
    const color = plane(new Uint8Array([1, 2, 3, 4, 5, 6]));
    const shown = await shownOf(create(CameraPictureSchema, { ...SIZE, color, stamp: { simTime: 1.5 } }));
    expect([...shown.pixels]).toEqual([1, 2, 3, 255, 4, 5, 6, 255]);
    expect(shown.time).toBe(1.5);
  }
});

test("near surfaces are light, and the background is black", async () => {
  const shown = await shownOf(create(CameraPictureSchema, { ...SIZE, depth: packed(metres(2.5, Infinity)) }));
  expect([...shown.pixels]).toEqual([191, 191, 191, 255, 0, 0, 0, 255]);
});

test("links have different colours, and nothing is white", async () => {
  const { pixels } = await shownOf(create(CameraPictureSchema, { width: 3, height: 1, segmentation: raw(words(0, 1, 2)) }));
  const [none, one, other] = [0, 4, 8].map((at) => [...pixels.slice(at, at + 3)].join(" "));
  expect(none).toBe("255 255 255");
  expect(new Set([none, one, other]).size).toBe(3);
});

test("a plane of another size is refused, before it is unpacked", async () => {
  for (const color of [raw(new Uint8Array(5)), packed(new Uint8Array(5)), packed(new Uint8Array(10_000_000))]) {
    await expect(shownOf(create(CameraPictureSchema, { ...SIZE, color }))).rejects.toThrow("size");
  }
});

/** The state of the connection. */
function connected(state: "live" | "lost"): void {
  connection.value = { state, reason: "", retryAt: 0 };
}

test("a hidden page and one whose daemon is lost ask for no pictures", async () => {
  let asked = 0;
  const transport = createRouterTransport(({ service }) => {
    service(CameraService, {
      getPicture: () => {
        asked += 1;
        return { picture: { ...SIZE, sequence: BigInt(asked), color: raw(new Uint8Array(6)) } };
      },
    });
  });
  const follower = new PictureFollower(() => servicesOver(transport));
  connected("live");
  follower.setVisible(false);
  const end = follower.follow("arm", "eye", () => undefined);
  await follower.round();
  expect(asked).toBe(0);
  connected("lost");
  follower.setVisible(true);
  await follower.round();
  expect(asked).toBe(0);
  connected("live");
  await follower.round();
  expect(asked).toBeGreaterThan(0);
  end();
});

test("a picture, or the reason for its absence, is passed on once", async () => {
  let sequence = 1n;
  let refused = false;
  const transport = createRouterTransport(({ service }) => {
    service(CameraService, {
      getPicture: ({ robot, sensor }) => {
        expect([robot, sensor]).toEqual(["arm", "eye"]);
        if (refused) throw new ConnectError("no renderer draws this world", Code.FailedPrecondition);
        return { picture: { ...SIZE, sequence, color: raw(new Uint8Array(6)) } };
      },
    });
  });
  connected("live");
  const calls: [SensorPicture | undefined, string][] = [];
  const follower = new PictureFollower(() => servicesOver(transport));
  // The loop begins with a separate round, which is the first of these.
  const end = follower.follow("arm", "eye", (picture, problem) => calls.push([picture, problem]));
  await expect.poll(() => calls.length).toBe(1);
  const usual = await follower.round();
  expect(calls.length).toBe(1);
  sequence = 2n;
  await follower.round();
  expect(calls.map(([picture]) => picture?.width)).toEqual([2, 2]);
  refused = true;
  expect(await follower.round()).toBeGreaterThan(usual);
  expect(calls.at(-1)).toEqual([undefined, "No renderer draws this world."]);
  end();
});
