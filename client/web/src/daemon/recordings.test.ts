// The list of recordings on this page.
import { createRouterTransport } from "@connectrpc/connect";
import { expect, test } from "vitest";
import { RecordingService, RecordingState } from "../gen/simd/v1/recording_pb";
import { beingMade } from "../state/recordings";
import { refreshRecordings } from "./recordings";
import { servicesOver } from "./services";

test("a list that was asked for before a recording began does not hide it when it comes later", async () => {
  const answers: (() => void)[] = [];
  let running = false;
  const services = servicesOver(
    createRouterTransport(({ service }) =>
      service(RecordingService, {
        listRecordings: async () => {
          const recordings = running ? [{ name: "run", state: RecordingState.RECORDING }] : [];
          await new Promise<void>((resolve) => answers.push(resolve));
          return { recordings };
        },
      }),
    ),
  );
  const before = refreshRecordings(services);
  await expect.poll(() => answers.length).toBe(1);
  running = true;
  const after = refreshRecordings(services);
  await expect.poll(() => answers.length).toBe(2);
  answers[1]?.();
  await after;
  answers[0]?.();
  await before;
  expect(beingMade.value?.name).toBe("run");
});
