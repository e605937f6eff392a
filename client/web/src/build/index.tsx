// The tools for building the world, which are loaded together when the first of them is opened.
import "../style/build.css";
import type { JSX } from "preact";
import { tool } from "../state/tools";
import { AddSheet } from "./AddSheet";
import { AskSheet } from "./AskSheet";
import { LoadSheet } from "./LoadSheet";
import { RobotsSheet } from "./RobotsSheet";
import { SavedStatesSheet } from "./SavedStatesSheet";

export { BuildMenu } from "./BuildMenu";
export { FilmNote } from "./FilmNote";
export { PlaceCard } from "./PlaceCard";

/** The open sheet. */
export function ToolSheet(): JSX.Element | null {
  const open = tool.value;
  switch (open?.kind) {
    case undefined:
      return null;
    case "load":
      return <LoadSheet files={open.files} />;
    case "add":
      return <AddSheet />;
    case "robots":
      return <RobotsSheet />;
    case "saved-states":
      return <SavedStatesSheet />;
    case "ask":
      return <AskSheet title={open.title} text={open.text} button={open.button} run={open.run} />;
  }
}
