// Changes are undone and redone in order. A change that cannot be undone gives one message, and is dropped.
import { beforeEach, expect, test } from "vitest";
import { toasts } from "./toasts";
import { changed, future, making, past, redo, undo } from "./undo";

const done: string[] = [];

function change(what: string, of?: string): Parameters<typeof changed>[0] {
  const note = (word: string) => async () => void done.push(`${word} ${what}`);
  return { what, undo: note("undo"), redo: note("redo"), ...(of !== undefined && { of }) };
}

beforeEach(() => {
  past.value = [];
  future.value = [];
  toasts.value = [];
  done.length = 0;
});

test("the newest change is undone first, and redone first", async () => {
  changed(change("a"));
  changed(change("b"));
  await undo();
  await undo();
  await undo();
  await redo();
  expect(done).toEqual(["undo b", "undo a", "redo a"]);
  expect(past.value.map(({ what }) => what)).toEqual(["a"]);
  expect(future.value.map(({ what }) => what)).toEqual(["b"]);
});

test("an undo during another one comes after it", async () => {
  let finish = (): void => undefined;
  changed({ what: "slow", undo: () => new Promise<void>((resolve) => (finish = resolve)), redo: async () => void done.push("redo slow") });
  const [first, second] = [undo(), redo()];
  await Promise.resolve();
  expect(done).toEqual([]);
  finish();
  await Promise.all([first, second]);
  expect(done).toEqual(["redo slow"]);
});

test("an undo waits for a change that the daemon has not answered yet, and takes that one back", async () => {
  changed(change("before"));
  let answer = (): void => undefined;
  const answered = new Promise<void>((resolve) => (answer = resolve));
  void making(answered.then(() => changed(change("under way"))));
  void making(Promise.reject(new Error("refused"))).catch(() => undefined);
  const undone = undo();
  await Promise.resolve();
  expect(done).toEqual([]);
  answer();
  await undone;
  expect(done).toEqual(["undo under way"]);
});

test("a new change ends what could be redone", async () => {
  changed(change("a"));
  await undo();
  changed(change("b"));
  await redo();
  expect(done).toEqual(["undo a"]);
});

test("changes of one thing within a second are one, whose undo returns to before the first", async () => {
  changed(change("first", "elbow"), 0);
  changed(change("second", "elbow"), 900);
  changed(change("third", "elbow"), 1800);
  changed(change("later", "elbow"), 3000);
  await undo();
  await undo();
  await redo();
  expect(done).toEqual(["undo later", "undo first", "redo third"]);
});

test("a change that cannot be undone is reported, and does not block earlier ones", async () => {
  changed(change("a"));
  changed({ ...change("b"), undo: () => Promise.reject(new Error("robot b is gone.")) });
  await undo();
  expect(toasts.value.map(({ kind, sentence }) => [kind, sentence])).toEqual([["error", "B cannot be undone: robot b is gone."]]);
  await undo();
  expect(done).toEqual(["undo a"]);
});

test("a hundred changes are kept", () => {
  for (let index = 0; index < 150; index += 1) changed(change(String(index)));
  expect([past.value.length, past.value[0]?.what]).toEqual([100, "50"]);
});
