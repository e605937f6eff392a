// Questions before a change that concerns all clients.
import { expect, test, vi } from "vitest";
import { askFirst, refreshClientsBy, tool } from "./tools";
import { clients } from "./world";

const other = { name: "another page", isCaller: false } as (typeof clients.value)[number];

test("clients that connected since the last request count, and a second click meanwhile does nothing", async () => {
  clients.value = [];
  let arrive = (): void => undefined;
  const came = new Promise<void>((resolve) => (arrive = resolve));
  refreshClientsBy(async () => {
    await came;
    clients.value = [other];
  });
  const run = vi.fn();
  askFirst("Reset", "For everybody.", "Reset", run);
  askFirst("Reset", "For everybody.", "Reset", run);
  expect(tool.value).toBeNull();
  arrive();
  await vi.waitFor(() => expect(tool.value).toMatchObject({ kind: "ask", run }));
  expect(run).not.toHaveBeenCalled();
});

test("a daemon that does not say who is here holds up nothing", async () => {
  clients.value = [];
  refreshClientsBy(() => Promise.reject(new Error("unavailable")));
  const run = vi.fn();
  askFirst("Reset", "For everybody.", "Reset", run);
  await vi.waitFor(() => expect(run).toHaveBeenCalledOnce());
  askFirst("Reset", "For everybody.", "Reset", run);
  await vi.waitFor(() => expect(run).toHaveBeenCalledTimes(2));
});
