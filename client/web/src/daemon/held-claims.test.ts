// A call carries the claim that allows it.
import { beforeEach, expect, test, vi } from "vitest";

const stored = new Map<string, string>();
vi.stubGlobal("sessionStorage", { getItem: (key: string) => stored.get(key) ?? null, setItem: (key: string, value: string) => void stored.set(key, value) });
const { claimFor, heldClaims, keepClaims, WORLD } = await import("./held-claims");

beforeEach(() => {
  for (const what of [...heldClaims().keys()]) keepClaims(what, undefined);
});

test("a call that names a robot has that robot's claim, and others have that of the world", () => {
  expect(claimFor({ robot: "arm" })).toBe("");
  keepClaims("arm", "a");
  keepClaims("leg", "l");
  keepClaims(WORLD, "w");
  expect(claimFor({ robot: "leg" })).toBe("l");
  expect(claimFor({ robots: [{ robot: "arm" }] })).toBe("a");
  expect(claimFor({ robots: ["arm"] })).toBe("a");
  expect(claimFor({ state: 2 })).toBe("w");
  expect(claimFor({ robot: "other" })).toBe("w");
});

test("a page that has claimed robots only sends one of these claims with calls that concern the world", () => {
  keepClaims("arm", "a");
  expect(claimFor({ state: 2 })).toBe("a");
});

test("claims outlive a reload of the page", () => {
  keepClaims("arm", "a");
  expect(JSON.parse(stored.get("simd.claims") ?? "")).toEqual([["arm", "a"]]);
});
