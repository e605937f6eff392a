// Every event of the schema has words, and an event of a newer schema does not break the page.
import { create, fromBinary, toBinary } from "@bufbuild/protobuf";
import { expect, test } from "vitest";
import { EventSchema, RecordingEndCause, ReleaseCause, TrajectoryOutcome } from "../gen/simd/v1/event_pb";
import { wordsOf } from "./event-words";

const UNKNOWN = "does not know";

test("every event of the schema has a separate text", () => {
  const kinds = EventSchema.oneofs[0]?.fields ?? [];
  expect(kinds.length).toBeGreaterThanOrEqual(17);
  const texts = kinds.map((field) => {
    const value = create(field.message ?? EventSchema);
    const { text } = wordsOf(create(EventSchema, { kind: { case: field.localName, value } as never }));
    expect(text).not.toContain(UNKNOWN);
    expect(text).not.toContain("undefined");
    return text;
  });
  expect(new Set(texts).size).toBe(texts.length);
});

test("an unknown event is shown as unknown", () => {
  const bytes = toBinary(EventSchema, create(EventSchema, { sequence: 3n }));
  // Field 4000, a message of two bytes.
  const newer = Uint8Array.from([...bytes, 0x82, 0xfa, 0x01, 2, 8, 1]);
  expect(wordsOf(fromBinary(EventSchema, newer)).text).toContain(UNKNOWN);
});

test("events that need attention are warnings", () => {
  const words = (kind: Parameters<typeof create<typeof EventSchema>>[1]) => wordsOf(create(EventSchema, kind));
  const stopped = { recording: "run", cause: RecordingEndCause.STOPPED, message: "it was stopped" };
  expect(words({ kind: { case: "recordingEnded", value: stopped } })).toEqual({ text: "The recording run ended", isWarning: false });
  const full = { recording: "run", cause: RecordingEndCause.WRITE_FAILED, message: "no space left on device" };
  expect(words({ kind: { case: "recordingEnded", value: full } })).toEqual({ text: "The recording run ended: no space left on device", isWarning: true });
  const left = { robot: "arm", id: 2n, outcome: TrajectoryOutcome.PATH_TOLERANCE_VIOLATED, message: "elbow is 0.2 rad off" };
  expect(words({ kind: { case: "trajectoryEnded", value: left } })).toEqual({ text: "Trajectory 2 of arm left its path: elbow is 0.2 rad off", isWarning: true });
});

test("a call that was noted is described as what was done", () => {
  const value = { token: "anna", client: "", method: "/simd.v1.JointService/SetJointTargets", robots: ["arm"], code: 7 };
  expect(wordsOf(create(EventSchema, { kind: { case: "auditedCall", value } })).text).toBe("anna asked to set joint targets of arm, and was refused");
});

test("joints of a robot that is claimed whole are not listed again", () => {
  const value = { holder: "anna", robots: ["arm"], joints: ["arm/a", "arm/b", "leg/knee"] };
  expect(wordsOf(create(EventSchema, { kind: { case: "jointsClaimed", value } })).text).toBe("anna claimed arm and leg/knee");
  const taken = { ...value, joints: [], cause: ReleaseCause.TAKEN_OVER, takenOverBy: "otto" };
  expect(wordsOf(create(EventSchema, { kind: { case: "jointsReleased", value: taken } })).text).toBe("otto took over arm from anna");
});
