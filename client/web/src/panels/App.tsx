// The page: the world and what is around it.
import type { JSX } from "preact";
import { Viewport } from "../scene/Viewport";

export function App(): JSX.Element {
  return <Viewport />;
}
