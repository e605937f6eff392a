// Code for playback in one module, which is loaded with the first recording.
import { effect } from "@preact/signals";
import type { Source } from "../recording/source";
import { Timeline } from "../recording/timeline";
import { ghosts, ghostsAlone, playback } from "../state/playback";
import { scenes } from "../state/scene";
import { Casting } from "./casting";
import { PlaybackBar } from "./PlaybackBar";
import { PlaybackPlots } from "./PlaybackPlots";
import { Player } from "./player";

export { PlaybackBar, PlaybackPlots };

/** The exports of this file. */
export type PlaybackModule = typeof import(".");

let end: (() => void) | undefined;
/** Number of requests: the last one is shown, in any order of reading. */
let asked = 0;

/** Shows a recording in place of the former one, at its first state or playing. Rejects with a sentence if it cannot be read. */
export async function open(name: string, sources: readonly Source[], module: PlaybackModule, plays = false): Promise<void> {
  asked += 1;
  const own = asked;
  const timeline = await Timeline.open(sources);
  if (own !== asked) return;
  close();
  const player = new Player(timeline, name);
  const casting = new Casting(timeline);
  const follow = effect(() => {
    const state = player.shown.value;
    ghosts.value = state && casting.ghosts(state, scenes.value);
  });
  end = () => {
    follow();
    player.stop();
    ghosts.value = null;
    ghostsAlone.value = false;
    playback.value = null;
  };
  playback.value = { player, module };
  if (plays) player.toggle();
}

/** Shows only the world again. */
export function close(): void {
  end?.();
  end = undefined;
}
