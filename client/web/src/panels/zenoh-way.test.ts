// Locator of Zenoh, from the document at the daemon's port.
import { expect, test } from "vitest";
import { wayOf } from "./zenoh-way";

const ways = (zenoh: readonly string[], routers: readonly string[] = []): object => ({ name: "lab", version: "1", zenoh, routers });

test("a program on the daemon's machine takes the address at which Zenoh listens, and that of its protocol first", () => {
  expect(wayOf(ways(["tcp/127.0.0.1:7447"]), "127.0.0.1", false)).toEqual({ kind: "reached", locator: "tcp/127.0.0.1:7447" });
  expect(wayOf(ways(["tcp/127.0.0.1:7447", "tls/127.0.0.1:7448"]), "localhost", true)).toEqual({ kind: "reached", locator: "tls/127.0.0.1:7448" });
  expect(wayOf(ways(["tcp/0.0.0.0:7447"]), "[::1]", false)).toEqual({ kind: "reached", locator: "tcp/[::1]:7447" });
});

test("a program elsewhere takes the name by which it reaches the machine, or a router", () => {
  expect(wayOf(ways(["tcp/0.0.0.0:7450"]), "lab", false)).toEqual({ kind: "reached", locator: "tcp/lab:7450" });
  expect(wayOf(ways(["tcp/[::]:7447"]), "[2001:db8::1]", false)).toEqual({ kind: "reached", locator: "tcp/[2001:db8::1]:7447" });
  expect(wayOf(ways(["tcp/127.0.0.1:7447"], ["tcp/router:7447"]), "lab", false)).toEqual({ kind: "reached", locator: "tcp/router:7447" });
});

test("a daemon that listens only for its own machine, and one without Zenoh, are distinguished", () => {
  expect(wayOf(ways(["tcp/127.0.0.1:7447"]), "lab", false)).toEqual({ kind: "near", locator: "tcp/127.0.0.1:7447" });
  expect(wayOf(ways(["tcp/[::1]:7447"]), "lab", false)).toEqual({ kind: "near", locator: "tcp/[::1]:7447" });
  expect(wayOf(ways([]), "lab", false)).toEqual({ kind: "off" });
});

test("another document gives no address", () => {
  for (const document of [null, "text", {}, []]) expect(wayOf(document, "lab", false)).toBeUndefined();
  expect(wayOf({ zenoh: "tcp/127.0.0.1:7447" }, "lab", false)).toEqual({ kind: "off" });
});
