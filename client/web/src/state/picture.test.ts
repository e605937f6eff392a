// A request for a picture gets the picture, or a reason.
import { afterEach, expect, test } from "vitest";
import { pictureRequest, takePicture } from "./picture";

let end = (): void => undefined;
afterEach(() => end());

test("a picture of that size is requested from the scene", async () => {
  end = pictureRequest.subscribe((request) => request?.taken(Promise.resolve(new Blob([`${request.width}x${request.height}`]))));
  expect(await (await takePicture(640, 480)).text()).toBe("640x480");
  expect(pictureRequest.value).toBeNull();
});

test("an impossible size, and a page without a scene, are reported", async () => {
  await expect(takePicture(0, 480)).rejects.toThrow("not 0 by 480");
  await expect(takePicture(640, 10_000)).rejects.toThrow("8192");
  await expect(takePicture(640, 480)).rejects.toThrow("nothing is drawn");
});
