// Position of the cameras' pictures in the scene.
import { expect, test } from "vitest";
import { cornersOf } from "./camera-pictures";

const lens = { width: 40, height: 20, fieldOfView: Math.PI / 2, near: 0.1, far: 10 };
const rounded = (corners: number[][]) => corners.map((corner) => corner.map((value) => Number(value.toFixed(9)) + 0));

test("a picture is before its camera, as wide as it sees there and as high as its pixels are square", () => {
  expect(rounded(cornersOf(lens))).toEqual([
    [0.4, 0.4, 0.2],
    [0.4, -0.4, 0.2],
    [0.4, -0.4, -0.2],
    [0.4, 0.4, -0.2],
  ]);
});

test("it is within what the camera sees", () => {
  expect(cornersOf({ ...lens, near: 2 })[0]?.[0]).toBe(2);
  expect(cornersOf({ ...lens, near: 0.01, far: 0.05 })[0]?.[0]).toBe(0.05);
});
