// Target that a row shows between the user's input and the daemon's state.
import { expect, test } from "vitest";
import { PendingTarget } from "./pending-target";

const at = (value: number) => ({ mode: "position", value }) as const;

test("without a pending target a row shows that of the daemon", () => {
  expect(new PendingTarget().shown(at(1), 0)).toEqual(at(1));
});

test("a pending target is shown until the daemon reports it, and those of other clients after that", () => {
  const asked = new PendingTarget();
  asked.set(at(2), 0);
  expect(asked.shown(at(1), 20)).toEqual(at(2));
  expect(asked.shown(at(2), 40)).toEqual(at(2));
  expect(asked.shown(at(3), 60)).toEqual(at(3));
});

test("a target that the daemon clamped is shown in the end", () => {
  const asked = new PendingTarget();
  asked.set(at(9), 0);
  asked.answered(100);
  expect(asked.shown(at(1.5), 1000)).toEqual(at(9));
  expect(asked.shown(at(1.5), 1200)).toEqual(at(1.5));
});

test("a target is shown until the daemon answers, however slow it is", () => {
  const asked = new PendingTarget();
  asked.set(at(2), 0);
  asked.answered(10);
  asked.set(at(3), 20);
  expect(asked.shown(at(1), 60_000)).toEqual(at(3));
});

test("a slider stays under the pointer during a drag", () => {
  const asked = new PendingTarget();
  asked.hold();
  asked.set(at(2), 0);
  expect(asked.shown(at(2), 10)).toEqual(at(2));
  expect(asked.shown(at(5), 60_000)).toEqual(at(2));
  asked.release(60_000);
  expect(asked.shown(at(5), 60_100)).toEqual(at(2));
  expect(asked.shown(at(2), 60_200)).toEqual(at(2));
  expect(asked.shown(at(5), 60_300)).toEqual(at(5));
});

test("a passive or holding joint is recognised by its mode", () => {
  const asked = new PendingTarget();
  asked.set({ mode: "hold", value: 0.5 }, 0);
  expect(asked.shown(at(1), 10)).toEqual({ mode: "hold", value: 0.5 });
  expect(asked.shown({ mode: "hold", value: 0.4 }, 20)).toEqual({ mode: "hold", value: 0.4 });
});
