// The shown recording, if any: the robots that are drawn in addition to the world.
import { signal } from "@preact/signals";
import type { PlaybackModule } from "../playback";
import type { Player } from "../playback/player";
import type { RobotScene } from "./scene";

/** Robots of a recording at one moment. */
export interface Ghosts {
  /** Scenes of the drawn robots, by name. */
  scenes: ReadonlyMap<string, RobotScene>;
  /** world_from_link, seven a link in the order of the scene's links. */
  poses: ReadonlyMap<string, Float64Array>;
}

/** Player, with the parts of the page for it, which are loaded with the first recording. */
export interface Playback {
  player: Player;
  module: PlaybackModule;
}

export const playback = signal<Playback | null>(null);
export const ghosts = signal<Ghosts | null>(null);
/** Whether the live robots are hidden while a recording is shown. */
export const ghostsAlone = signal(false);
