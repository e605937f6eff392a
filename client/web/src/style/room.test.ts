// The page detects an upright phone, a phone on its side, and large text.
import { expect, test, vi } from "vitest";

vi.stubGlobal("innerWidth", 1280);
vi.stubGlobal("innerHeight", 720);
vi.stubGlobal("addEventListener", () => undefined);
vi.stubGlobal("document", { documentElement: { dataset: {} } });
vi.stubGlobal("matchMedia", () => ({ matches: false, addEventListener: () => undefined }));
vi.stubGlobal("localStorage", { getItem: () => null, setItem: () => undefined });
vi.stubGlobal("sessionStorage", { getItem: () => null, setItem: () => undefined });
const { roomOf } = await import("./room");

test("a phone that lies has picture and panel side by side, one that stands has not", () => {
  expect(roomOf(740, 360, 100)).toBe("short");
  expect(roomOf(390, 844, 100)).toBe("tall");
  expect(roomOf(1280, 720, 100)).toBe("wide");
  expect(roomOf(400, 380, 100)).toBe("tall");
});

test("large text is as a small window", () => {
  expect(roomOf(1280, 720, 200)).toBe("short");
  expect(roomOf(1280, 1400, 200)).toBe("tall");
  expect(roomOf(2560, 1440, 200)).toBe("wide");
});
