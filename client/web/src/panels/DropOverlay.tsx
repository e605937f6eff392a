// Accepts files that are dropped anywhere on the page, and shows a hint while they are dragged over it.
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import type { DroppedFile } from "../daemon/actions";
import { isRecording, playFiles } from "../daemon/recordings";
import { toast } from "../state/toasts";
import { tool } from "../state/tools";
import { droppedFiles } from "./dropped-files";
import { Icon } from "./icons";

const dragging = signal(false);

/** Rendered only while files are dragged over the page. */
export function DropOverlay(): JSX.Element | null {
  useEffect(() => {
    // The pointer also leaves a parent when it enters a child: the two events are counted.
    let inside = 0;
    const carries = (event: DragEvent): boolean => event.dataTransfer?.types.includes("Files") ?? false;
    const over = (event: DragEvent): void => {
      if (carries(event)) event.preventDefault();
    };
    const enter = (event: DragEvent): void => {
      if (!carries(event)) return;
      inside += 1;
      dragging.value = true;
    };
    const leave = (event: DragEvent): void => {
      if (!carries(event)) return;
      inside = Math.max(0, inside - 1);
      dragging.value = inside > 0;
    };
    const drop = (event: DragEvent): void => {
      inside = 0;
      dragging.value = false;
      if (!carries(event) || !event.dataTransfer) return;
      event.preventDefault();
      droppedFiles(event.dataTransfer.items).then(take, (problem: unknown) => {
        toast("error", `The dropped files could not be read: ${problem instanceof Error ? problem.message : String(problem)}.`);
      });
    };
    const handlers = { dragover: over, dragenter: enter, dragleave: leave, drop } as const;
    for (const [name, handler] of Object.entries(handlers)) addEventListener(name as "drop", handler);
    return () => {
      for (const [name, handler] of Object.entries(handlers)) removeEventListener(name as "drop", handler);
    };
  }, []);
  if (!dragging.value) return null;
  return (
    <div class="drop-overlay" data-testid="drop-overlay">
      <div>
        <Icon name="folder" />
        <p>Drop to load the robot, or to play the recording</p>
        <p class="hint">The robot’s folder, with the URDF and its meshes; or a file of MCAP</p>
      </div>
    </div>
  );
}

/** Asks what robots are to become, or plays a recording. */
async function take(files: DroppedFile[]): Promise<void> {
  const recorded = files.filter(({ path }) => isRecording(path));
  if (recorded.length > 0) await playFiles(recorded.map(({ file }) => file));
  else tool.value = { kind: "load", files };
}
