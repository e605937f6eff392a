// The newest of each change is sent, one call at a time, if changes come faster than answers.
import { expect, test } from "vitest";
import { Coalescer } from "./coalesce";

/** A sender whose calls end at the test's command. */
function sender() {
  const calls: { values: [string, number][]; end: () => void }[] = [];
  const coalescer = new Coalescer<string, number>(
    (values) => new Promise((resolve) => calls.push({ values: [...values], end: resolve })),
  );
  return { calls, coalescer };
}

const settle = () => new Promise((resolve) => setImmediate(resolve));

test("the first value is sent at once, and the newest of each key after that call", async () => {
  const { calls, coalescer } = sender();
  const done = [coalescer.set("a", 1), coalescer.set("a", 2), coalescer.set("b", 1), coalescer.set("a", 3)];
  expect(calls.map((call) => call.values)).toEqual([[["a", 1]]]);
  calls[0]?.end();
  await settle();
  expect(calls[1]?.values).toEqual([["b", 1], ["a", 3]]);
  calls[1]?.end();
  await Promise.all(done);
  expect(calls.length).toBe(2);
});

test("one call is in flight, however many values come", async () => {
  const { calls, coalescer } = sender();
  for (let value = 0; value < 100; value += 1) void coalescer.set("a", value);
  await settle();
  expect(calls.length).toBe(1);
  calls[0]?.end();
  await settle();
  expect(calls.map((call) => call.values)).toEqual([[["a", 0]], [["a", 99]]]);
});

test("the promise of a replaced value resolves with the call of the newer one", async () => {
  const { calls, coalescer } = sender();
  void coalescer.set("a", 1);
  let answered = false;
  const older = coalescer.set("a", 2).then(() => (answered = true));
  void coalescer.set("a", 3);
  calls[0]?.end();
  await settle();
  expect(answered).toBe(false);
  calls[1]?.end();
  await older;
});

test("pending values can be dropped", async () => {
  const { calls, coalescer } = sender();
  void coalescer.set("x", 0);
  const dropped = coalescer.set("arm/a", 1);
  void coalescer.set("leg/a", 2);
  coalescer.drop((key) => key.startsWith("arm/"));
  calls[0]?.end();
  await settle();
  expect(calls[1]?.values).toEqual([["leg/a", 2]]);
  calls[1]?.end();
  await dropped;
});
