// Choice of the shown recording among several.
import { expect, test, vi } from "vitest";
import { recording } from "../recording/fixture";
import { fileSource, type Source } from "../recording/source";
import { playback } from "../state/playback";
import { open, type PlaybackModule } from ".";

vi.mock("./PlaybackBar", () => ({ PlaybackBar: () => null }));
vi.mock("./PlaybackPlots", () => ({ PlaybackPlots: () => null }));
vi.mock("./casting", () => ({ Casting: class { ghosts = () => null } }));

test("the later of two opened recordings is shown, even if it is read first", async () => {
  const source = fileSource(Object.assign(new Blob([await recording({ states: 20 })]), { name: "run.mcap" }));
  let answer = (): void => undefined;
  const held = new Promise<void>((resolve) => (answer = resolve));
  const slow: Source = { ...source, read: (offset, length) => held.then(() => source.read(offset, length)) };
  const module = {} as PlaybackModule;
  const first = open("first", [slow], module);
  await open("second", [source], module);
  answer();
  await first;
  expect(playback.value?.player.name).toBe("second");
});
