// Buttons that open a robot's folder or file: alternatives to drag and drop.
import type { ComponentChildren, JSX } from "preact";
import { useRef } from "preact/hooks";
import { whyNotAll } from "../state/permission";
import { chosenFiles } from "./dropped-files";
import { takeFiles } from "./take-files";

/** Endings of the files that the dialog shows. */
const ACCEPTED = ".urdf,.xacro,.sdf,.world,.mjcf,.xml,.zip,.mcap";

interface Properties {
  children: ComponentChildren;
  class?: string;
}

/** Asks for a folder. */
export function OpenFolder(properties: Properties): JSX.Element {
  return <Opener {...properties} testId="open-folder" inputId="folder-input" label="Folder of a robot" title="Load a robot: choose the folder with its description and meshes, or drop it on the page" isFolder />;
}

/** Asks for files: a description, a zip, or a recording. */
export function OpenFile(properties: Properties): JSX.Element {
  return <Opener {...properties} testId="open-file" inputId="file-input" label="File of a robot" title="Load a zip or a description that needs no other file, or play a recording (MCAP)" />;
}

interface OpenerProperties extends Properties {
  testId: string;
  inputId: string;
  label: string;
  title: string;
  isFolder?: boolean;
}

function Opener({ children, class: className, testId, inputId, label, title, isFolder = false }: OpenerProperties): JSX.Element {
  const input = useRef<HTMLInputElement>(null);
  // A file may be a recording, which every client may play.
  const whyNot = isFolder ? whyNotAll.value : "";
  return (
    <>
      <button type="button" class={className ?? "button"} data-testid={testId} title={whyNot || title} disabled={whyNot !== ""} onClick={() => input.current?.click()}>
        {children}
      </button>
      <input
        ref={(element) => {
          input.current = element;
          // Lets the user choose a folder; no standard property exists for this.
          if (isFolder) element?.setAttribute("webkitdirectory", "");
        }}
        type="file"
        multiple
        hidden
        {...(!isFolder && { accept: ACCEPTED })}
        data-testid={inputId}
        aria-label={label}
        onChange={(event) => {
          const { files } = event.currentTarget;
          if (files && files.length > 0) void takeFiles(Promise.resolve(chosenFiles(files)));
          event.currentTarget.value = "";
        }}
      />
    </>
  );
}
