// Which target a row shows between a hand here and the daemon there.
import { expect, test } from "vitest";
import { Asked } from "./asked";

const at = (value: number) => ({ mode: "position", value }) as const;

test("without a hand on it a row shows what the daemon says", () => {
  expect(new Asked().shown(at(1), 0)).toEqual(at(1));
});

test("what was asked for is shown until the daemon shows it, and what others ask for after that", () => {
  const asked = new Asked();
  asked.set(at(2), 0);
  expect(asked.shown(at(1), 20)).toEqual(at(2));
  expect(asked.shown(at(2), 40)).toEqual(at(2));
  expect(asked.shown(at(3), 60)).toEqual(at(3));
});

test("a target that the daemon clamped is shown in the end", () => {
  const asked = new Asked();
  asked.set(at(9), 0);
  expect(asked.shown(at(1.5), 900)).toEqual(at(9));
  expect(asked.shown(at(1.5), 1100)).toEqual(at(1.5));
});

test("a slider that is held stays under the hand", () => {
  const asked = new Asked();
  asked.hold();
  asked.set(at(2), 0);
  expect(asked.shown(at(2), 10)).toEqual(at(2));
  expect(asked.shown(at(5), 60_000)).toEqual(at(2));
  asked.release(60_000);
  expect(asked.shown(at(5), 60_100)).toEqual(at(2));
  expect(asked.shown(at(2), 60_200)).toEqual(at(2));
  expect(asked.shown(at(5), 60_300)).toEqual(at(5));
});

test("a joint that was freed or held is known by its mode alone", () => {
  const asked = new Asked();
  asked.set({ mode: "hold", value: 0.5 }, 0);
  expect(asked.shown(at(1), 10)).toEqual({ mode: "hold", value: 0.5 });
  expect(asked.shown({ mode: "hold", value: 0.4 }, 20)).toEqual({ mode: "hold", value: 0.4 });
});
