// The shell line that the empty world shows.
import { expect, test } from "vitest";
import { loadCommand } from "./load-command";

test("the line names the daemon only where simctl would not find it by itself", () => {
  expect(loadCommand("127.0.0.1:7400")).toBe("simctl robot load path/to/robot.urdf");
  expect(loadCommand("lab:7410")).toBe("simctl robot load path/to/robot.urdf --endpoint lab:7410");
  expect(loadCommand("lab")).toContain("--endpoint lab:80");
});
