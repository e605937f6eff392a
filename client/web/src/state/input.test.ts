// The queue of keys and mouse is bounded, and merges moves of the mouse.
import { expect, test } from "vitest";
import { inputCount, pushInput, takeInput } from "./input";

const move = (x: number) => ({ kind: "mouse", x, y: 0, button: null, isDown: false }) as const;
const key = (isDown: boolean) => ({ kind: "key", key: "a", code: "KeyA", isDown }) as const;

test("moves that follow each other are one, and nothing else is left out", () => {
  const before = inputCount.value;
  for (const input of [move(1), move(2), key(true), move(3), move(4), key(false)]) pushInput(input);
  expect(inputCount.value).toBe(before + 6);
  expect(takeInput()).toEqual([move(2), key(true), move(4), key(false)]);
  expect(takeInput()).toEqual([]);
});

test("if there are too many events, the newest wait", () => {
  for (let count = 0; count < 1000; count += 1) pushInput(key(count % 2 === 0));
  pushInput(move(7));
  const taken = takeInput();
  expect(taken).toHaveLength(256);
  expect(taken.at(-1)).toEqual(move(7));
});
