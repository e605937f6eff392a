// A button that opens a robot's folder: an alternative to drag and drop.
import type { ComponentChildren, JSX } from "preact";
import { useRef } from "preact/hooks";
import { tool } from "../state/tools";
import { chosenFiles } from "./dropped-files";

/** The button. */
export function OpenFolder({ children, class: className }: { children: ComponentChildren; class?: string }): JSX.Element {
  const input = useRef<HTMLInputElement>(null);
  return (
    <>
      <button
        type="button"
        class={className ?? "button"}
        data-testid="open-folder"
        title="Load a robot: choose the folder with its URDF and meshes, or drop it on the page"
        onClick={() => input.current?.click()}
      >
        {children}
      </button>
      <input
        ref={(element) => {
          input.current = element;
          // Choose a folder; there is no standard property for this.
          element?.setAttribute("webkitdirectory", "");
        }}
        type="file"
        multiple
        hidden
        data-testid="folder-input"
        aria-label="Folder of a robot"
        onChange={(event) => {
          const { files } = event.currentTarget;
          if (files && files.length > 0) tool.value = { kind: "load", files: chosenFiles(files) };
          event.currentTarget.value = "";
        }}
      />
    </>
  );
}
