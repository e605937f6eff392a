// Markers, cameras and input against a stub of a daemon: the page's state, its reports, and the frequency of its
// calls.
import { create, type MessageInitShape } from "@bufbuild/protobuf";
import { Code, ConnectError, createRouterTransport } from "@connectrpc/connect";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { MarkerSchema, NextViewResponseSchema, ViewService, type NextViewRequest, type ReportViewRequest } from "../gen/simd/v1/view_pb";
import { cameraTarget, shownCamera, type ShownCamera } from "../state/camera";
import { inputFor, pushInput, takeInput } from "../state/input";
import { linkColors, markers } from "../state/markers";
import { connection, role } from "../state/world";
import { servicesOver } from "./services";
import { ViewLink } from "./view-link";

type Answer = MessageInitShape<typeof NextViewResponseSchema>;

let answer: Answer;
let asked: NextViewRequest[];
let reports: ReportViewRequest[];
let link: ViewLink;

beforeEach(() => {
  vi.useFakeTimers();
  connection.value = { state: "live", reason: "", retryAt: 0 };
  role.value = null;
  markers.value = new Map();
  linkColors.value = new Map();
  cameraTarget.value = null;
  shownCamera.value = null;
  takeInput();
  answer = { version: 1n, whole: true };
  asked = [];
  reports = [];
  const transport = createRouterTransport(({ service }) => {
    service(ViewService, {
      nextView: (request) => {
        asked.push(request);
        // Answers like a daemon: with nothing to a client that has everything.
        return create(NextViewResponseSchema, request.afterVersion === answer.version ? { version: answer.version, wantsInput: answer.wantsInput ?? false, inputClient: answer.inputClient ?? "" } : answer);
      },
      reportView: (request) => (reports.push(request), {}),
    });
  });
  link = new ViewLink(servicesOver(transport));
});

afterEach(() => {
  link.setVisible(false);
  vi.useRealTimers();
});

function line(id: bigint, x: number): MessageInitShape<typeof MarkerSchema> {
  return { id, shape: { case: "lines", value: { points: [x, 0, 0, x, 0, 1], width: 1 } } };
}

const shown: ShownCamera = { position: [1, 2, 3], target: [0, 0, 0], fieldOfView: 0.6, width: 800, height: 600, followed: 0n };
const drawn = () => [...markers.value].map(([id, { shape }]) => [id, shape.kind === "lines" ? shape.points[0] : NaN]);

test("markers are added, replaced and deleted, and those that stay are the same objects", async () => {
  answer = { version: 3n, whole: true, markers: [line(1n, 1), line(2n, 2)] };
  link.setVisible(true);
  await vi.advanceTimersByTimeAsync(300);
  expect(drawn()).toEqual([[1n, 1], [2n, 2]]);
  const kept = markers.value.get(2n);
  answer = { version: 5n, markers: [line(1n, 7), line(3n, 3)] };
  await vi.advanceTimersByTimeAsync(300);
  expect(drawn()).toEqual([[1n, 7], [2n, 2], [3n, 3]]);
  expect(markers.value.get(2n)).toBe(kept);
  answer = { version: 6n, deleted: [2n, 9n] };
  await vi.advanceTimersByTimeAsync(300);
  expect(drawn()).toEqual([[1n, 7], [3n, 3]]);
  answer = { version: 1n, whole: true };
  await vi.advanceTimersByTimeAsync(300);
  expect(drawn()).toEqual([]);
});

test("a page in which nothing changes asks twice a second, and reports nothing", async () => {
  link.setVisible(true);
  await vi.advanceTimersByTimeAsync(5000);
  const before = asked.length;
  await vi.advanceTimersByTimeAsync(5000);
  expect(asked.length - before).toBe(10);
  expect(asked.at(-1)?.timeout).toBeLessThan(0.01);
  expect(reports).toEqual([]);
});

test("a camera that moves is reported at most ten times a second, and once it is still no more", async () => {
  link.setVisible(true);
  await vi.advanceTimersByTimeAsync(300);
  for (let step = 0; step < 100; step += 1) {
    shownCamera.value = { ...shown, position: [step, 2, 3] };
    await vi.advanceTimersByTimeAsync(20);
  }
  expect(reports.length).toBeGreaterThan(10);
  expect(reports.length).toBeLessThanOrEqual(21);
  await vi.advanceTimersByTimeAsync(1000);
  expect(reports.at(-1)?.camera).toMatchObject({ position: { x: 99, y: 2, z: 3 }, width: 800, fieldOfView: 0.6 });
  const before = reports.length;
  await vi.advanceTimersByTimeAsync(10_000);
  expect(reports.length).toBe(before);
});

test("a camera that was set before the page was opened is distinguished from one that is set now", async () => {
  const camera = { version: 4n, position: { x: 1, y: 0, z: 1 }, target: {}, fieldOfView: 0 };
  answer = { version: 2n, whole: true, camera };
  link.setVisible(true);
  await vi.advanceTimersByTimeAsync(300);
  expect(cameraTarget.value).toMatchObject({ version: 4n, isOld: true, position: [1, 0, 1] });
  answer = { version: 3n, camera: { ...camera, version: 5n } };
  await vi.advanceTimersByTimeAsync(300);
  expect(cameraTarget.value).toMatchObject({ version: 5n, isOld: false });
  const seen = cameraTarget.value;
  // A change of something else moves no camera.
  answer = { version: 4n, camera: { ...camera, version: 5n }, markers: [line(1n, 1)] };
  await vi.advanceTimersByTimeAsync(300);
  expect(cameraTarget.value).toBe(seen);
});

test("keys are reported at once while a program asks for them", async () => {
  answer = { version: 2n, whole: true, wantsInput: true, inputClient: "script" };
  link.setVisible(true);
  await vi.advanceTimersByTimeAsync(300);
  expect(inputFor.value).toBe("script");
  pushInput({ kind: "key", key: "a", code: "KeyA", isDown: true });
  pushInput({ kind: "mouse", x: 3, y: 4, button: "right", isDown: true });
  await vi.advanceTimersByTimeAsync(1);
  expect(reports.flatMap(({ input }) => input.map(({ kind }) => kind.value))).toMatchObject([
    { key: "a", code: "KeyA", isDown: true },
    { x: 3, y: 4, button: 3, isDown: true },
  ]);
});

test("a page whose token is a viewer's reports nothing", async () => {
  role.value = "viewer";
  answer = { version: 2n, whole: true, wantsInput: true, inputClient: "script" };
  shownCamera.value = shown;
  link.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  expect(inputFor.value).toBeNull();
  expect(reports).toEqual([]);
});

test("a daemon without markers is polled no more often than an idle one", async () => {
  const old = createRouterTransport(({ service }) => {
    service(ViewService, {
      nextView: (request) => {
        asked.push(request);
        throw new ConnectError("no such service", Code.Unimplemented);
      },
    });
  });
  link = new ViewLink(servicesOver(old));
  link.setVisible(true);
  await vi.advanceTimersByTimeAsync(10_000);
  expect(asked.length).toBeLessThanOrEqual(41);
});

test("colours of links are kept until others come, and go with the daemon", async () => {
  const color = (red: number) => ({ red, green: 0, blue: 0, alpha: 1 });
  answer = { version: 2n, whole: true, colors: { colors: [{ robot: "arm", link: "hand", color: color(1), layoutVersion: 4n }, { robot: "arm", link: "base", color: color(0.5), layoutVersion: 4n }] } };
  link.setVisible(true);
  await vi.advanceTimersByTimeAsync(300);
  const arm = () => linkColors.value.get("arm");
  expect([arm()?.layoutVersion, [...(arm()?.links ?? [])]]).toEqual([4n, [["hand", [1, 0, 0, 1]], ["base", [0.5, 0, 0, 1]]]]);
  answer = { version: 3n, markers: [line(1n, 1)] };
  await vi.advanceTimersByTimeAsync(300);
  expect(arm()?.links.size).toBe(2);
  answer = { version: 4n, colors: {} };
  await vi.advanceTimersByTimeAsync(300);
  expect(linkColors.value.size).toBe(0);
  linkColors.value = new Map([["arm", { layoutVersion: 4n, links: new Map() }]]);
  answer = { version: 1n, whole: true };
  link.begin();
  await vi.advanceTimersByTimeAsync(300);
  expect(linkColors.value.size).toBe(0);
});
