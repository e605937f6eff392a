// Accepts files that are dropped anywhere on the page, and shows a hint while they are dragged over it.
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { droppedFiles } from "./dropped-files";
import { Icon } from "./icons";
import { takeFiles } from "./take-files";

const dragging = signal(false);

/** Takes everything that the page accepts. */
const FORMATS = "A folder, a zip or a file: URDF, xacro, SDF or MJCF with meshes (STL, DAE, OBJ, glTF); or a recording (MCAP)";

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
      void takeFiles(droppedFiles(event.dataTransfer.items));
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
        <p class="hint">{FORMATS}</p>
      </div>
    </div>
  );
}
